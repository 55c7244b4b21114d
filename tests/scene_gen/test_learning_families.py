"""Families whose doors hide a latent: prior, certificate, worlds, and days."""

import functools
from collections import Counter
from pathlib import Path

import msgspec
import numpy as np
import pytest

from beacon_mj import cli
from beacon_mj.constants import WALL_KIND
from beacon_mj.errors import GenerationError, SceneError, TemplateError
from beacon_mj.eval.runs.config import generated_scenes
from beacon_mj.eval.runs.run_folder import load_rows
from beacon_mj.geometry import polyline_length
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene import LearningCertificate, Obstacle, Scene
from beacon_mj.scene.certificates import free_path
from beacon_mj.scene.files import parse_scene
from beacon_mj.scene_gen.family import Family, default_families, load_family
from beacon_mj.scene_gen.generate import generate_scene, obstacle_of
from beacon_mj.scene_gen.learning.certificate import NoWayError, certify_parts
from beacon_mj.scene_gen.perception import perceive
from tests.worlds import FAMILIES

SEED = 2000
LEARNING = {
    "lookalike-doors": 6, "lookalike-doors-08": 6, "lookalike-doors-shuffled": 6,
    "unweighed-doors": 10, "unweighed-doors-redrawn": 10,
    "revisited-rooms": 30, "revisited-rooms-redrawn": 30,
}  # fmt: skip
CONTROLS = {
    "lookalike-doors-shuffled", "unweighed-doors-redrawn", "revisited-rooms-redrawn",
}  # fmt: skip


@functools.cache
def scene_of(family: str, index: int) -> Scene:
    return generate_scene(family, index, SEED)


def learning(scene: Scene) -> LearningCertificate:
    certificate = scene.certificate.learning
    assert isinstance(certificate, LearningCertificate)
    return certificate


def doors(scene: Scene) -> list[Obstacle]:
    names = {d for part in learning(scene).parts for d in part.doors}
    return [o for o in scene.obstacles if o.id in names]


def opens(scene: Scene, name: str) -> bool:
    return obstacle_of(scene, name).pushable(scene.robot.force_max_n)


@pytest.mark.parametrize("family", LEARNING)
def test_a_scene_says_what_learning_is_worth_in_it(family: str) -> None:
    scene = scene_of(family, 1)
    found, promised = learning(scene), load_family(family).value("learning_value")
    assert found.worlds == LEARNING[family]
    assert (found.fail_s, found.pass_s) == (2.0, 0.7)
    assert found.value_s == pytest.approx(found.memoryless_s - found.updating_s)
    assert found.value_s >= promised
    assert (found.value_s == 0.0) == (family in CONTROLS)
    assert certify_parts(found.parts, found.fail_s, found.pass_s) == found
    assert parse_scene(scene.to_json()) == scene


@pytest.mark.parametrize("family", LEARNING)
def test_every_stage_has_a_door_that_opens_and_no_free_way(family: str) -> None:
    scene = scene_of(family, 2)
    assert scene.certificate.collision_free_length_m is None
    stages = [s for part in learning(scene).parts for s in part.stages]
    assert stages
    if "redrawn" in family and "revisited" in family:
        stages = [stages[int(scene.day or 0)]]
    assert all(any(opens(scene, d) for d in s.doors) for s in stages)


@pytest.mark.parametrize(
    "family", ["lookalike-doors", "unweighed-doors", "revisited-rooms"]
)
def test_the_certificate_does_not_look_at_the_truth(
    family: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In whatever world a room is, it is the same room with the same certificate."""
    scenes = []
    for world in (0, LEARNING[family] - 1):
        monkeypatch.setattr(
            "beacon_mj.scene_gen.learning.generate.deal", lambda *_, w=world: w
        )
        scenes.append(generate_scene(family, 0, SEED))
    a, b = scenes
    assert learning(a) == learning(b)
    assert [(o.id, o.x_m, o.y_m, o.shape, o.perceived) for o in a.obstacles] == [
        (o.id, o.x_m, o.y_m, o.shape, o.perceived) for o in b.obstacles
    ]
    assert [opens(a, o.id) for o in doors(a)] != [opens(b, o.id) for o in doors(b)]


def test_times_are_drives_over_true_lengths() -> None:
    scene = scene_of("lookalike-doors", 0)
    first = learning(scene).parts[0].stages[0]
    for name, seconds in zip(first.doors, first.enter_s, strict=True):
        door = obstacle_of(scene, name)
        front = (door.x_m - 0.30, door.y_m)
        reached = msgspec.structs.replace(scene, goal_m=front)
        way = free_path(reached, list(scene.obstacles))
        assert way is not None
        assert seconds == pytest.approx(polyline_length(way) / 0.5, abs=1e-5)
    last = learning(scene).parts[0].stages[-1]
    for name, seconds in zip(last.doors, last.cross_s, strict=True):
        door = obstacle_of(scene, name)
        beyond = np.array([door.x_m + 0.75, door.y_m])
        onward = float(np.hypot(*(np.array(scene.goal_m) - beyond)))
        assert seconds == pytest.approx((1.05 + onward) / 0.5, abs=1e-5)


def kinds_that_move(scene: Scene) -> dict[str, set[bool]]:
    out: dict[str, set[bool]] = {}
    for door in doors(scene):
        assert door.perceived.kind is not None
        out.setdefault(door.perceived.kind, set()).add(opens(scene, door.id))
    return out


def test_kinds_behave_alike_and_worlds_come_in_rounds() -> None:
    worlds: Counter[tuple[tuple[str, bool], ...]] = Counter()
    for index in range(12):
        kinds = kinds_that_move(scene_of("lookalike-doors", index))
        assert set(kinds) == {"crate", "bin", "cabinet"}
        assert all(len(seen) == 1 for seen in kinds.values())
        worlds[tuple(sorted((k, any(v)) for k, v in kinds.items()))] += 1
        if index == 5:
            assert set(worlds.values()) == {1}
    assert len(worlds) == 6
    assert set(worlds.values()) == {2}


def test_the_index_does_not_tell_the_world() -> None:
    first = [
        tuple(sorted(kinds_that_move(generate_scene("lookalike-doors", 0, s)).items()))
        for s in range(SEED, SEED + 5)
    ]
    assert len(set(map(str, first))) > 1


def test_the_control_draws_kinds_anew_at_each_barrier() -> None:
    mixed = kinds_that_move(scene_of("lookalike-doors-shuffled", 0))
    assert any(len(seen) == 2 for seen in mixed.values())
    parts = learning(scene_of("lookalike-doors-shuffled", 0)).parts
    assert len(parts) == 4


def test_a_door_follows_its_kind_with_the_stated_probability() -> None:
    """At 0.8, of a kind that moves 0.9 of the doors open, but for dead ends."""
    part = learning(scene_of("lookalike-doors-08", 0)).parts[0]
    assert {p for row in part.opens for p in row} == {0.1, 0.9}
    unlike = sum(
        len(seen) == 2
        for index in range(6)
        for seen in kinds_that_move(scene_of("lookalike-doors-08", index)).values()
    )
    assert unlike > 3


def test_perceived_scores_are_the_prior_and_tell_nothing() -> None:
    for family in ("lookalike-doors", "lookalike-doors-08", "revisited-rooms"):
        found = doors(scene_of(family, 0))
        assert len({o.interaction for o in found}) == 2
        assert len({o.perceived.scores for o in found}) <= 1 + (family[-1] == "8")
        safe, movable, fragile = found[0].perceived.scores
        assert movable == pytest.approx(0.5, abs=0.03)
        assert safe + movable == pytest.approx(1.0)
        assert fragile == 0.0


def test_one_load_is_behind_all_forces() -> None:
    empty, full = 0, 0
    for index in range(10):
        scene = scene_of("unweighed-doors", index)
        ratios = np.array(
            [o.density_kgm3 / o.perceived.density_kgm3 for o in doors(scene)]
        )
        assert np.log(ratios).std() < 0.12
        assert {o.interaction for o in doors(scene)} == {"movable"}
        share = [o.breakaway_force_n / 60.0 for o in doors(scene)]
        assert not any(0.95 < s < 1.3 for s in share)
        empty, full = empty + (ratios.max() < 1.2), full + (ratios.min() > 2.0)
    assert (empty, full) == (5, 5)


def test_days_of_a_mission_share_the_room() -> None:
    days = [scene_of("revisited-rooms", index) for index in range(3, 6)]
    assert [(s.mission, s.day, s.days) for s in days] == [(1, d, 3) for d in range(3)]
    assert len({repr(s.obstacles) for s in days}) == 1
    assert len({s.certificate.learning for s in days}) == 1
    assert len({(s.start_m, s.goal_m) for s in days}) == 3
    assert len({s.sha256 for s in days}) == 3
    stages = learning(days[0]).parts[0].stages
    assert [s.doors for s in stages] == [stages[0].doors] * 3
    next_mission = scene_of("revisited-rooms", 6)
    assert (next_mission.mission, next_mission.day) == (2, 0)
    assert next_mission.obstacles != days[0].obstacles


def test_the_control_of_days_changes_what_is_true_and_nothing_that_is_seen() -> None:
    days = [scene_of("revisited-rooms-redrawn", index) for index in range(3)]
    seen = {
        repr([(o.id, o.x_m, o.y_m, o.shape, o.perceived) for o in s.obstacles])
        for s in days
    }
    assert len(seen) == 1
    assert len({repr([o.fixed for o in s.obstacles]) for s in days}) > 1


def test_walls_are_seen_as_walls_and_names_tell_no_order() -> None:
    scene = scene_of("lookalike-doors", 0)
    for o in scene.obstacles:
        assert (o.perceived.kind == WALL_KIND) == (o not in doors(scene))
    by_place = [o.id for o in sorted(scene.obstacles, key=lambda o: (o.x_m, o.y_m))]
    assert by_place != sorted(by_place)


def test_told_the_truth_kinds_stay_and_made_up_scores_are_refused() -> None:
    told = generate_scene("lookalike-doors", 0, SEED, "truth")
    pairs = zip(told.obstacles, scene_of("lookalike-doors", 0).obstacles, strict=True)
    for o, same in pairs:
        assert (o.id, o.perceived.kind) == (same.id, same.perceived.kind)
        assert max(o.perceived.scores) == 1.0
    with pytest.raises(SceneError, match="expected perception 'truth'"):
        generate_scene("lookalike-doors", 0, SEED, "misleading")
    with pytest.raises(SceneError, match="the family's own"):
        perceive(told, "noisy", SEED)


def own_family(folder: Path, changes: dict[str, str]) -> None:
    text = (ROOT / "families" / "lookalike-doors.xml").read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    (folder / "mine.xml").write_text(text)


FOUR = {
    '"kinds" data="crate bin cabinet"': '"kinds" data="crate barrel trunk desk"',
    '"barrier_count" data="4"': '"barrier_count" data="2"',
    '"kind_reliability" data="1"': '"kind_reliability" data="0.9"',
    '"workspace" data="11.8 5.4"': '"workspace" data="6.5 7"',
    '"learning_value" data="6"': '"learning_value" data="1"',
}


def test_a_learning_family_of_ones_own_needs_xml_only(tmp_path: Path) -> None:
    own_family(tmp_path, FOUR)
    scene = generate_scene("mine", 0, SEED, templates=tmp_path)
    found = learning(scene)
    assert scene.workspace_m == (0.0, 0.0, 6.5, 7.0)
    assert found.worlds == 14
    assert found.value_s >= 1.0
    assert [len(s.doors) for s in found.parts[0].stages] == [4, 4]
    kinds = {o.perceived.kind for o in doors(scene)}
    assert kinds == {"crate", "barrel", "trunk", "desk"}
    assert {p for row in found.parts[0].opens for p in row} == {0.05, 0.95}


def test_a_robot_crosses_a_learning_family_of_ones_own(tmp_path: Path) -> None:
    """By the command, in rooms that the clairvoyant solves without damage."""
    own_family(tmp_path, FOUR)
    command = [
        "eval", "--planner", "clairvoyant", "--templates", str(tmp_path), "--family",
        "mine", "-n", "2", "--seed", str(SEED), "--workers", "1", "--log",
        "none", "--out", str(tmp_path / "run"),
    ]  # fmt: skip
    assert cli.run(command) == 0
    rows = load_rows(tmp_path / "run")
    assert [row.clean_success for row in rows] == [True, True]
    assert all(row.obstacles_moved >= 2 for row in rows)


BAD: dict[str, tuple[dict[str, str], type[Exception], str]] = {
    "too short": (
        {'"barrier_count" data="4"': '"barrier_count" data="5"'},
        TemplateError, r"at least 14.50 m from west to east for 5 barriers",
    ),
    "too narrow": (
        {"crate bin cabinet": "crate bin cabinet desk"},
        TemplateError, r"at least 6.35 m from south to north for 4 doors",
    ),
    "kinds that repeat": (
        {"crate bin cabinet": "crate bin bin"},
        TemplateError, "two to five different words",
    ),
    "no kinds": (
        {'name="kinds"': 'name="kind"'},
        TemplateError, 'expected <text name="kinds">',
    ),
    "redrawn": (
        {'"redrawn" data="never"': '"redrawn" data="day"'},
        TemplateError, "Unknown redrawn 'day'",
    ),
    "half a barrier": (
        {'"barrier_count" data="4"': '"barrier_count" data="3.5"'},
        TemplateError, "'barrier_count' to be a whole number but it was 3.5",
    ),
    "doors in each other": (
        {'"door_spacing" data="1.45 1.75"': '"door_spacing" data="0.6 0.7"'},
        TemplateError, "'door_spacing' to be at least 0.71 m .* but it was 0.6",
    ),
    "doors that nobody moves": (
        {'"door_force" data="18 32"': '"door_force" data="18 90"'},
        TemplateError, "'door_force' to be at most 57 N, .* up to 90",
    ),
    "a lock in the next row": (
        {'"lock_distance" data="1.5"': '"lock_distance" data="2.6"'},
        TemplateError, "'lock_distance' to be at most 1.9 m, .* but it was 2.6",
    ),
    "too much promised": (
        {'"learning_value" data="6"': '"learning_value" data="60"'},
        GenerationError, r"worth 60 s but in 2 proposals .* at most [0-9.]+ s",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_mistake_is_one_line(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    changes, error, message = BAD[case]
    own_family(tmp_path, changes)
    if "2 proposals" in message:
        monkeypatch.setattr("beacon_mj.scene_gen.learning.generate.HOPELESS", 2)
    with pytest.raises(error, match=message) as caught:
        generate_scene("mine", 0, SEED, templates=tmp_path)
    assert "\n" not in str(caught.value)


def test_rooms_that_nobody_can_cross_are_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def no_way(*_: object) -> None:
        raise NoWayError

    monkeypatch.setattr("beacon_mj.scene_gen.learning.generate.measured_parts", no_way)
    with pytest.raises(GenerationError, match="can cross but none of 20 proposals"):
        generate_scene("lookalike-doors", 0, SEED + 1)


@pytest.mark.parametrize("family", ["hard-required", "hard-shortcut"])
def test_hard_families_say_how_they_are_sensed(family: str) -> None:
    scene = scene_of(family, 0)
    assert scene.robot.force_max_n == 30.0
    assert scene.sensing
    assert scene.sensing.radius_m == 0.5
    assert scene.sensing.occlusion is True
    assert scene.sensing.pose_noise_m == 0.01
    errors = [
        np.log(o.perceived.density_kgm3 / o.density_kgm3)
        for o in [*scene.obstacles, *scene_of(family, 1).obstacles]
    ]
    assert 0.6 < float(np.std(errors)) < 1.5


def test_only_the_papers_families_run_unasked(tmp_path: Path) -> None:
    assert set(default_families()) == set(FAMILIES)
    own_family(tmp_path, {'<text name="suite" data="learning-v1"/>': ""})
    assert set(default_families(tmp_path)) == {*FAMILIES, "mine"}
    own_family(tmp_path, {})
    assert set(default_families(tmp_path)) == set(FAMILIES)
    hashes, refs = generated_scenes((), 1, None)
    assert {*hashes} == {ref.family for ref in refs} == set(FAMILIES)


def test_families_of_before_say_nothing_new(family: str) -> None:
    loaded: Family = load_family(family)
    assert loaded.suite == "paper-v1"
    text = generate_scene(family, 0).to_json()
    for name in (b'kind": "crate', b"sensing", b"mission", b"learning", b"day"):
        assert name not in text
