"""`beacon-mj certify`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import FAILED, options


def certify(
    scenes: Path,
    /,
    *,
    workers: options.Workers = None,
    settings: Annotated[
        options.SetOption,
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
    return certify_folder(scenes, settings, workers)


def certify_folder(
    scenes: Path, settings: tuple[str, ...] = (), workers: int | None = None
) -> int:
    """Certify stored scenes and print how it went; return the exit status."""
    import beacon_mj
    from beacon_mj.cli.views.console import remark, show

    found = beacon_mj.certify(
        scenes,
        settings=settings,
        workers=workers,
        progress=beacon_mj.show_progress,
    )
    show(found)
    remark(*found.problems())
    return 0 if found.ok else FAILED
