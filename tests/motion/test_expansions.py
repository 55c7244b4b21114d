"""Every vertex that a search expands is counted once, in the step it is expanded in."""

import msgspec
import pytest

from beacon_mj.episode.run import run_episode
from beacon_mj.geometry import Array
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.motion.dstar_lite import DStarLite
from beacon_mj.planners.base import Planner
from beacon_mj.planners.impact import Impact
from beacon_mj.planners.registry import load_planner
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.generate import generate_scene
from tests.kinematics import make_task
from tests.sensed import observe, sensed_box

SEED = 4000  # Neither the tuning nor the reported scenes.
SEARCHING = ["dstar-lite", "semantic", "beacon", "beacon-voi", "impact"]


class Kept(Planner):
    """Keeps every command of a planner, that with which it gives up included."""

    def __init__(self, planner: Planner) -> None:
        super().__init__()
        self.planner = planner
        self.commands: list[Command] = []

    def reset(self, task: Task) -> None:
        self.planner.reset(task)

    def act(self, observation: Observation) -> Command:
        self.commands.append(self.planner.act(observation))
        return self.commands[-1]


def immovable(scene: Scene) -> Scene:
    """The same scene with everything fixed: the planner tries all it has."""
    return msgspec.structs.replace(
        scene,
        obstacles=tuple(
            msgspec.structs.replace(
                o, interaction="safe", fixed=True, break_force_n=None
            )
            for o in scene.obstacles
        ),
    )


@pytest.fixture
def engines(monkeypatch: pytest.MonkeyPatch) -> list[DStarLite]:
    """Every search engine that is built, each with its own total."""
    built: list[DStarLite] = []
    build = DStarLite.__init__

    def noted(self: DStarLite, cost: Array, cell_m: float) -> None:
        build(self, cost, cell_m)
        built.append(self)

    monkeypatch.setattr(DStarLite, "__init__", noted)
    return built


def test_both_searches_of_a_step_count(engines: list[DStarLite]) -> None:
    """IMPACT searches again where everything is refused: here a wall of vases."""
    planner, vase = Impact(), (0.0, 0.0, 1.0)
    planner.reset(make_task((1.0, 3.0), (5.0, 3.0)))
    wall = sensed_box("wall", 3.0, 3.0, width=6.0, density=20.0, scores=vase)
    command = planner.act(observe((1.0, 3.0), wall))
    assert not command.give_up
    assert command.info.expansions == sum(engine.expansions for engine in engines) > 0


@pytest.mark.parametrize("fixed", [False, True], ids=["as it is", "immovable"])
@pytest.mark.parametrize("family", ["cluttered", "collision-required"])
@pytest.mark.parametrize("name", SEARCHING)
def test_commands_report_what_the_engines_counted(
    name: str, family: str, fixed: bool, engines: list[DStarLite]
) -> None:
    scene = generate_scene(family, 1, seed=SEED)
    kept = Kept(load_planner(name)[1]())
    engines.clear()
    run_episode(immovable(scene) if fixed else scene, kept)
    reported = [command.info.expansions for command in kept.commands]
    assert min(reported) >= 0
    assert sum(reported) == sum(engine.expansions for engine in engines) > 0
