"""The execution loop of one episode (paper II.I)."""

from collections.abc import Callable, Sequence

from beacon_mj.episode.answers import PlannerFailure
from beacon_mj.episode.door import Door
from beacon_mj.episode.episode import Episode, Listener
from beacon_mj.episode.interrupts import watched
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.rollout import truth_about
from beacon_mj.episode.routes import route_graph
from beacon_mj.episode.trace import Trace
from beacon_mj.errors import PlannerError
from beacon_mj.planners.base import Planner
from beacon_mj.planners.oracle.truth import Oracle
from beacon_mj.scene import Scene
from beacon_mj.world import BaseWorld
from beacon_mj.world.overnight import Left


def run_episode(
    scene: Scene,
    planner: Planner,
    name: str = "planner",
    protocol: Protocol | None = None,
    seed: int = 0,
    listeners: Sequence[Listener] = (),
    world: BaseWorld | None = None,
    oracle: bool | None = None,
    left: Left | None = None,
    goes_on: bool = False,
    suite: str | None = None,
) -> Trace:
    """Run one episode to its end.

    Args:
        scene: The world to cross.
        planner: Who decides.
        name: The planner's name in results.
        protocol: How the episode is run; the default protocol if None.
        seed: The planner's seed.
        listeners: Recorders and displays.
        world: A world of the same scene to reuse; it is reset first.
        oracle: Whether the planner is told the truth, which the trace then says; by
            default an `Oracle` is, and no other planner.
        left: How the room was left the day before; None for the scene's own places.
        goes_on: Whether the planner ran the day before, and is told `next_day` in place
            of `reset`; see `beacon_mj.run_mission`.
        suite: The released suite that the scene is of, for its row.

    Returns:
        The trace. A planner that fails, or a simulation that diverges, ends its
        episode with an outcome that says so; nothing is raised for it.

    Raises:
        SceneError: If the scene is not valid, or `world` is another's.
    """
    protocol = Protocol() if protocol is None else protocol
    told = isinstance(planner, Oracle) if oracle is None else oracle
    episode = Episode(
        scene,
        protocol,
        name,
        seed=seed,
        listeners=listeners,
        world=world,
        oracle=told,
        left=left,
        suite=suite,
    )
    truth = truth_about(scene, protocol, run_episode, left) if told else None
    door = Door(planner, protocol.decision_limit_s)
    try:
        with watched():
            begin = door.next_day if goes_on else door.reset
            _decide(episode, door, lambda: begin(episode.task, truth))
    finally:
        door.close()
    episode.close()
    return episode.trace


def _decide(episode: Episode, door: Door, begin: Callable[[], None]) -> None:
    """Start the planner, and have it decide until the episode ends."""
    try:
        door.tell(route_graph(episode.trace.scene))
        begin()
        while episode.trace.outcome is None:
            episode.step(*door.decide(episode.observation))
    except (PlannerFailure, PlannerError) as error:
        episode.end("planner_error", str(error))
