"""Does a planner keep the contract? For planners by name, of files, and programs."""

from beacon_mj.episode import conformance
from beacon_mj.episode.conformance import STEPS
from beacon_mj.episode.protocol import Protocol
from beacon_mj.eval.runs.isolation.host import describe_isolated
from beacon_mj.eval.runs.isolation.program import External, Program
from beacon_mj.planners.base import Planner
from beacon_mj.planners.program import is_program, program_name
from beacon_mj.planners.registry import load_planner
from beacon_mj.scene import Scene


def check_planner(
    planner: str | type[Planner] | Planner,
    scene: Scene | None = None,
    steps: int = STEPS,
) -> None:
    """Check that a planner keeps its contract (see `Planner`).

    The same as `beacon-mj check-planner`. It is built from its defaults, driven through
    a scene twice, and must be a deterministic function of what it observes (unless it
    says that it is not `bit_reproducible`), not write to what it is given, and return
    commands with a finite velocity and sound reasons: it goes through the same door as
    in an evaluation.

    Args:
        planner: Name, `path/to/file.py:Class`, `exec:COMMAND`, a planner's class, or
            one that was built. A program's stderr is the caller's.
        scene: Where to drive; if None, a scene of family `collision-required`, or of
            `lookalike-doors` for a planner on the route graph.
        steps: Control steps to drive.

    Raises:
        PlannerError: Naming the planner, what was expected, and what it did.
    """
    if isinstance(planner, str) and is_program(planner):
        _check_program(planner, scene, steps)
    elif isinstance(planner, str):
        conformance.check_planner(load_planner(planner)[1], scene, steps)
    else:
        conformance.check_planner(planner, scene, steps)


def _check_program(spec: str, scene: Scene | None, steps: int) -> None:
    """Check a program, in one process: it must start on the second task anew."""
    name, protocol = program_name(spec), Protocol()
    limit_s, memory_mib = protocol.decision_limit_s, protocol.memory_limit_mib
    said = describe_isolated(spec, {}, name, limit_s, memory_mib)
    named = type(name, (External,), {"bit_reproducible": said.bit_reproducible})
    process = Program(spec, memory_mib, stderr=None)
    try:
        conformance.check_planner(named(process, (), name, limit_s), scene, steps)
    finally:
        process.end()
