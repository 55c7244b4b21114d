"""IMPACT: costs at first sight, for good. And push-through, which looks at nothing."""

import dataclasses
from typing import Any

import msgspec
import numpy as np
import pytest

from beacon_mj.episode.run import run_episode
from beacon_mj.errors import PlannerError
from beacon_mj.interface import Command, Probabilities, SensedObstacle
from beacon_mj.planners.base import Planner
from beacon_mj.planners.impact import Impact, ImpactConfig
from beacon_mj.planners.push_through import PushThrough
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.generate import generate_scene
from tests.kinematics import make_task
from tests.sensed import observe, sensed_box

SEED = 4000  # Neither the tuning nor the reported scenes.
TASK = make_task((1.0, 3.0), (5.0, 3.0))
SURE: dict[str, Probabilities] = {
    "safe": (0.98, 0.01, 0.01),
    "movable": (0.01, 0.98, 0.01),
    "fragile": (0.01, 0.01, 0.98),
}


def wall(*names: str) -> list[SensedObstacle]:
    """A wall from south to north of equal pieces, of the classes given."""
    width = 6.0 / len(names)
    return [
        sensed_box(
            f"{name}_{i}", 3.0, (i + 0.5) * width,
            width=width, density=20.0, scores=SURE[name],
        )
        for i, name in enumerate(names)
    ]  # fmt: skip


def command(*obstacles: SensedObstacle, planner: Impact | None = None) -> Command:
    planner = Impact() if planner is None else planner
    planner.reset(TASK)
    return planner.act(observe((1.0, 3.0), *obstacles))


def crossed(found: Command) -> float:
    """Where the path goes through the wall, y [m]."""
    path = found.info.path_m
    assert path is not None
    return float(np.interp(3.0, path[:, 0], path[:, 1]))


def test_what_is_cheap_is_driven_through() -> None:
    straight = command(*wall("safe", "safe", "movable", "safe", "safe"))
    assert 2.4 < crossed(straight) < 3.6


def test_a_detour_is_taken_where_contact_is_dear() -> None:
    around = command(*wall("safe", "safe", "fragile", "movable", "safe"))
    assert 3.6 < crossed(around) < 4.8


def test_what_is_refused_is_driven_through_where_there_is_no_other_way() -> None:
    found = command(*wall("safe", "fragile", "safe"))
    assert not found.give_up
    assert found.info.path_m is not None


def test_what_seems_too_heavy_costs_what_a_safe_one_does() -> None:
    planner = Impact()
    planner.reset(TASK)
    light = sensed_box("light", density=50.0, scores=SURE["movable"])
    heavy = sensed_box("heavy", density=5000.0, scores=SURE["movable"])
    assert planner.cost(light) == pytest.approx(1.18)
    assert planner.cost(heavy) == planner.config.class_cost[0]


def test_the_first_cost_stays() -> None:
    planner = Impact()
    planner.reset(TASK)
    first = planner.cost(sensed_box("a", scores=SURE["movable"]))
    again = dataclasses.replace(sensed_box("a"), scores=SURE["safe"])
    assert planner.cost(again) == first
    planner.reset(TASK)
    assert planner.cost(again) > first


def test_it_crosses_a_barrier_by_pushing() -> None:
    trace = run_episode(generate_scene("collision-required", 0, SEED), Impact())
    assert trace.outcome == "reached"
    assert any(s.outcome.attempts for s in trace.steps)


def test_it_touches_nothing_where_there_is_room() -> None:
    trace = run_episode(generate_scene("sparse", 0, SEED), Impact())
    assert trace.outcome == "reached"
    assert not any(s.outcome.contacts for s in trace.steps)


@pytest.mark.parametrize("planner", [Impact(), PushThrough()])
def test_it_gives_up_at_what_never_moves(planner: Planner) -> None:
    trace = run_episode(immovable("collision-required"), planner)
    assert trace.outcome == "gave_up"
    assert trace.detail


def immovable(family: str) -> Scene:
    """A scene in which everything is fixed, and looks as it did before."""
    scene = generate_scene(family, 0, SEED)
    return msgspec.structs.replace(
        scene, obstacles=tuple(_fixed(o) for o in scene.obstacles)
    )


def _fixed(o: Any) -> Any:
    return msgspec.structs.replace(
        o, interaction="safe", fixed=True, break_force_n=None
    )


@pytest.mark.parametrize(
    ("field", "value"),
    [("class_cost", (1.0, -1.0, 1.0)), ("cell_m", 0.0), ("contact_mps", 0.0)],
)
def test_it_checks_its_configuration(field: str, value: object) -> None:
    with pytest.raises(PlannerError, match=field):
        ImpactConfig(**{field: value})  # type: ignore[arg-type]
