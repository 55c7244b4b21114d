"""An evaluation: its options, its checked configuration, and running what is left."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path

import msgspec

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import BeaconError, RunError, TemplateError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.code_record import as_it_is, check_trusted, named_code
from beacon_mj.eval.runs.config import (
    Logging,
    RunConfig,
    SceneRef,
    cut_rounds,
    family_scenes,
    generated_scenes,
    scene_refs,
    stored_scenes,
)
from beacon_mj.eval.runs.jobs import Fault, Handovers, Job
from beacon_mj.eval.runs.lineup import PYTHON, PlannerChoice, line_up
from beacon_mj.eval.runs.missions import share_missions
from beacon_mj.eval.runs.progress import Progress
from beacon_mj.eval.runs.run_folder import RunFolder, free_name, load_config
from beacon_mj.eval.runs.runner import plan, resumable, run_jobs
from beacon_mj.eval.runs.shards import parse_shard
from beacon_mj.eval.runs.variants import Values, VaryValues
from beacon_mj.eval.runs.versions import versions
from beacon_mj.eval.runs.whole_numbers import check_episodes
from beacon_mj.scene import Profile
from beacon_mj.scene_gen.robot_contract import robot_faults
from beacon_mj.scene_gen.robots import find_robot

#: Options whose names on the command line are others.
_FLAGS = {
    "planners": "planner",
    "families": "family",
    "suites": "suite",
    "settings": "set",
}


@dataclass(frozen=True, kw_only=True, slots=True)
class EvaluationOptions:
    """The options that decide a run's results; see `beacon_mj.evaluate`."""

    planners: Sequence[PlannerChoice] | Mapping[str, PlannerChoice] = ()
    settings: Values = ()
    vary: VaryValues = ()
    families: Sequence[str] = ()
    suites: Sequence[str] = ()
    scenes_per_family: int | None = None
    seed: int = 0
    perception: Profile | None = None
    protocol: Protocol | None = None
    robot: str | None = None
    scene_dir: Path | None = None
    templates: Path | None = None
    log: Logging = "all"
    shard: str | None = None
    isolate: bool | None = None


@dataclass(kw_only=True, slots=True)
class Evaluation:
    """A run that is under way.

    Attributes:
        config: What is run.
        refs: Its scenes.
        folder: Where it is kept.
        rows: What is finished.
        handed: Planners that no worker can load by their spec, by name.
        faults: Why planners failed, as far as episodes ran in this process' time.
    """

    config: RunConfig
    refs: Sequence[SceneRef]
    folder: RunFolder
    rows: list[Row] = field(default_factory=list)
    handed: Handovers = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)

    @property
    def total(self) -> int:
        """Number of episodes of the whole run."""
        return len(self.config.planners) * len(self.refs)

    def notes(self) -> list[str]:
        """Return what is to be said before it starts: rounds that it cuts."""
        return cut_rounds(self.config.scenes)

    def run(self, workers: int | str, progress: Progress) -> None:
        """Run what is left; rows are on disk as soon as they are in `rows`.

        Args:
            workers: Number of processes, or address of a cluster.
            progress: Opens the display of progress.

        Raises:
            BeaconError: If a scene cannot be made; a run without a row is taken back.
            KeyboardInterrupt: With a note that says how to go on.
        """
        try:
            jobs = plan(self.config, self.refs, self.rows)
            self.rows = self.folder.keep(resumable(jobs, self.rows), self.rows)
            with progress("", self.total) as update:
                update(self.rows)
                for new in self._stream(jobs, workers):
                    self.folder.append(new)
                    self.rows += new
                    update(new)
        except KeyboardInterrupt as stop:
            stop.add_note(
                f"interrupted: {len(self.rows)} of {self.total} episodes are in "
                f"{self.folder.path}; {self._how_to_go_on()}"
            )
            raise
        except BeaconError:
            self.folder.check_in_place()  # Whatever failed, this is why.
            if not self.rows:
                self.folder.discard()
            raise

    def _stream(self, jobs: list[Job], workers: int | str) -> Iterator[list[Row]]:
        """Return the rows as they come, from this machine or from a cluster."""
        config, path, tell = self.config, self.folder.path, self.faults.append
        if isinstance(workers, str):
            from beacon_mj.eval.runs.cluster import run_on_cluster

            return run_on_cluster(config, jobs, path, workers, self.handed, tell)
        count = min(workers, len(jobs) or 1)
        return run_jobs(config, jobs, path, count, self.handed, tell)

    def _how_to_go_on(self) -> str:
        if self.handed:
            return "go on with the same call of evaluate() and resume=True"
        trust = " --trust-code" if named_code(self.config) else ""
        return f"go on with: beacon-mj eval --resume --out {self.folder.path}{trust}"


def prepare(
    options: EvaluationOptions,
    out: Path | None = None,
    *,
    resume: bool = False,
    trust_code: bool = False,
) -> Evaluation:
    """Return a run that is ready to start, or to go on; its folder is there then.

    Args:
        options: What to run; without planners, and with `resume`, what the folder says.
        out: Run folder; None for a new one below `runs/`.
        resume: Whether to go on with the run in `out`.
        trust_code: Whether files that only the folder in `out` names may be executed.

    Raises:
        BeaconError: If an option is no good; nothing has been written then.
    """
    if resume and out is None:
        raise RunError("--resume: expected --out DIR with the run to go on with.")
    named = len(options.planners) > 0
    if resume and out is not None and not named:
        found = _stored(options, out, trust_code)
    else:
        found = _configured(options, out)
    if named and found.folder.is_unborn():
        resume = False  # So that a job that is started anew needs no other command.
    if resume:
        found.rows = found.folder.resume(found.config)
    else:
        found.folder.create(found.config)
    return found


def _stored(options: EvaluationOptions, out: Path, trust_code: bool) -> Evaluation:
    """Return the run of a folder, with its own options."""
    _check_bare(options)
    config = load_config(out)
    handed = [e.name for e in config.planners if e.spec.startswith(PYTHON)]
    if handed:
        raise RunError(
            f"{out}: expected planners that can be loaded by name but {handed[0]} was "
            "given as a Python class: go on with the same call of evaluate() and "
            "resume=True."
        )
    check_trusted(config, trust_code, " Or name the planners and templates yourself.")
    hashes, refs = scene_refs(config)
    config = msgspec.structs.replace(
        config,
        planners=tuple(as_it_is(entry) for entry in config.planners),
        families=hashes,
        versions=versions(),
    )
    return Evaluation(config=config, refs=refs, folder=RunFolder(out))


def _check_bare(options: EvaluationOptions) -> None:
    """Raise if a run that goes on with its own options was given others."""
    for each in fields(EvaluationOptions):
        if getattr(options, each.name) != each.default:
            name = _FLAGS.get(each.name, each.name).replace("_", "-")
            raise RunError(
                f"--{name}: expected no other options with --resume unless --planner "
                "is given too; without it a run goes on with its own."
            )


def _configured(options: EvaluationOptions, out: Path | None) -> Evaluation:
    """Return the checked configuration of a new run, and its scenes."""
    stored, templates = options.scene_dir, options.templates
    if not len(options.planners):
        raise RunError("--planner: expected a planner's name, such as beacon, or all.")
    if stored is not None and templates is not None:
        raise RunError("--templates: expected no templates with --scene-dir.")
    if stored is not None and options.suites:
        raise RunError(
            "--suite: expected none with --scene-dir: name families of the stored "
            "scenes with --family."
        )
    shard = None if options.shard is None else parse_shard(options.shard)
    entries, protocol, handed = line_up(
        options.planners,
        options.settings,
        options.vary,
        _with_robot(options.protocol, options.robot),
        options.isolate,
    )
    count = options.scenes_per_family
    if stored is None:
        hashes, refs = generated_scenes(
            options.families, count, templates, options.suites
        )
    else:
        hashes, refs = stored_scenes(stored, options.families, count)
    check_episodes(len(refs), len(entries))
    config = RunConfig(
        planners=entries,
        families=hashes,
        scenes=family_scenes(hashes, refs, templates, stored=stored is not None),
        scenes_per_family=count,
        seed=options.seed,
        perception=options.perception or (None if stored else "noisy"),
        scene_dir=None if stored is None else str(stored.resolve()),
        templates=None if templates is None else str(templates.resolve()),
        protocol=protocol,
        log=options.log,
        versions=versions(),
        shard=shard,
    )
    folder = RunFolder(out or free_name(_stem(config)))
    return Evaluation(
        config=config, refs=share_missions(refs, shard), folder=folder, handed=handed
    )


def _with_robot(protocol: Protocol | None, robot: str | None) -> Protocol | None:
    """Return the protocol with the robot that was asked for, if one was."""
    if robot is None:
        return protocol
    found = find_robot(robot)
    if faults := robot_faults(found):
        raise TemplateError(f"{robot}: {faults[0]}: see `beacon-mj robots --check`.")
    return msgspec.structs.replace(protocol or Protocol(), robot=found)


def _stem(config: RunConfig) -> str:
    """Return a name for the run that says what it is."""
    names = [*dict.fromkeys(entry.base for entry in config.planners)]
    who = "-".join(names) if len(names) <= 2 else f"{len(names)}-planners"
    part = "" if config.shard is None else "-shard{}of{}".format(*config.shard)
    return f"{who}-seed{config.seed}{part}"
