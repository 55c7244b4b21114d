"""`beacon-mj certify`."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from beacon_mj.cli import FAILED, options

if TYPE_CHECKING:
    from beacon_mj.eval.metrics.row import Row

HEADINGS = ("scenes", "clean", "steps", "path m", "energy J", "wall s")


def certify(
    scenes: Path,
    /,
    *,
    workers: options.Workers = None,
    settings: Annotated[
        options.Settings,
        Parameter(help="clairvoyant.field=value, or protocol.field=value; repeatable."),
    ] = (),
) -> int:
    """Solve stored scenes in MuJoCo with full knowledge; store in each how it went.

    Status 1 if a scene was not solved without damage. The SHA-256 that identifies a
    scene does not depend on the outcome stored here.

    Parameters
    ----------
    scenes
        Folder of scenes (*.json), such as `generate` writes.
    """
    from beacon_mj.cli.progress import progress
    from beacon_mj.eval.studies.certify import certification, certify_scenes

    config, refs = certification(scenes, settings)
    rows: list[Row] = []
    count = min(workers or os.cpu_count() or 1, len(refs))
    with progress(len(refs), rows) as update:
        for row in certify_scenes(config, refs, count):
            rows.append(row)
            update([row])
    return _report(rows)


def _report(rows: list[Row]) -> int:
    """Print a line a family, and name what was not solved; return the status."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    from beacon_mj.cli.tables import console
    from beacon_mj.eval.studies.certify import verdict

    table = Table("family", box=SIMPLE_HEAD)
    for name in HEADINGS:
        table.add_column(name, justify="right")
    for family in sorted({row.family for row in rows}):
        table.add_row(family, *_line([r for r in rows if r.family == family]))
    console().print(table)
    failed = [row for row in rows if not row.clean_success]
    for row in sorted(failed, key=lambda r: r.key):
        print(
            f"{row.scene_name}: {verdict(row)}. {row.detail}".rstrip(),
            file=sys.stderr,
        )
    print(f"{len(rows) - len(failed)} of {len(rows)} scenes solved without damage")
    return FAILED if failed else 0


def _line(rows: list[Row]) -> list[str]:
    """Return counts, then means over all scenes of a family."""
    n = len(rows)
    return [
        str(n),
        str(sum(row.clean_success for row in rows)),
        f"{sum(row.steps for row in rows) / n:.1f}",
        f"{sum(row.path_length_m for row in rows) / n:.2f}",
        f"{sum(row.energy_j for row in rows) / n:.1f}",
        f"{sum(row.wall_time_s for row in rows) / n:.1f}",
    ]
