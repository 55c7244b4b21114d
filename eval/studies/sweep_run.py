"""All stages of a sweep, one run folder each, and the tables that come out of them."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec
from msgspec import UNSET, UnsetType

from beacon_mj.episode.protocol import WorldKind
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import cut_rounds
from beacon_mj.eval.runs.experiment import run_stage
from beacon_mj.eval.runs.progress import Progress
from beacon_mj.eval.runs.variants import variant_name
from beacon_mj.eval.statistics.clusters import clusters_of
from beacon_mj.eval.statistics.intervals import mcnemar, paired_interval
from beacon_mj.eval.statistics.summary import summarize
from beacon_mj.eval.studies import sweep as stages
from beacon_mj.eval.studies.parameter_grid import (
    Changes,
    settings_of,
)
from beacon_mj.eval.studies.sweep import Score, Span, SweepRequest
from beacon_mj.files import replacing

REQUEST, RESULT = "request.json", "sweep.json"


class Line(msgspec.Struct, frozen=True, kw_only=True):
    """A line of Table I.

    Attributes:
        field: The parameter.
        default: The paper's default.
        values: What was swept.
        alone: The best value with all others at their default; None for a full grid.
        best: Its value in the selected configuration.
    """

    field: str
    default: str
    values: tuple[str, ...]
    alone: str | None
    best: str


class Gain(msgspec.Struct, frozen=True, kw_only=True):
    """Selected less default on the report split, paired by scene.

    Attributes:
        success: Difference of the success rates.
        p_value: Of McNemar's exact test.
        energy_j: Mean difference over all scenes [J], and its bootstrap interval.
    """

    success: float
    p_value: float
    energy_j: Span


class Result(msgspec.Struct, frozen=True, kw_only=True):
    """What a sweep found.

    Attributes:
        request: What was asked for.
        table_i: Default, values and best of each parameter.
        scores: Every configuration on the selection split.
        selected: What the selected configuration changes.
        name: The selected configuration's name in the report.
        report: The tables of the report split; see `summarize`.
        gain: Selected less default; None if they are the same.
        confirmed: The finalists on the selection split in MuJoCo, where the scores are
            of another world.
        agreement: Rank correlation of both worlds over the finalists, and its interval.
    """

    request: SweepRequest
    table_i: tuple[Line, ...]
    scores: tuple[Score, ...]
    selected: dict[str, str]
    name: str
    report: dict[str, Any]
    gain: Gain | None
    confirmed: tuple[Score, ...] | UnsetType = UNSET
    agreement: Span | UnsetType = UNSET


def run_sweep(
    request: SweepRequest,
    out: Path,
    workers: int,
    stage: Progress,
    tell: Callable[[str], None] = lambda _: None,
) -> Result:
    """Run, or go on with, a sweep.

    Args:
        request: What to sweep.
        out: Folder of the sweep: new, or of the same request.
        workers: Processes.
        stage: Opens each stage's progress.
        tell: Told before the start of rounds that are cut.

    Raises:
        BeaconError: If an option is no good, or the folder is another sweep's.
    """
    lines, base = stages.swept_lines(request), stages.base_entry(request)
    settings = settings_of(lines, request.grid)
    # Before anything is written, for it may be bad.
    config, _ = stages.select_config(request, settings)
    _claim(request, out)
    for note in cut_rounds(config.scenes):
        tell(note)
    found = run_settings(request, out / "select", settings, workers, stage)
    alone: dict[str, str | None] = dict.fromkeys(line.field for line in lines)
    if request.grid == "one-at-a-time":
        alone |= {line.field: stages.best_alone(found, line) for line in lines}
        both = stages.combination(found, lines)
        if len(both) > 1:
            found += run_settings(request, out / "combined", [both], workers, stage)
    if request.trials:
        found += _search(request, out, found, workers, stage)
    final, confirmed = found, list[Score]()
    if request.world == "planar":
        path = out / "confirm"
        names = stages.finalists(found)
        final = confirmed = run_settings(request, path, names, workers, stage, UNSET)
    best = stages.best(final).settings
    rows = _report(request, out / "report", best, workers, stage)
    name = variant_name(base.name, best)
    result = Result(
        request=request,
        table_i=tuple(
            Line(
                field=line.field,
                default=line.default,
                values=line.values,
                alone=alone[line.field],
                best=best.get(line.field, line.default),
            )
            for line in lines
        ),
        scores=tuple(found),
        selected=best,
        name=name,
        report=summarize(rows),
        gain=_gain(rows, base.name, name),
        confirmed=tuple(confirmed) or UNSET,
        agreement=stages.order_agreement(found, confirmed) if confirmed else UNSET,
    )
    _write(out / RESULT, result)
    return result


def _claim(request: SweepRequest, out: Path) -> None:
    """Write the request into a new folder, or see that it is the same."""
    path = out / REQUEST
    text = msgspec.json.format(msgspec.json.encode(request), indent=1) + b"\n"
    if path.exists():
        if path.read_bytes() != text:
            raise RunError(f"{out}: expected the options that the sweep began with.")
        return
    if out.is_dir() and any(p.name != f"{REQUEST}.part" for p in out.iterdir()):
        raise RunError(f"{out}: expected a new folder or a sweep but it holds files.")
    out.mkdir(parents=True, exist_ok=True)
    _write(path, request)


def _write(path: Path, value: SweepRequest | Result) -> None:
    text = msgspec.json.format(msgspec.json.encode(value), indent=1) + b"\n"
    with replacing(path, RunError) as part:
        part.write_bytes(text)


def run_settings(
    request: SweepRequest,
    path: Path,
    settings: Sequence[Changes],
    workers: int,
    stage: Progress,
    world: WorldKind | UnsetType | None = None,
) -> list[Score]:
    """Run configurations on the selection split, in the request's world if None."""
    where = request.world if world is None else world
    config, refs = stages.select_config(request, settings, where)
    planner = stages.base_entry(request).name

    def scored(rows: Sequence[Row]) -> list[Score]:
        return stages.scores(rows, planner, settings)

    with stage(path.name, len(settings) * len(refs)) as update:
        rows = run_stage(path, config, refs, workers, update, scored)
    return scored(rows)


def _search(
    request: SweepRequest,
    out: Path,
    found: Sequence[Score],
    workers: int,
    stage: Progress,
) -> list[Score]:
    """Let optuna try configurations beyond the grid."""
    from beacon_mj.eval.studies.search import search

    def tried(number: int, settings: Changes) -> Score:
        path = out / "trials" / f"{number:04d}"
        return run_settings(request, path, [settings], workers, stage)[0]

    return search(request, out, found, tried)


def _report(
    request: SweepRequest, path: Path, best: Changes, workers: int, stage: Progress
) -> list[Row]:
    config, refs = stages.report_config(request, best)
    with stage(path.name, len(config.planners) * len(refs)) as update:
        return run_stage(path, config, refs, workers, update, summarize)


def _gain(rows: Sequence[Row], default: str, selected: str) -> Gain | None:
    if default == selected:
        return None
    ordered = sorted(rows, key=lambda row: row.key)
    first = [row for row in ordered if row.planner == selected]
    second = [row for row in ordered if row.planner == default]
    clusters = clusters_of(first)
    won = [[row.success for row in each] for each in (first, second)]
    energy = paired_interval(
        [row.energy_j for row in first], [row.energy_j for row in second], clusters
    )
    return Gain(
        success=(sum(won[0]) - sum(won[1])) / len(first),
        p_value=mcnemar(won[0], won[1], clusters),
        energy_j=stages.span(energy),
    )
