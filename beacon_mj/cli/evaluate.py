"""`beacon-mj eval`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import options


def evaluate(
    *,
    planner: Annotated[
        tuple[str, ...],
        Parameter(
            negative=(),
            show_default=False,
            consume_multiple=True,
            help="A name (see `beacon-mj planners`), `all` for the five of the "
            "paper, path/to/file.py:Class, or exec:COMMAND for a program that speaks "
            "JSON; several, or repeated.",
        ),
    ] = (),
    settings: options.SetOption = (),
    vary: options.VaryOption = (),
    protocol: options.ProtocolOption = None,
    robot: Annotated[
        str | None,
        Parameter(
            help="Robot in all scenes: a name (see `beacon-mj robots`) or FILE.xml; "
            "by default the family's, or the disc."
        ),
    ] = None,
    world: options.WorldOption = None,
    suite: options.Suite = (),
    family: options.Family = (),
    scenes_per_family: Annotated[
        options.ScenesPerFamily | None,
        Parameter(help=f"{options.SCENES_HELP} Of stored scenes, all."),
    ] = None,
    seed: options.Seed = 0,
    perception: options.Perception = None,
    scene_dir: Annotated[
        Path | None, Parameter(help="Folder of stored scenes to use.")
    ] = None,
    templates: options.Templates = None,
    workers: options.Workers = None,
    cluster: Annotated[
        str | None,
        Parameter(
            help="Address of a dask scheduler, such as tcp://node1:8786, whose workers "
            "run the episodes.",
        ),
    ] = None,
    shard: Annotated[
        str | None,
        Parameter(help="I/N: only part I of N of the scenes; see `beacon-mj merge`."),
    ] = None,
    out: Annotated[
        Path | None,
        Parameter(help="Run folder; by default a new one under runs/."),
    ] = None,
    log: Annotated[
        options.Log,
        Parameter(
            help="Which episodes leave an MCAP log: all, those that were no clean "
            "success, or none."
        ),
    ] = "all",
    resume: Annotated[
        options.Flag,
        Parameter(
            help="Go on with the run in --out; without --planner, with its options."
        ),
    ] = False,
    report: options.Report = True,
    trust_code: options.TrustCode = False,
    isolate: Annotated[
        bool | None,
        Parameter(
            negative="--no-isolate",
            show_default=False,
            help="Run every planner in a process of its own, or none; by default those "
            "from files do. Programs always do.",
        ),
    ] = None,
    json: options.Json = False,
) -> None:
    """Run planners through scenes: every planner crosses every scene.

    The run folder holds config.json, episodes.jsonl (a line for every finished
    episode), and at the end episodes.parquet, summary.json and report.html; a shard
    has no report, `beacon-mj merge` writes that of the whole run.
    """
    # Only now: help must not wait for MuJoCo and numba.
    import beacon_mj
    from beacon_mj.cli.views.console import remark, show, show_json, show_page

    results = beacon_mj.evaluate(
        planner,
        protocol=protocol,
        robot=robot,
        world=world,
        families=family,
        suite=suite,
        scenes_per_family=scenes_per_family,
        seed=seed,
        perception=perception,
        settings=settings,
        vary=vary,
        scene_dir=scene_dir,
        templates=templates,
        out=out,
        workers=workers,
        cluster=cluster,
        shard=shard,
        isolate=isolate,
        log=log,
        resume=resume,
        report=False,  # After the tables, which nobody should wait for.
        trust_code=trust_code,
        progress=beacon_mj.show_progress,
        tell=lambda line: remark(f"note: {line}"),
    )
    remark(*results.failures())
    if json:
        show_json(results.summary())
    else:
        show(results.table())
    remark(f"results: {results.folder}")
    if report:
        show_page(results)
