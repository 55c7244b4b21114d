"""Two barriers, one behind the other, built by hand: doors go only as far as need be.

The robot sees the whole room: no way to the goal is free until both doors are.
"""

import itertools

import msgspec
import pytest

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.fidelity.benches import bench, obstacle
from beacon_mj.interface import Probabilities
from beacon_mj.planners.base import Planner
from beacon_mj.planners.beacon import Beacon
from beacon_mj.planners.beacon_voi import BeaconVoi
from beacon_mj.planners.semantic import Semantic
from beacon_mj.scene import Obstacle, Scene
from beacon_mj.scene.shapes import Box


def scored(body: Obstacle, scores: Probabilities) -> Obstacle:
    seen = msgspec.structs.replace(body.perceived, scores=scores)
    return msgspec.structs.replace(body, perceived=seen)


def barrier(number: int, x: float) -> list[Obstacle]:
    """A wall across the room at `x` [m] with a movable door in the middle."""
    box = Box(length_m=0.2, width_m=2.65, height_m=0.3)
    walls = [
        obstacle(f"wall_{number}{side}", box, (x, y), interaction="safe", fixed=True)
        for side, y in (("south", 1.325), ("north", 4.675))
    ]
    leaf = Box(length_m=0.2, width_m=0.5, height_m=0.3)
    door = obstacle(f"door_{number}", leaf, (x, 3.0))
    return [*(scored(w, (1.0, 0.0, 0.0)) for w in walls), scored(door, (0.1, 0.8, 0.1))]


def two_barriers() -> Scene:
    scene = bench(*barrier(1, 2.2), *barrier(2, 4.2))
    return msgspec.structs.replace(scene, goal_m=(5.4, 3.0))


#: Seen from everywhere; the first decision may have to compile kernels.
PROTOCOL = Protocol(sensing_radius_m=10.0, decision_limit_s=3600.0)


@pytest.mark.parametrize("cls", [Beacon, BeaconVoi, Semantic])
def test_each_door_is_pushed_once_and_not_into_the_next_barrier(
    cls: type[Planner],
) -> None:
    trace = run_episode(two_barriers(), cls(), protocol=PROTOCOL)
    assert trace.outcome == "reached"
    infos = [step.command.info for step in trace.steps]
    acts = [(i.target, i.action) for i in infos if i.target is not None]
    assert [key for key, _ in itertools.groupby(acts)] == [
        ("door_1", "approach"), ("door_1", "push"),
        ("door_2", "approach"), ("door_2", "push"),
    ]  # fmt: skip
