"""`beacon-mj sweep`."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from beacon_mj.cli import options


def sweep(
    *,
    planner: Annotated[
        str, Parameter(help="Whose parameters: a name, or path/to/file.py:Class.")
    ],
    settings: Annotated[
        options.SetOption,
        Parameter(
            help="protocol.field=value, or planner.field=value for what is not swept; "
            "repeatable.",
        ),
    ] = (),
    vary: Annotated[
        options.VaryOption,
        Parameter(
            help="planner.field=a,b,c or protocol.field=a,b,c, to be swept in place of "
            "Table I; repeatable."
        ),
    ] = (),
    protocol: options.ProtocolOption = None,
    world: Annotated[
        options.World | None,
        Parameter(
            help="World that selects: planar screens the grid there, and confirms the "
            "best eight and the default in MuJoCo, which the report is always of."
        ),
    ] = None,
    grid: Annotated[
        Literal["one-at-a-time", "full"],
        Parameter(
            help="one-at-a-time: each parameter alone, then the best ones together; "
            "full: every combination."
        ),
    ] = "one-at-a-time",
    trials: Annotated[
        int,
        Parameter(
            converter=options.whole,
            validator=options.within("trials"),
            help="Further configurations that optuna tries, between and beyond the "
            "values of the grid.",
        ),
    ] = 0,
    suite: options.Suite = (),
    family: options.Family = (),
    scenes_per_family: Annotated[
        options.ScenesPerFamily | None,
        Parameter(
            help="Scenes per family, of each split; 10 by default, or the whole rounds "
            "of latent worlds nearest to it."
        ),
    ] = None,
    select_seed: Annotated[
        options.Seed, Parameter(help="Seed of the scenes that select; 1000 or more.")
    ] = 1000,
    seed: Annotated[
        options.Seed, Parameter(help="Seed of the scenes that the report is on.")
    ] = 0,
    perception: options.Perception = None,
    workers: options.Workers = None,
    out: Annotated[
        Path | None, Parameter(help="Folder; by default a new one under runs/.")
    ] = None,
    resume: Annotated[
        options.Flag,
        Parameter(help="Go on with the sweep in --out; the options are the same."),
    ] = False,
    json: options.Json = False,
) -> None:
    """Sweep parameters, by default Table I's: select on one split, report on another.

    Selects by success rate, then by average energy, as the paper's Table III does.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import remark, show, show_json

    found = beacon_mj.sweep(
        planner,
        settings=settings,
        vary=vary,
        grid=grid,
        trials=trials,
        protocol=protocol,
        world=world,
        families=family,
        suite=suite,
        scenes_per_family=scenes_per_family,
        select_seed=select_seed,
        seed=seed,
        perception=perception or "noisy",
        workers=workers,
        out=out,
        resume=resume,
        progress=beacon_mj.show_progress,
        tell=lambda line: remark(f"note: {line}"),
    )
    if json:
        show_json(found.result)
    else:
        show(found)
    remark(f"results: {found.folder}")
