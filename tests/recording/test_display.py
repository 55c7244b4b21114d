"""What viewers are given to look at agrees with what the log proves."""

import math
from typing import Any

import numpy as np
import pytest

from beacon_mj.constants import CLASSES
from beacon_mj.geometry import Array
from beacon_mj.planners.beacon import Beacon
from beacon_mj.recording import Log, read_log, read_trace
from beacon_mj.recording.drawing import BROKEN_RGBA
from beacon_mj.recording.encoding import split_path
from beacon_mj.recording.labels import BeliefPicture
from beacon_mj.recording.timeline import EVIDENCE_NS, NOTHING
from beacon_mj.scene_gen.generate import generate_scene
from tests.recording.conftest import Sample
from tests.recording.samples import record


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    """An episode of BEACON in which one push fails and two move something."""
    path = tmp_path_factory.mktemp("logs") / "x.mcap"
    record(path, generate_scene("hard-required", 0), Beacon())
    return read_log(path)


def test_states_last_to_the_end(log: Log, damage: Sample) -> None:
    """A bar ends with the last message that has its value."""
    for found in (log, read_log(damage.path)):
        end_ns = found.messages["/step"][-1][0]
        for topic in ("/decision", "/timeline"):
            (before_ns, before), (time_ns, last) = found.messages[topic][-2:]
            assert before_ns < time_ns == end_ns
            assert before == last


def test_evidence_is_a_state_that_ends(log: Log) -> None:
    told = {NOTHING}
    for time_ns, state in log.messages["/timeline"]:
        pushes = [m for t, m in log.messages["/push"] if 0 <= time_ns - t < EVIDENCE_NS]
        assert state.push == (pushes[-1].evidence if pushes else NOTHING)
        told.add(state.push)
    assert told == {NOTHING, "moved", "not_moved"}
    assert log.messages["/timeline"][-1][1].push == NOTHING


def test_timeline_is_the_planners_action_and_target(log: Log) -> None:
    states = dict(log.messages["/timeline"])
    state, targets = None, set()
    steps = read_trace(log.path).steps
    times = [t for t, _ in log.messages["/command"]]
    for time_ns, step in zip(times, steps, strict=True):
        state = states.get(time_ns, state)
        assert state is not None
        assert state.action == step.command.info.action
        assert state.target == (step.command.info.target or NOTHING)
        targets.add(state.target)
    assert NOTHING in targets
    assert len(targets) > 2


def test_replan_is_told_only_when_the_route_is_another(log: Log) -> None:
    told = [t for t, m in log.messages["/log"] if m.message.startswith("replan")]
    route, expected, replans = np.zeros((0, 2)), [], 0
    times = [t for t, _ in log.messages["/command"]]
    for time_ns, step in zip(times, read_trace(log.path).steps, strict=True):
        info = step.command.info
        replans += info.replanned
        path = np.zeros((0, 2)) if info.path_m is None else info.path_m
        if not _is_rest_of(path, route):
            route = path
            if info.replanned and len(path):  # None while it pushes.
                expected.append(time_ns)
    assert told == expected
    assert 0 < len(told) < replans / 2


def _is_rest_of(path: Array, route: Array) -> bool:
    """Whether a path is what is left of a route."""
    empty = len(path) == 0, len(route) == 0
    return split_path(path, route) is not None and empty[0] == empty[1]


def test_belief_is_rounded_and_drawn(log: Log) -> None:
    beliefs = log.messages["/belief"]
    assert len(beliefs) > 5
    for k, (time_ns, belief) in enumerate(beliefs):
        rounded_ns, rounded = log.messages["/belief/rounded"][k]
        drawn_ns, picture = log.messages["/belief/picture"][k]
        assert time_ns == rounded_ns == drawn_ns
        names = [b.obstacle for b in belief.obstacles]
        assert names == [b.obstacle for b in rounded.obstacles]
        assert names == [e.id for e in picture.entities]
        for exact, short, ball in zip(
            belief.obstacles, rounded.obstacles, picture.entities, strict=True
        ):
            facts = {f.key: f.value for f in ball.metadata}
            for kind in CLASSES:
                shown = getattr(short, kind)
                assert len(repr(shown)) <= 6
                assert shown == pytest.approx(getattr(exact, kind), abs=5e-5)
                assert float(facts[kind]) == pytest.approx(shown, abs=1e-9)


def test_ball_mixes_the_colours_of_the_classes(log: Log) -> None:
    picture = BeliefPicture(log.scene)
    name = log.scene.obstacles[0].id
    for k, surface in enumerate(log.scene.surfaces):
        certain = tuple(float(i == k) for i in range(3))
        [ball] = picture.update({name: certain}, 0).entities[0].spheres  # type: ignore[dict-item]
        assert _rgb(ball.color) == pytest.approx(surface.rgba[:3])
    half = picture.update({name: (0.5, 0.5, 0.0)}, 7).entities[0]
    mean = np.mean([s.rgba[:3] for s in log.scene.surfaces[:2]], axis=0)
    assert _rgb(half.spheres[0].color) == pytest.approx(mean)
    assert half.frame_id == name
    assert half.frame_locked
    gone = picture.update({}, 9)
    assert [d.id for d in gone.deletions] == [name]
    assert not gone.entities


def test_every_obstacle_has_its_name_over_it_and_each_colour_a_word(log: Log) -> None:
    [(_, update)] = log.messages["/labels"]
    *names, legend = update.entities
    assert [e.id for e in names] == [o.id for o in log.scene.obstacles]
    for entity, obstacle in zip(names, log.scene.obstacles, strict=True):
        [text] = entity.texts
        assert text.text == entity.frame_id == obstacle.id
        assert text.pose.position.z > 0.5 * obstacle.shape.height_m
    words = [t.text for t in legend.texts]
    assert words[:4] == [*CLASSES, "broken"]
    assert _rgb(legend.cubes[3].color) == pytest.approx(BROKEN_RGBA[:3])
    for cube, surface in zip(legend.cubes, log.scene.surfaces, strict=False):
        assert _rgb(cube.color) == pytest.approx(surface.rgba[:3])
    _, south, _, _ = log.scene.workspace_m
    signs = [*legend.cubes, *legend.spheres, *legend.cylinders]
    assert len(signs) == len(words) == len(set(words))
    assert all(s.pose.position.y < south for s in [*signs, *legend.texts])


def _rgb(colour: Any) -> tuple[float, float, float]:
    assert math.isclose(colour.a, 1.0)
    return colour.r, colour.g, colour.b
