"""A log gives back the trace it was made from, and every tool can decode it."""

import math
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.planners.base import Planner
from beacon_mj.recording import Recorder, read_log, read_trace
from beacon_mj.recording.schemas import OPTIONAL_TOPICS, TOPICS
from beacon_mj.world import World
from tests.recording.conftest import Sample
from tests.recording.samples import (
    Crash,
    GiveUp,
    PushThrough,
    difference,
    record,
    row,
)

SOMETIMES = {"/damage"}  #: Topics that an episode without damage leaves empty.


@pytest.mark.parametrize("name", ["sample", "damage"])
def test_trace_from_log_equals_live_trace_bit_for_bit(
    name: str, request: pytest.FixtureRequest
) -> None:
    path, live = request.getfixturevalue(name)
    again = read_trace(path)
    assert len(live.steps) > 50
    assert sum(len(s.outcome.contacts) for s in live.steps) > 5
    assert difference(live, again) is None


@pytest.mark.parametrize(
    ("planner", "outcome", "detail"),
    [
        (GiveUp(), "gave_up", "no way"),
        (Crash(), "planner_error", "ZeroDivisionError: oops"),
    ],
)
def test_early_ends_round_trip(
    tmp_path: Path, planner: Planner, outcome: str, detail: str
) -> None:
    live = record(tmp_path / "x.mcap", planner=planner)
    again = read_trace(tmp_path / "x.mcap")
    assert (again.outcome, again.detail, len(again.steps)) == (outcome, detail, 5)
    assert difference(live, again) is None


def test_protocol_round_trips(tmp_path: Path) -> None:
    protocol = Protocol(max_steps=7, sensing_radius_m=0.3)
    record(tmp_path / "x.mcap", protocol=protocol)
    again = read_trace(tmp_path / "x.mcap")
    assert again.protocol == protocol
    assert again.outcome == "timeout"


def test_states_are_those_of_the_world(tmp_path: Path, sample: Sample) -> None:
    class Spy(Recorder):
        """Keeps the states beside logging them."""

        def step(self, record, world, observation):  # type: ignore[no-untyped-def]
            super().step(record, world, observation)
            states.append((world.data.qpos.copy(), world.data.qvel.copy()))

    states: list[tuple[np.ndarray, np.ndarray]] = []
    path = tmp_path / "x.mcap"
    run_episode(sample.trace.scene, PushThrough(), listeners=[Spy(path)])
    log = read_log(path)
    assert log.steps == len(states) > 50
    np.testing.assert_array_equal(log.qpos[1:], [q for q, _ in states])
    np.testing.assert_array_equal(log.qvel[1:], [v for _, v in states])


def test_equal_runs_give_equal_bytes(tmp_path: Path, sample: Sample) -> None:
    record(tmp_path / "again.mcap")
    assert (tmp_path / "again.mcap").read_bytes() == sample.path.read_bytes()


def test_reused_world_gives_equal_bytes(tmp_path: Path, sample: Sample) -> None:
    world = World(sample.trace.scene)
    for name in ("a", "b"):
        run_episode(
            world.scene,
            PushThrough(),
            world=world,
            listeners=[Recorder(tmp_path / name)],
        )
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_log_stays_small(sample: Sample, damage: Sample) -> None:
    for path, _ in (sample, damage):
        assert 20_000 < path.stat().st_size < 300_000


def test_other_readers_decode_every_topic(damage: Sample) -> None:
    with damage.path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        found: dict[str, int] = {}
        for schema, channel, _, message in reader.iter_decoded_messages():
            assert schema is not None
            assert message.DESCRIPTOR.full_name == schema.name == TOPICS[channel.topic]
            found[channel.topic] = found.get(channel.topic, 0) + 1
    # A sensor without errors of its own tells nothing but the truth.
    assert found.keys() == TOPICS.keys() - {"/told"} - OPTIONAL_TOPICS
    assert found["/step"] == found["/state"] == len(damage.trace.steps) + 1


def test_times_are_simulation_times(sample: Sample) -> None:
    log = read_log(sample.path)
    times = [t for t, _ in log.at("/step")]
    assert times == pytest.approx([0.1 * k for k in range(len(times))])
    assert [t for t, _ in log.at("/command")] == pytest.approx(times[:-1])
    assert [t for t, _ in log.at("/decision")] == pytest.approx(times)


def test_metadata_says_how_to_repeat_the_run(sample: Sample) -> None:
    log = read_log(sample.path)
    assert log.finished
    assert log.planner == "push-through"
    assert log.config["planner_config"] == '{"gain":0.1}'
    assert log.config["planner_seed"] == "3"
    assert log.config["scene_sha256"] == sample.trace.scene.sha256 == log.scene.sha256
    assert log.versions["mujoco"].count(".") == 2
    stored = dict(row(sample.trace))
    del stored["wall_time_s"]
    assert log.row == stored


def test_costs_keep_infinity_and_absence(sample: Sample) -> None:
    found = [s.command.info for s in read_trace(sample.path).steps]
    assert {r.cost_detour for r in found} == {None, math.inf}
    assert {r.path_m is None for r in found} == {True, False}


def test_damage_repaints_the_scene(damage: Sample) -> None:
    log = read_log(damage.path)
    broken = {d.obstacle for s in damage.trace.steps for d in s.outcome.damages}
    first, last = log.messages["/scene"][0][1], log.messages["/scene"][-1][1]
    assert len(log.messages["/scene"]) > 1
    pairs = zip(first.entities, last.entities, strict=True)
    changed = {a.id for a, b in pairs if a.metadata != b.metadata}
    assert changed == broken
    assert [m.message for _, m in log.at("/log") if m.message.startswith("break")]
