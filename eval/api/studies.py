"""Studies of many runs: certification, regret, ablations, sweeps."""

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import msgspec
from msgspec import UNSET

from beacon_mj.episode.protocol import WorldKind
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import RunConfig, cut_rounds
from beacon_mj.eval.runs.experiment import single_planner
from beacon_mj.eval.runs.lineup import PlannerChoice
from beacon_mj.eval.runs.presets import with_preset
from beacon_mj.eval.runs.progress import Progress, quiet
from beacon_mj.eval.runs.run_folder import free_name
from beacon_mj.eval.runs.variants import Values, VaryValues, texts_of, vary_texts
from beacon_mj.eval.runs.whole_numbers import check_whole_numbers
from beacon_mj.eval.runs.worker_process import usable_cores
from beacon_mj.eval.studies.ablation import ablation_runs, run_ablation
from beacon_mj.eval.studies.ablation_table import Ablation
from beacon_mj.eval.studies.certify import certification, certify_scenes
from beacon_mj.eval.studies.certify_table import Certification
from beacon_mj.eval.studies.parameter_grid import Grid
from beacon_mj.eval.studies.regret import decompose, regret_runs, run_regret
from beacon_mj.eval.studies.regret_table import Regret
from beacon_mj.eval.studies.sweep import FIRST_SEED, SweepRequest
from beacon_mj.eval.studies.sweep_run import REQUEST, run_sweep
from beacon_mj.eval.studies.sweep_table import Sweep
from beacon_mj.files import replacing
from beacon_mj.scene import Profile
from beacon_mj.scene_gen.suites import suites_of


def certify(
    scene_dir: str | Path,
    *,
    settings: Values = (),
    workers: int | None = None,
    progress: Progress = quiet,
) -> Certification:
    """Solve stored scenes in MuJoCo with full knowledge; store in each how it went.

    The same as `beacon-mj certify`. The SHA-256 that identifies a scene does not depend
    on the outcome that is stored.

    Args:
        scene_dir: Folder of scenes (*.json), such as `generate_scenes` writes.
        settings: Values by `clairvoyant.field` or `protocol.field`; see `evaluate`.
        workers: Processes; by default one per usable core.
        progress: Shows what is done; see `evaluate`.

    Raises:
        BeaconError: If there is no scene, one is not valid, or a setting is no good.
    """
    check_whole_numbers(workers=workers)
    config, refs = certification(Path(scene_dir), texts_of(settings))
    rows = list[Row]()
    with progress("", len(refs)) as update:
        update(rows)
        for row in certify_scenes(config, refs, _count(workers, len(refs))):
            rows.append(row)
            update([row])
    return Certification(rows)


def regret(
    planner: PlannerChoice,
    *,
    settings: Values = (),
    protocol: str | None = None,
    families: Sequence[str] = (),
    suite: str | Sequence[str] = (),
    scenes_per_family: int | None = None,
    seed: int = 0,
    perception: Profile = "noisy",
    templates: str | Path | None = None,
    workers: int | None = None,
    progress: Progress = quiet,
    tell: Callable[[str], None] = lambda _: None,
) -> Regret:
    """Compare a planner with the clairvoyant; say what the difference is paid for.

    The same as `beacon-mj regret`; `beacon_mj.eval.studies.regret` has the equations.

    Args:
        planner: Name, `file.py:Class`, or class; see `evaluate`.
        settings: Values by `planner.field` or `protocol.field`; see `evaluate`.
        protocol: Preset of the protocol; `settings` change it. See `evaluate`.
        families: Scene families; those of suite `paper-v1` by default.
        suite: Suites, in place of `families`; see `evaluate`.
        scenes_per_family: Default 100, or the whole rounds nearest to it.
        seed: Seed of scenes, perception and planners.
        perception: Profile of the uncertain classes.
        templates: Folder of your own family templates.
        workers: Processes; by default one per usable core.
        progress: Shows what is done; see `evaluate`.
        tell: Told before the start of rounds that are cut; see `evaluate`.

    Raises:
        BeaconError: If an option is no good, or the planner is the clairvoyant.
    """
    check_whole_numbers(seed=seed, scenes_per_family=scenes_per_family, workers=workers)
    settings = with_preset(protocol, settings)
    single = single_planner(planner, settings)
    runs, refs = regret_runs(
        planner, settings, families, scenes_per_family, seed, perception,
        None if templates is None else Path(templates), suites_of(suite),
    )  # fmt: skip
    notes = _told(runs, tell)
    rows = list[tuple[str, Row]]()
    with progress("", len(runs) * len(refs)) as update:
        update(())
        count = _count(workers, len(refs))
        for name, row in run_regret(runs, refs, count, single.handed):
            rows.append((name, row))
            update([row])
    entry = single.entry
    return Regret(entry.name, decompose(rows), notes, oracle=entry.oracle)


def ablate(
    planner: PlannerChoice,
    *,
    settings: Values = (),
    protocol: str | None = None,
    families: Sequence[str] = (),
    suite: str | Sequence[str] = (),
    scenes_per_family: int | None = None,
    seed: int = 0,
    templates: str | Path | None = None,
    workers: int | None = None,
    out: str | Path | None = None,
    progress: Progress = quiet,
    tell: Callable[[str], None] = lambda _: None,
) -> Ablation:
    """Switch off a planner's parts one at a time, and change what it perceives.

    The same as `beacon-mj ablate`. A part is a field of the planner's configuration
    that is true by default.

    Args:
        planner: Name, `file.py:Class`, or class; see `evaluate`.
        settings: Values by `planner.field` or `protocol.field`; see `evaluate`.
        protocol: Preset of the protocol; `settings` change it. See `evaluate`.
        families: Scene families; those of suite `paper-v1` by default.
        suite: Suites, in place of `families`; see `evaluate`.
        scenes_per_family: Default 100, or the whole rounds nearest to it.
        seed: Seed of scenes, perception and planners.
        templates: Folder of your own family templates.
        workers: Processes; by default one per usable core.
        out: Folder; by default a new one below `runs/`. A folder of the same options is
            gone on with.
        progress: Shows what is done; see `evaluate`.
        tell: Told before the start of rounds that are cut; see `evaluate`.

    Raises:
        BeaconError: If an option is no good, or several planners are named.
    """
    check_whole_numbers(seed=seed, scenes_per_family=scenes_per_family, workers=workers)
    settings = with_preset(protocol, settings)
    single = single_planner(planner, settings)
    if any(each.config is not None for each in single.handed.values()):
        raise RunError(
            f"{single.entry.name}: expected its values as a mapping, so that its parts "
            "can be switched off, but it was a Config instance."
        )
    runs, refs = ablation_runs(
        planner, settings, families, scenes_per_family, seed,
        None if templates is None else Path(templates), suites_of(suite),
    )  # fmt: skip
    notes = _told(runs, tell)
    name = single.entry.name
    folder = free_name(f"ablation-{name}") if out is None else Path(out)
    handed = {
        entry.name: single.handed[name]
        for entry in next(iter(runs.values())).planners
        if single.handed
    }
    count = workers or usable_cores()
    with _kept(folder):
        effects, ladder = run_ablation(runs, refs, folder, count, progress, handed)
    for file, found in (("ablation.json", effects), ("ladder.json", ladder)):
        text = msgspec.json.format(msgspec.json.encode(found)) + b"\n"
        with replacing(folder / file, RunError) as part:
            part.write_bytes(text)
    oracle = single.entry.oracle
    return Ablation(name, effects, ladder, folder, notes, oracle=oracle)


def sweep(
    planner: str,
    *,
    settings: Values = (),
    vary: VaryValues = (),
    protocol: str | None = None,
    world: WorldKind | None = None,
    grid: Grid = "one-at-a-time",
    trials: int = 0,
    families: Sequence[str] = (),
    suite: str | Sequence[str] = (),
    scenes_per_family: int | None = None,
    select_seed: int = FIRST_SEED,
    seed: int = 0,
    perception: Profile = "noisy",
    workers: int | None = None,
    out: str | Path | None = None,
    resume: bool = False,
    progress: Progress = quiet,
    tell: Callable[[str], None] = lambda _: None,
) -> Sweep:
    """Sweep a planner's parameters: select on one split, report on another.

    The same as `beacon-mj sweep`. Selects by success rate, then by average energy, as
    the paper's Table III does.

    Args:
        planner: Name, or `file.py:Class`.
        settings: Values by `planner.field` or `protocol.field`; see `evaluate`.
        vary: What is swept, by `planner.field` or `protocol.field`; see `evaluate`. By
            default the lines of the paper's Table I that the planner has.
        grid: `one-at-a-time`: each parameter alone, then the best ones together;
            `full`: every combination.
        trials: Configurations that optuna tries beyond the grid.
        protocol: Preset of the protocol; `settings` change it. See `evaluate`.
        world: World that configurations are selected in. Of `planar` the best eight and
            the default are confirmed in MuJoCo, and the best of those is reported.
        families: Scene families; those of suite `paper-v1` by default.
        suite: Suites, in place of `families`; see `evaluate`.
        scenes_per_family: Scenes of each split; default 10, or the whole rounds nearest
            to it.
        select_seed: Seed of the scenes that select, >= 1000.
        seed: Seed of the scenes that the report is on.
        perception: Profile.
        workers: Processes; by default one per usable core.
        out: Folder; by default a new one below `runs/`.
        resume: Go on with the sweep in `out`, with the same options.
        progress: Shows what is done; see `evaluate`.
        tell: Told before the start of rounds that are cut; see `evaluate`.

    Raises:
        BeaconError: If an option is no good, or the folder is another sweep's.
    """
    check_whole_numbers(
        seed=seed,
        select_seed=select_seed,
        scenes_per_family=scenes_per_family,
        trials=trials,
        workers=workers,
    )
    request = SweepRequest(
        planner=planner,
        settings=tuple(with_preset(protocol, settings)),
        vary=tuple(vary_texts(vary)),
        grid=grid,
        families=tuple(families),
        suites=suites_of(suite),
        scenes_per_family=scenes_per_family,
        select_seed=select_seed,
        seed=seed,
        perception=perception,
        trials=trials,
        world=UNSET if world is None else world,
    )
    path = None if out is None else Path(out)
    if resume and path is None:
        raise RunError("--resume: expected --out DIR with the sweep to go on with.")
    if path is not None and not resume and (path / REQUEST).exists():
        raise RunError(f"{path}: holds a sweep. Use --resume, or another --out.")
    folder = path or free_name(f"sweep-{planner.rpartition(':')[2]}")
    with _kept(folder):
        count = workers or usable_cores()
        result = run_sweep(request, folder, count, progress, tell)
    return Sweep(result, folder)


def _told(
    runs: Mapping[str, RunConfig], tell: Callable[[str], None]
) -> tuple[str, ...]:
    """Tell of the rounds that the runs of a study cut, and return the lines."""
    lines = dict.fromkeys(n for run in runs.values() for n in cut_rounds(run.scenes))
    for line in lines:
        tell(line)
    return tuple(lines)


@contextlib.contextmanager
def _kept(folder: Path) -> Iterator[None]:
    """Let an interrupt say where the study stands, and how it goes on."""
    try:
        yield
    except KeyboardInterrupt as stop:
        stop.__notes__ = []  # Those of a single stage would mislead.
        stop.add_note(
            f"interrupted: what is finished is in {folder}; go on with the same "
            f"options and --resume --out {folder}"
        )
        raise


def _count(workers: int | None, jobs: int) -> int:
    return min(workers or usable_cores(), jobs)
