"""Verifying a run as a whole: the levels one after the other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from beacon_mj.errors import BeaconError
from beacon_mj.eval.runs.code_record import check_trusted, named_layouts
from beacon_mj.eval.runs.config import RunConfig, SceneRef, planned_scenes
from beacon_mj.eval.runs.run_folder import load_config, load_rows
from beacon_mj.eval.verification.checks import Check
from beacon_mj.eval.verification.fresh import check_fresh
from beacon_mj.eval.verification.logs import check_logs
from beacon_mj.eval.verification.rates import FreshResult
from beacon_mj.eval.verification.rerun import check_planners
from beacon_mj.eval.verification.scenes import check_scenes
from beacon_mj.eval.verification.tables import check_tables
from beacon_mj.recording.verify import Verification


@dataclass(frozen=True, kw_only=True, slots=True)
class Asked:
    """How far a run is to be verified.

    Attributes:
        workers: Processes.
        rerun: Whether planners are run again.
        fresh_seed: Seed of unseen scenes to run them on; None for none.
        scenes_per_family: How many of those; None for as many as the run has.
        trust_code: Whether code that only the run names may be executed.
        config: The run's configuration with other places of planners, templates and
            scenes; None for its own.
    """

    workers: int
    rerun: bool = False
    fresh_seed: int | None = None
    scenes_per_family: int | None = None
    trust_code: bool = False
    config: RunConfig | None = None

    def check_trusted(self, config: RunConfig) -> None:
        """Refuse to run planners of files that nobody vouched for.

        Raises:
            RunError: Naming the files.
        """
        if self.rerun or self.fresh_seed is not None:
            check_trusted(config, self.trust_code)


def check_run(
    run: Path,
    asked: Asked,
    logs: Callable[[], Sequence[Verification]],
) -> tuple[list[Check], list[FreshResult]]:
    """Check a run at every level that is asked for.

    Args:
        run: The run folder.
        asked: How far.
        logs: Verifies the run's logs.

    Raises:
        BeaconError: If the folder is no run, or something asked for cannot be done.
    """
    config, rows = asked.config or load_config(run), load_rows(run)
    asked.check_trusted(config)
    try:
        refs = planned_scenes(config)
    except BeaconError as error:
        return [Check(level="tables", problems=(f"{run}: {error}",), note="")], []
    checks = [
        check_tables(run, refs),
        _scenes(run, config, refs, asked),
        check_logs(run, config, rows, logs()),
    ]
    if asked.rerun:
        checks.append(check_planners(run, config, refs, rows, asked.workers))
    if asked.fresh_seed is None:
        return checks, []
    check, results = check_fresh(
        run,
        config,
        rows,
        seed=asked.fresh_seed,
        scenes_per_family=asked.scenes_per_family,
        workers=asked.workers,
    )
    return [*checks, check], results


def _scenes(
    run: Path, config: RunConfig, refs: Sequence[SceneRef], asked: Asked
) -> Check:
    """Check the scenes, unless that would run a stranger's layouts."""
    layouts = named_layouts(config)
    if layouts is not None and not asked.trust_code:
        problem = (
            f"{run}: scenes were not generated again, for that would run {layouts}: "
            "use --trust-code"
        )
        return Check(level="scenes", problems=(problem,), note="not generated again")
    return check_scenes(run, config, refs, load_rows(run), asked.workers)
