"""Several tasks in one room with one memory: the days of a mission, in order."""

from collections.abc import Sequence

from beacon_mj.episode.episode import Listener
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.trace import Trace
from beacon_mj.episode.worlds import world_of
from beacon_mj.errors import SceneError
from beacon_mj.planners.base import Planner
from beacon_mj.scene import Scene
from beacon_mj.world import BaseWorld
from beacon_mj.world.overnight import as_left


class Mission:
    """One planner on its way through the days of one mission.

    The first day begins with `reset`, each further one with `next_day`. A day that ends
    in `planner_error` costs that day and the memory: nobody knows what state the
    planner is in, so the next day begins with `reset`.
    """

    def __init__(
        self,
        planner: Planner,
        name: str = "planner",
        protocol: Protocol | None = None,
        *,
        oracle: bool | None = None,
    ) -> None:
        """Begin a mission; see `run_episode` for the arguments."""
        self._planner = planner
        self._name = name
        self._protocol = Protocol() if protocol is None else protocol
        self._oracle = oracle
        self._remembers = False
        self._yesterday: BaseWorld | None = None

    def day(
        self,
        scene: Scene,
        seed: int = 0,
        listeners: Sequence[Listener] = (),
        world: BaseWorld | None = None,
        suite: str | None = None,
    ) -> Trace:
        """Run the next day.

        Args:
            scene: The day: the room of the days before, with another start and goal.
            seed: The planner's seed.
            listeners: Recorders and displays.
            world: A world of this scene to reuse, of no other day of this mission.
            suite: The released suite that the scene is of, for its row.

        Returns:
            The day's trace.
        """
        if world is None:
            world = world_of(scene, self._protocol)
        left = None if self._yesterday is None else as_left(self._yesterday, scene)
        trace = run_episode(
            scene,
            self._planner,
            name=self._name,
            protocol=self._protocol,
            seed=seed,
            listeners=listeners,
            world=world,
            left=left,
            goes_on=self._remembers,
            suite=suite,
            oracle=self._oracle,
        )
        self._remembers = trace.outcome != "planner_error"
        # A simulation that diverged left no room that one could go on in.
        sound = trace.outcome != "simulation_error"
        stays = sound and self._protocol.overnight == "as_left"
        self._yesterday = world if stays else None
        return trace


def run_mission(
    days: Sequence[Scene],
    planner: Planner,
    name: str = "planner",
    protocol: Protocol | None = None,
    seed: int = 0,
) -> list[Trace]:
    """Run all days of a mission with one planner.

    Args:
        days: The scenes of the days, in order; see `Scene.mission`.
        planner: Who decides, and may remember.
        name: The planner's name in results.
        protocol: How the days are run; the default protocol if None. Its `overnight`
            says how each further day finds the room.
        seed: The planner's seed.

    Returns:
        A trace a day.

    Raises:
        SceneError: If the scenes are not the days of one mission.
    """
    check_days(days)
    mission = Mission(planner, name, protocol)
    return [mission.day(scene, seed) for scene in days]


def check_days(days: Sequence[Scene]) -> None:
    """Check that scenes are all days of one mission, in order.

    Raises:
        SceneError: If they are not.
    """
    first = days[0] if days else None
    for number, scene in enumerate(days):
        assert first is not None
        same = [
            getattr(scene, name) == getattr(first, name)
            for name in ("family", "seed", "mission", "days")
        ]
        if not (all(same) and scene.day == number):
            raise SceneError(
                f"{scene.name}: expected day {number} of the mission that {first.name} "
                f"is of but it is day {scene.day} of mission {scene.mission}."
            )
    if first is None or first.days != len(days):
        raise SceneError(
            f"Expected all {first.days if first else ''} days of a mission but there "
            f"are {len(days)}."
        )
