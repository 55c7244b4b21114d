"""Running planners through scenes, and putting the parts of a run together."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from beacon_mj.episode.protocol import Protocol, WorldKind
from beacon_mj.errors import RunError
from beacon_mj.eval.api.reports import closing_report
from beacon_mj.eval.runs.config import Logging
from beacon_mj.eval.runs.evaluation import EvaluationOptions, prepare
from beacon_mj.eval.runs.lineup import PlannerChoice
from beacon_mj.eval.runs.presets import in_world
from beacon_mj.eval.runs.progress import Progress, quiet
from beacon_mj.eval.runs.variants import Values, VaryValues
from beacon_mj.eval.runs.whole_numbers import check_whole_numbers
from beacon_mj.eval.runs.worker_process import usable_cores
from beacon_mj.eval.statistics.results import Results, load_results
from beacon_mj.eval.statistics.summary import summarize
from beacon_mj.eval.studies.merge import merge as merge_shards
from beacon_mj.scene import Profile
from beacon_mj.scene_gen.suites import suites_of


def evaluate(
    planners: Sequence[PlannerChoice] | Mapping[str, PlannerChoice] = (),
    *,
    families: Sequence[str] = (),
    suite: str | Sequence[str] = (),
    scenes_per_family: int | None = None,
    seed: int = 0,
    perception: Profile | None = None,
    settings: Values = (),
    vary: VaryValues = (),
    protocol: Protocol | str | None = None,
    robot: str | Path | None = None,
    world: WorldKind | None = None,
    scene_dir: str | Path | None = None,
    templates: str | Path | None = None,
    out: str | Path | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    shard: str | None = None,
    isolate: bool | None = None,
    log: Logging = "all",
    resume: bool = False,
    report: bool = True,
    trust_code: bool = False,
    progress: Progress = quiet,
    tell: Callable[[str], None] = lambda _: None,
) -> Results:
    """Run planners through scenes: every planner crosses every scene.

    The same as `beacon-mj eval`. Rows are in the run folder as soon as their episodes
    end, so that a run which is stopped goes on with `resume=True`.

    Args:
        planners: Names (see `list_planners`), `all` for the five of the paper,
            `path/to/file.py:Class`, `exec:COMMAND` for a program that speaks JSON, or
            subclasses of `Planner`, also of a notebook. A pair `(planner, values)`
            configures one, with an instance of its `Config` or a mapping of fields; a
            mapping gives planners names.
        families: Names of scene families; those of suite `paper-v1` by default.
        suite: Suites, one or several, in place of `families`: `paper-v1`,
            `learning-v1`, `hard-v1`, `scale-v1`, one that your own families name, or
            `all`.
        scenes_per_family: Default 100, or the whole rounds of latent worlds nearest to
            it; of `scene_dir` all.
        seed: Seed of scenes, perception and planners, >= 0.
        perception: What planners are told about class and material: `truth`, `noisy`
            or `misleading`. Default: `noisy`, or what stored scenes say.
        settings: Values by `planner.field` or `protocol.field`, as a mapping or as
            texts `planner.field=value`.
        vary: Several values by `planner.field` or `protocol.field`, as a mapping or as
            texts `planner.field=a,b,c`. Every planner runs with each combination of its
            own values and the protocol's, as a planner of its own such as
            `beacon[push_bias=0.5]`, and the rows have a column a setting.
        protocol: How episodes are run: a protocol, or the name of a preset, `paper` or
            `realistic`; `settings` change it.
        robot: The robot in all scenes: a name (see `list_robots`) or a file of your
            own; by default the family's, or the disc.
        world: World of all episodes: `mujoco`, the default, or `planar`, the paper's.
        scene_dir: Folder of stored scenes, in place of generated ones.
        templates: Folder of your own family templates.
        out: Run folder, new or empty; by default a new one below `runs/`, as for the
            command. `results.folder` says which.
        workers: Processes; by default one per usable core.
        cluster: Address of a dask scheduler whose workers run the episodes instead.
        shard: `I/N`: only part I of N of the scenes; see `merge`.
        isolate: Whether planners run in processes of their own, where nothing that they
            do reaches the evaluation; by default those from files do. Programs always
            do.
        log: Which episodes leave an MCAP log: `all`, `failures`, or `none`.
        resume: Go on with the run in `out`; without planners, with its own options.
        report: Whether to write the run's page at the end, `report.html` in its folder;
            a shard has none, see `merge`.
        trust_code: Run the files of planners and layouts, and programs, that only the
            folder in `out` names, when going on without naming planners. They may be a
            stranger's.
        progress: Shows what is done, such as `beacon_mj.show_progress`; by default
            nothing is shown.
        tell: Told before the start of rounds that `scenes_per_family` cuts, and at the
            end why there is no page, if it could not be written.

    Returns:
        Rows, tables, and the folder. A planner that fails costs its own episode, and
        `results.faults` says where in its code.

    Raises:
        BeaconError: If an option is no good; nothing has been written then.
    """
    check_whole_numbers(seed=seed, scenes_per_family=scenes_per_family, workers=workers)
    if cluster is not None and workers is not None:
        raise RunError("--workers: expected none with --cluster, which has its own.")
    options = EvaluationOptions(
        planners=planners,
        settings=settings,
        vary=vary,
        families=families,
        suites=suites_of(suite),
        scenes_per_family=scenes_per_family,
        seed=seed,
        perception=perception,
        protocol=in_world(protocol, world),
        robot=None if robot is None else str(robot),
        scene_dir=None if scene_dir is None else Path(scene_dir),
        templates=None if templates is None else Path(templates),
        log=log,
        shard=shard,
        isolate=isolate,
    )
    folder = None if out is None else Path(out)
    run = prepare(options, folder, resume=resume, trust_code=trust_code)
    try:
        for note in run.notes():
            tell(note)
        run.run(cluster or workers or usable_cores(), progress)
        run.folder.finish(run.config, run.rows, summarize(run.rows))
    finally:
        run.folder.close()  # A traceback may keep it, in a notebook.
    results = Results(run.folder.path, run.config, run.rows, run.faults)
    if report:
        closing_report(results, tell)
    return results


def merge(
    out: str | Path,
    shards: Sequence[str | Path],
    *,
    report: bool = True,
    tell: Callable[[str], None] = lambda _: None,
) -> Results:
    """Put the shards of one run together: the results of an uninterrupted run.

    Args:
        out: The new run folder.
        shards: Run folders of all shards, in any order; they stay as they are.
        report: Whether to write the page of the whole run, `report.html` in its folder.
        tell: Told why there is no page, if it could not be written.

    Raises:
        RunError: If a folder is no shard, a shard is there twice, is missing or
            unfinished, or two differ in their options; nothing is written then.
    """
    merge_shards(Path(out), [Path(shard) for shard in shards])
    results = load_results(out)
    if report:
        closing_report(results, tell)
    return results
