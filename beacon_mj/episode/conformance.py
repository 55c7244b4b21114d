"""Does a planner keep the contract? Driving it through a scene, twice."""

from collections.abc import Callable
from dataclasses import is_dataclass

from beacon_mj.episode.answers import PlannerFailure
from beacon_mj.episode.door import Door
from beacon_mj.episode.episode import make_task
from beacon_mj.episode.interrupts import watched
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.rollout import truth_about
from beacon_mj.episode.routes import route_graph
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.sensor import Sensor
from beacon_mj.errors import PlannerError
from beacon_mj.planners.base import Planner
from beacon_mj.planners.oracle.truth import Oracle
from beacon_mj.planners.routes.graph import RoutePlanner
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import World

STEPS = 40  #: Control steps for which a planner is watched.
#: The family in which a planner is watched, and one with a route graph.
USUAL, ON_ROUTES = "collision-required", "lookalike-doors"


def check_planner(
    planner: type[Planner] | Planner, scene: Scene | None = None, steps: int = STEPS
) -> None:
    """Check that a planner keeps its contract; see `beacon_mj.check_planner`.

    Args:
        planner: A planner's class, or one that was built.
        scene: Where to drive; None for one that suits the planner.
        steps: Control steps to drive.

    Raises:
        PlannerError: Naming the planner, what was expected, and what it did.
    """
    cls = planner if isinstance(planner, type) else type(planner)
    build: Callable[[], Planner] = (
        planner if isinstance(planner, type) else lambda: planner
    )
    if missing := cls.missing():
        raise PlannerError(
            f"{cls.__name__}: expected a complete planner but it lacks "
            f"{', '.join(missing)}."
        )
    _check_config(cls)
    if scene is None:
        scene = generate_scene(ON_ROUTES if issubclass(cls, RoutePlanner) else USUAL, 0)
    first = _drive(build(), cls.__name__, scene, steps)
    again = _drive(build(), cls.__name__, scene, steps)
    if first != again and cls.bit_reproducible is True:
        step = next(
            k for k, (a, b) in enumerate(zip(first, again, strict=False)) if a != b
        )
        raise PlannerError(
            f"{cls.__name__}: expected the same commands after the same task and "
            f"observations but they differ in step {step}."
        )


def _check_config(cls: type[Planner]) -> None:
    config = getattr(cls, "Config", None)
    if not (isinstance(config, type) and is_dataclass(config)):
        raise PlannerError(
            f"{cls.__name__}: expected Config to be a dataclass but it was {config!r}."
        )
    if not config.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        raise PlannerError(f"{cls.__name__}: expected Config to be frozen.")
    try:
        config()
    except TypeError as error:
        raise PlannerError(
            f"{cls.__name__}: expected a default for every field of Config: {error}."
        ) from error


def _drive(
    planner: Planner, name: str, scene: Scene, steps: int
) -> list[tuple[float, ...]]:
    """Return what the planner commands over some steps, checking each."""
    protocol = Protocol()
    world = World(scene)
    sensor = Sensor(world, protocol)
    door = Door(planner, protocol.decision_limit_s)
    oracle = isinstance(planner, Oracle)
    truth = truth_about(scene, protocol, run_episode) if oracle else None
    try:
        with watched():
            method = "reset"
            door.tell(route_graph(scene))
            door.reset(make_task(scene, protocol, seed=1), truth)
            method = "act"
            return _commands(door, world, sensor, steps)
    except PlannerFailure as failure:
        if not failure.raised:
            raise PlannerError(f"{name}: {failure}") from failure
        raise PlannerError(
            f"{name}: expected {method}() not to raise but it raised {failure}."
        ) from failure
    finally:
        door.close()


def _commands(
    door: Door, world: World, sensor: Sensor, steps: int
) -> list[tuple[float, ...]]:
    """Return what is commanded over some steps, or until the planner gives up."""
    observation = sensor.observe(None, 1.0)
    commands = []
    for _ in range(steps):
        command, _ = door.decide(observation)
        velocity, turn = command.velocity_mps, command.turn_rate_radps
        commands.append((*velocity.tolist(), float(command.give_up), turn or 0.0))
        if command.give_up:
            break
        observation = sensor.observe(world.step(velocity, turn), 1.0)
    return commands
