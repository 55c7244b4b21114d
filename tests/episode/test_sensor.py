"""The sensor: range, memory, options, and that no truth crosses."""

import dataclasses
import math
from collections.abc import Iterator

import msgspec
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.sensor import Sensor
from beacon_mj.fidelity.benches import START_M, bench, block, obstacle
from beacon_mj.interface import Observation
from beacon_mj.scene import Obstacle, Perceived, Scene, Sensing, shapes
from beacon_mj.scene_gen.perception import perceive
from beacon_mj.world import World
from tests.worlds import cached_scene


def ids(observation: Observation) -> list[str]:
    return [o.id for o in observation.obstacles]


def ball(name: str, x: float, y: float, radius: float = 0.1) -> Obstacle:
    return obstacle(name, shapes.Cylinder(radius_m=radius, height_m=0.3), (x, y))


def at_gap(name: str, gap_m: float, angle: float = 0.0) -> Obstacle:
    """A disc whose outline is `gap_m` from the robot's body."""
    reach = 0.12 + gap_m + 0.1
    return ball(
        name, START_M[0] + reach * math.cos(angle), START_M[1] + reach * math.sin(angle)
    )


class Run:
    """A world and its sensor, driven together."""

    def __init__(self, scene: Scene, **options: float | bool) -> None:
        self.world = World(scene)
        self.sensor = Sensor(self.world, msgspec.convert(options, Protocol))
        self.now = self.sensor.observe(None, 1.0)

    def drive(self, vx: float, vy: float, steps: int) -> list[Observation]:
        seen = []
        for _ in range(steps):
            outcome = self.world.step(np.array([vx, vy]))
            self.now = self.sensor.observe(outcome, 1.0)
            seen.append(self.now)
        return seen


@pytest.mark.parametrize("angle", [0.0, 1.0, 2.0])
@pytest.mark.parametrize("radius", [0.5, 1.0])
def test_range_is_from_body_to_footprint(angle: float, radius: float) -> None:
    inside, outside = (
        Run(bench(at_gap("o", radius + d, angle)), sensing_radius_m=radius)
        for d in (-1e-3, 1e-3)
    )
    assert ids(inside.now) == ["o"]
    assert ids(outside.now) == []


def test_sensing_grows_the_map_in_order_and_remembers() -> None:
    scene = bench(ball("far", 3.5, 3.5), ball("near", 1.3, 3.5), ball("next", 2.4, 3.5))
    run = Run(scene)
    assert ids(run.now) == ["near"]
    seen = run.drive(0.5, 0.0, 50)
    assert ids(run.now) == ["near", "next", "far"]
    versions = [o.map_version for o in seen]
    assert versions == sorted(versions)
    assert len(set(versions)) == 3
    near = run.now.obstacles[0]
    assert not near.visible
    assert near.seen_s < run.now.time_s - 1.0
    assert run.now.obstacles[2].visible
    assert run.now.obstacles[2].seen_s == run.now.time_s


def test_out_of_range_the_last_pose_is_kept_while_the_world_moves_on() -> None:
    run = Run(bench(ball("o", 1.3, 3.5)))
    run.drive(0.5, 0.0, 40)
    remembered = run.now.obstacles[0]
    assert not remembered.visible
    run.world.data.qvel[4:6] = (0.0, 2.0)
    run.drive(0.0, 0.0, 5)
    after = run.now.obstacles[0]
    assert run.world.poses[0, 1] > 3.55
    np.testing.assert_array_equal(after.centroid_m, remembered.centroid_m)
    assert after.seen_s == remembered.seen_s


def test_sensed_poses_are_true_when_there_is_no_noise() -> None:
    run = Run(cached_scene("cluttered", 0))
    for _ in range(40):
        (observation,) = run.drive(0.4, 0.05, 1)
        for k, o in enumerate(observation.obstacles):
            if not o.visible:
                continue
            i = [x.id for x in run.world.scene.obstacles].index(o.id)
            np.testing.assert_array_equal(
                o.footprint.vertices, run.world.outlines[i].vertices
            )
            stacked = observation.footprints.vertices[k]
            np.testing.assert_array_equal(
                stacked[: len(o.footprint.vertices)], o.footprint.vertices
            )
    assert len(run.now.obstacles) > 5


def test_own_state_and_force() -> None:
    run = Run(bench(block("crate", 0.05, mass_kg=30.0)))
    run.drive(0.3, 0.0, 20)
    now = run.now
    np.testing.assert_array_equal(now.position_m, run.world.position_m)
    assert now.drive_effort == pytest.approx(1.0)
    assert now.bumper_force_n[0] == pytest.approx(-60.0, rel=0.02)
    (contact,) = now.contacts
    assert contact.id == "crate"
    np.testing.assert_allclose(contact.normal, (1.0, 0.0), atol=0.12)
    assert contact.force_n == pytest.approx(60.0, rel=0.02)


def test_evidence_crosses_once_and_names_the_obstacle() -> None:
    run = Run(bench(block("crate", 0.05)))
    evidence = [e for o in run.drive(0.3, 0.0, 30) for e in o.evidence]
    assert [(e.id, e.evidence) for e in evidence] == [("crate", "moved")]


@pytest.mark.parametrize("mass_kg", [0.1, 0.2, 1.0, 4.0])
@pytest.mark.parametrize("options", [{"missed_detection": 0.95}, {"pose_noise_m": 0.1},
                                     {"sensing_radius_m": 0.0}])  # fmt: skip
def test_touch_is_told_at_once_whatever_the_eye_missed(
    mass_kg: float, options: dict[str, float]
) -> None:
    """Light blocks jump off the bumper: nothing touches it when the step ends."""
    run = Run(bench(block("crate", 0.05, mass_kg=mass_kg)), **options)
    attempts, told = [], []
    for _ in range(30):
        outcome = run.world.step(np.array([0.5, 0.0]))
        observation = run.sensor.observe(outcome, 1.0)
        attempts.append([(a.obstacle, a.ended_s) for a in outcome.attempts])
        told.append([(e.id, e.time_s) for e in observation.evidence])
        assert {e.id for e in observation.evidence} <= set(ids(observation))
    assert sum(map(len, attempts)) > 0
    assert told == attempts


def beam_and_vase() -> Scene:
    """A long beam before the robot, and a vase that it will break, far off."""
    box = shapes.Box(length_m=1.2, width_m=0.2, height_m=0.25)
    beam = obstacle("beam", box, (START_M[0] + 0.8, START_M[1]), mass_kg=2.0)
    cup = shapes.Box(length_m=0.2, width_m=0.2, height_m=0.3)
    vase = obstacle(
        "vase",
        cup,
        (START_M[0] + 1.8, START_M[1]),
        interaction="fragile",
        break_force_n=1.0,
    )
    return bench(beam, vase)


def test_what_breaks_out_of_range_is_not_told() -> None:
    near, far = (Run(beam_and_vase(), sensing_radius_m=r) for r in (3.0, 0.3))
    told = {}
    for name, run in (("near", near), ("far", far)):
        seen = run.drive(0.3, 0.0, 30)
        assert bool(run.world.broken[1])
        told[name] = [e.id for o in seen for e in o.evidence if e.evidence == "broken"]
    assert told == {"near": ["vase"], "far": []}
    assert [o.broken for o in near.now.obstacles] == [False, True]
    assert ids(far.now) == ["beam"]


@pytest.mark.parametrize(
    "options", [{"missed_detection": 0.9}, {"occlusion": True}], ids=str
)
def test_what_broke_unseen_is_told_once_when_it_is_seen(
    options: dict[str, float],
) -> None:
    run = Run(beam_and_vase(), sensing_radius_m=3.0, **options)
    seen = run.drive(0.3, 0.0, 30) + run.drive(0.0, 0.5, 40)
    assert bool(run.world.broken[1])
    told = [(o, e) for o in seen for e in o.evidence if e.id == "vase"]
    assert [e.evidence for _, e in told] == ["broken"]
    (observation, evidence) = told[0]
    assert observation.time_s > evidence.time_s + 0.1
    vase = next(o for o in observation.obstacles if o.id == "vase")
    assert vase.visible
    assert vase.broken
    after = [o for o in seen if o.time_s > evidence.time_s]
    sights = [
        o for o in after if any(x.id == "vase" and x.visible for x in o.obstacles)
    ]
    assert sights[0] is observation


@settings(max_examples=15, deadline=None)
@given(
    masses=st.lists(st.sampled_from([0.1, 0.5, 2.0, 8.0]), min_size=1, max_size=3),
    limit_n=st.sampled_from([None, 2.0, 15.0]),
    speed=st.floats(0.1, 0.5),
    missed=st.sampled_from([0.0, 0.5, 0.9]),
    occlusion=st.booleans(),
)
@example(masses=[0.2], limit_n=None, speed=0.5, missed=0.95, occlusion=False)
def test_evidence_is_told_once_of_known_obstacles_and_none_of_touch_late(
    masses: list[float],
    limit_n: float | None,
    speed: float,
    missed: float,
    occlusion: bool,
) -> None:
    """A row of blocks is pushed and left: whatever the sensor misses."""
    blocks = [
        block(f"b{k}", 0.05 + 0.41 * k, mass_kg=mass, break_force_n=limit_n)
        for k, mass in enumerate(masses)
    ]
    run = Run(bench(*blocks), missed_detection=missed, occlusion=occlusion)
    happened: list[tuple[str, str, float]] = []
    told: list[tuple[str, str, float]] = []
    for velocity in [(speed, 0.0)] * 25 + [(-0.3, 0.2)] * 10:
        outcome = run.world.step(np.array(velocity))
        observation = run.sensor.observe(outcome, 1.0)
        happened += [(a.obstacle, a.evidence, a.ended_s) for a in outcome.attempts]
        told += [(e.id, e.evidence, e.time_s) for e in observation.evidence]
        sensed = {o.id for o in observation.obstacles if o.visible}
        assert {e.id for e in observation.evidence} <= sensed
        assert {a.obstacle for a in outcome.own_attempts} <= {i for i, _, _ in told}
    assert len(told) == len(set(told))
    assert set(told) <= set(happened)
    if missed == 0.0 and not occlusion:
        assert told == happened


def test_occlusion_hides_what_stands_behind() -> None:
    front = obstacle(
        "front",
        shapes.Box(length_m=0.1, width_m=0.8, height_m=0.3),
        (START_M[0] + 0.5, START_M[1]),
    )
    behind = ball("behind", START_M[0] + 0.8, START_M[1])
    beside = ball("beside", START_M[0] + 0.5, START_M[1] - 0.7)
    scene = bench(front, behind, beside)
    assert set(ids(Run(scene).now)) == {"front", "behind", "beside"}
    run = Run(scene, occlusion=True, sensing_radius_m=3.0)
    assert set(ids(run.now)) == {"front", "beside"}
    run.drive(0.0, 0.5, 34)
    assert "behind" in ids(run.now)


def test_pose_noise_has_the_stated_spread_and_shifts_without_distortion() -> None:
    discs = [at_gap(f"o{k}", 0.5, 2.0 * np.pi * k / 12) for k in range(12)]
    offsets = []
    for index in range(30):
        scene = msgspec.structs.replace(bench(*discs), index=index)
        run = Run(scene, pose_noise_m=0.05)
        for sensed, true in zip(run.now.obstacles, discs, strict=True):
            offsets.append(sensed.centroid_m - (true.x_m, true.y_m))
            assert sensed.footprint.radius == pytest.approx(0.1)
    spread = np.array(offsets)
    assert len(spread) == 360
    np.testing.assert_allclose(spread.std(axis=0), 0.05, rtol=0.15)
    np.testing.assert_allclose(spread.mean(axis=0), 0.0, atol=0.01)


def test_missed_detections_happen_at_the_stated_rate() -> None:
    discs = [at_gap(f"o{k}", 0.5, 2.0 * np.pi * k / 10) for k in range(10)]
    run = Run(bench(*discs), missed_detection=0.3)
    seen = run.drive(0.0, 0.0, 60)
    visible = [sum(o.visible for o in s.obstacles) for s in seen]
    assert np.mean(visible) == pytest.approx(7.0, abs=0.5)
    assert len(run.now.obstacles) == 10


def test_noise_repeats_with_the_scene_and_not_with_another() -> None:
    def positions(index: int) -> np.ndarray:
        scene = msgspec.structs.replace(bench(at_gap("o", 0.3)), index=index)
        run = Run(scene, pose_noise_m=0.05)
        return run.now.obstacles[0].centroid_m

    np.testing.assert_array_equal(positions(0), positions(0))
    assert not np.array_equal(positions(0), positions(1))


def reachable(value: object, seen: set[int]) -> Iterator[object]:
    """Yield every object that can be reached through public and private fields."""
    if id(value) in seen:
        return
    seen.add(id(value))
    yield value
    children: list[object] = []
    if dataclasses.is_dataclass(value):
        children = [getattr(value, f.name) for f in dataclasses.fields(value)]
    elif isinstance(value, dict):
        children = [*value.keys(), *value.values()]
    elif isinstance(value, tuple | list | set | frozenset):
        children = list(value)
    elif isinstance(value, np.ndarray):
        children = [] if value.base is None else [value.base]
    elif hasattr(value, "__dict__"):
        children = list(vars(value).values())
    for child in children:
        yield from reachable(child, seen)


def test_no_truth_can_be_reached_from_an_observation() -> None:
    scene = perceive(cached_scene("cluttered", 0), "noisy", 0)
    run = Run(scene)
    seen = [run.now, *run.drive(0.4, 0.05, 60)]
    assert len(run.now.obstacles) > 5
    objects = list(reachable(seen, set()))
    kinds = {type(o).__module__.split(".")[0] + "." + type(o).__name__ for o in objects}
    assert kinds <= {
        "builtins.list", "builtins.tuple", "builtins.int", "builtins.float",
        "builtins.str", "builtins.bool", "builtins.NoneType",
        "numpy.ndarray", "numpy.float64",
        "beacon_mj.Observation", "beacon_mj.SensedObstacle", "beacon_mj.Footprint",
        "beacon_mj.Footprints", "beacon_mj.Contact", "beacon_mj.PushEvidence",
    }  # fmt: skip
    floats = {float(o) for o in objects if isinstance(o, float)}
    for o in scene.obstacles:
        secrets = {o.density_kgm3, o.friction, o.mass_kg, o.breakaway_force_n}
        assert not floats & (secrets | {o.break_force_n})
    words = {o for o in objects if isinstance(o, str)}
    unseen = {o.id for o in scene.obstacles} - set(ids(run.now))
    assert not words & unseen
    assert not words & {"safe", "movable", "fragile"}


def test_perceived_values_are_what_the_scene_stores() -> None:
    perceived = Perceived(scores=(0.2, 0.5, 0.3), density_kgm3=123.0, friction=0.321)
    crate = msgspec.structs.replace(block("crate"), perceived=perceived)
    (sensed,) = Run(bench(crate)).now.obstacles
    assert sensed.scores == (0.2, 0.5, 0.3)
    assert (sensed.density_kgm3, sensed.friction) == (123.0, 0.321)
    volume = crate.shape.volume_m3
    assert sensed.perceived_force_n == pytest.approx(0.321 * 123.0 * volume * 9.81)


def test_the_kind_of_an_obstacle_crosses_and_stays_when_it_moves() -> None:
    plain = ball("plain", START_M[0] + 0.4, START_M[1])
    crate = ball("crate_like", START_M[0], START_M[1] + 0.6)
    looks = msgspec.structs.replace(crate.perceived, kind="crate")
    run = Run(bench(plain, msgspec.structs.replace(crate, perceived=looks)))
    assert {o.id: o.kind for o in run.now.obstacles} == {
        "plain": None, "crate_like": "crate"
    }  # fmt: skip
    run.drive(0.0, 0.4, 15)
    run.drive(0.0, -0.4, 10)
    assert {o.kind for o in run.now.obstacles} == {None, "crate"}
    assert run.now.map_version > 1


def test_a_scene_is_sensed_as_its_family_says() -> None:
    far = ball("far", START_M[0] + 2.0, START_M[1])
    scene = msgspec.structs.replace(bench(far), sensing=Sensing(radius_m=3.0))
    assert ids(Run(scene).now) == ["far"]
    assert ids(Run(scene, sensing_radius_m=1.0).now) == []
    assert ids(Run(bench(far)).now) == []
