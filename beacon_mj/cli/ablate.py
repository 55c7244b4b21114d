"""`beacon-mj ablate`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import options


def ablate(
    *,
    planner: Annotated[str, Parameter(help="Whose parts.")],
    settings: options.SetOption = (),
    protocol: options.ProtocolOption = None,
    suite: options.Suite = (),
    family: options.Family = (),
    scenes_per_family: Annotated[
        options.ScenesPerFamily | None, Parameter(help=options.SCENES_HELP)
    ] = None,
    seed: options.Seed = 0,
    templates: options.Templates = None,
    workers: options.Workers = None,
    out: Annotated[
        Path | None,
        Parameter(
            help="Folder; by default a new one under runs/. A folder of the same "
            "options is gone on with."
        ),
    ] = None,
    json: options.Json = False,
) -> None:
    """Switch off a planner's parts one at a time, and change what it perceives.

    A part is a field of the planner's configuration that is true by default.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import remark, show, show_json

    found = beacon_mj.ablate(
        planner,
        settings=settings,
        protocol=protocol,
        families=family,
        suite=suite,
        scenes_per_family=scenes_per_family,
        seed=seed,
        templates=templates,
        workers=workers,
        out=out,
        progress=beacon_mj.show_progress,
        tell=lambda line: remark(f"note: {line}"),
    )
    if json:
        show_json(found.effects)
    else:
        show(found)
    remark(f"results: {found.folder}")
