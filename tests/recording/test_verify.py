"""A genuine log proves itself; a forged one does not, even with mended checksums."""

import hashlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.records import Attachment, McapRecord, Message, Metadata

from beacon_mj.episode.trace import Trace
from beacon_mj.errors import LogError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.planners.base import Planner
from beacon_mj.recording import provenance, read_log, rebuild_trace, verify
from beacon_mj.recording.machine import machine
from beacon_mj.recording.messages import message
from beacon_mj.recording.schemas import SCENE_NAME, TOPICS, WORLD_NAME
from beacon_mj.recording.tolerance import TOLERANCE_M
from tests.recording.conftest import Sample
from tests.recording.samples import Crash, GiveUp, record, rewrite, row


@pytest.mark.parametrize("name", ["sample", "damage"])
def test_genuine_log_proves_itself(name: str, request: pytest.FixtureRequest) -> None:
    path, live = request.getfixturevalue(name)
    found = verify(path, row)
    assert found.problem is None
    assert found.ok
    assert found.row_checked
    assert found.steps == len(live.steps)


@pytest.mark.parametrize("planner", [GiveUp(), Crash()])
def test_early_ends_prove_themselves(tmp_path: Path, planner: Planner) -> None:
    record(tmp_path / "x.mcap", planner=planner)
    assert verify(tmp_path / "x.mcap", row).problem is None


def _forge(
    sample: Sample, out: Path, topic: str, number: int, edit: Callable[[Any], None]
) -> None:
    """Change the `number`-th message of a topic that `edit` can be applied to."""
    seen = 0
    done = []

    def change(name: str, r: McapRecord) -> McapRecord:
        nonlocal seen
        if name == topic and isinstance(r, Message):
            seen += 1
            if seen == number:
                found = message(TOPICS[topic]).FromString(r.data)
                edit(found)
                assert found.SerializeToString() != r.data
                r.data = found.SerializeToString()
                done.append(True)
        return r

    rewrite(sample.path, out, change)
    assert done


def _command(m: Any) -> None:
    m.velocity_mps.x *= 1.0 + 1e-9


def _state(m: Any) -> None:
    m.qpos[0] += 1e-12


def _force(m: Any) -> None:
    m.contacts[0].peak_n *= 0.5


def _position(m: Any) -> None:
    m.position_m.y += 1e-9


def _transform(m: Any) -> None:
    m.transforms[0].translation.x += 0.1


def _text(m: Any) -> None:
    m.message = "nothing to see here"


@pytest.mark.parametrize(
    ("topic", "number", "edit", "message"),
    [
        ("/command", 12, _command, r"/state at 1.2 s: qpos\[0\] is .* in the log but"),
        ("/state", 9, _state, r"/state at 0.8 s: qpos\[0\]"),
        ("/contacts", 3, _force, r"/contacts at .*peak_n"),
        ("/step", 21, _position, r"/step at 2.0 s: position_m.y"),
        ("/tf", 31, _transform, r"/tf at 3.0 s: transforms\[0\].translation.x"),
        ("/log", 2, _text, r"/log at .*message is 'nothing to see here'"),
    ],
)
def test_forged_message_is_caught_where_it_differs(
    sample: Sample,
    tmp_path: Path,
    topic: str,
    number: int,
    edit: Callable[[Any], None],
    message: str,
) -> None:
    out = tmp_path / "forged.mcap"
    _forge(sample, out, topic, number, edit)
    found = verify(out, row)
    assert not found.ok
    assert found.problem is not None
    assert re.search(message, found.problem), found.problem
    assert "\n" not in found.problem


def _with_metadata(sample: Sample, out: Path, name: str, **values: str) -> None:
    def change(topic: str, r: McapRecord) -> McapRecord:
        if isinstance(r, Metadata) and r.name == name:
            r.metadata |= values
        return r

    rewrite(sample.path, out, change)


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        (
            {"outcome": "timeout"},
            "metadata result: outcome is 'timeout' in the log but 'reached'",
        ),
        ({"steps": "3"}, "expected 3 steps"),
        ({"row": '{"outcome":"reached","steps":1}'}, "metadata result: row.steps is 1"),
    ],
)
def test_forged_result_is_caught(
    sample: Sample, tmp_path: Path, values: dict[str, str], problem: str
) -> None:
    out = tmp_path / "forged.mcap"
    _with_metadata(sample, out, "result", **values)
    found = verify(out, row).problem
    assert found is not None
    assert re.search(problem, found), found


def test_forged_attachment_is_caught(sample: Sample, tmp_path: Path) -> None:
    def change(topic: str, r: McapRecord) -> McapRecord:
        if isinstance(r, Attachment) and r.name == SCENE_NAME:
            r.data = r.data.replace(b'"movable"', b'"safe"', 1)
        return r

    rewrite(sample.path, tmp_path / "x.mcap", change)
    problem = verify(tmp_path / "x.mcap", row).problem
    assert problem is not None
    assert "expected attachment 'scene.json' to have SHA-256" in problem


def test_forged_world_with_mended_hash_is_caught(
    sample: Sample, tmp_path: Path
) -> None:
    def change(topic: str, r: McapRecord) -> McapRecord:
        if isinstance(r, Attachment) and r.name == WORLD_NAME:
            r.data = forged
        if isinstance(r, Metadata) and r.name == "attachments":
            r.metadata[WORLD_NAME] = hashlib.sha256(forged).hexdigest()
        return r

    forged = b"<mujoco/>"
    rewrite(sample.path, tmp_path / "x.mcap", change)
    problem = verify(tmp_path / "x.mcap", row).problem
    assert problem is not None
    assert "attached world differs" in problem
    assert "line 1" in problem


def test_other_engine_is_refused_by_name(sample: Sample, tmp_path: Path) -> None:
    _with_metadata(sample, tmp_path / "x.mcap", "versions", mujoco="3.1.6")
    problem = verify(tmp_path / "x.mcap", row).problem
    here = provenance.log_versions()["mujoco"]
    assert problem is not None
    assert f"recorded with mujoco 3.1.6 but this is mujoco {here}" in problem


def test_another_machine_verifies_a_log_as_well(sample: Sample, tmp_path: Path) -> None:
    assert read_log(sample.path).machine == machine()
    changes = dict.fromkeys(machine(), "another")
    _with_metadata(sample, tmp_path / "x.mcap", "machine", **changes)
    assert read_log(tmp_path / "x.mcap").machine == changes
    assert verify(tmp_path / "x.mcap", row).ok


def _measured(trace: Trace) -> dict[str, Any]:
    return measure(trace).as_dict()


def _from_elsewhere(
    sample: Sample, folder: Path, topic: str, edit: Callable[[Any], None], row_of: Trace
) -> Path:
    """Return a forged log of another processor, with the row of a trace."""
    _forge(sample, folder / "forged.mcap", topic, 21, edit)
    forged = Sample(folder / "forged.mcap", sample.trace)
    text = provenance.to_json(provenance.stable_row(_measured(row_of)))
    _with_metadata(forged, folder / "row.mcap", "result", row=text)
    named = Sample(folder / "row.mcap", sample.trace)
    _with_metadata(named, folder / "elsewhere.mcap", "versions", machine="aarch64")
    return folder / "elsewhere.mcap"


@pytest.mark.parametrize(("share", "ok"), [(0.5, True), (2.0, False)])
def test_states_of_another_processor_are_compared_within_the_tolerance(
    sample: Sample, tmp_path: Path, share: float, ok: bool
) -> None:
    def shift(m: Any) -> None:
        m.position_m.x += share * TOLERANCE_M

    found = verify(_from_elsewhere(sample, tmp_path, "/step", shift, sample.trace))
    assert found.ok == ok, found.problem
    assert found.tolerance_m == TOLERANCE_M
    assert ok or "more than 0.0001 m" in str(found.problem)
    # On a machine of this kind not one bit may differ.
    here = verify(tmp_path / "row.mcap")
    assert (here.ok, here.tolerance_m) == (False, 0.0)


@pytest.mark.parametrize(
    ("mended", "whose"),
    [(False, "its own states give"), (True, "the simulation gives")],
)
def test_a_log_cannot_say_of_its_work_what_it_likes_by_naming_another_machine(
    sample: Sample, tmp_path: Path, mended: bool, whose: str
) -> None:
    def toil(m: Any) -> None:
        m.actuator_work_j += 1.0

    busy = tmp_path / "busy.mcap"
    _forge(sample, busy, "/step", 21, toil)
    row_of = rebuild_trace(read_log(busy)) if mended else sample.trace
    path = _from_elsewhere(sample, tmp_path, "/step", toil, row_of)
    problem = str(verify(path, _measured).problem)
    assert re.search(rf"row\.actuator_work_j is .* but {whose}", problem), problem


def test_how_an_episode_ended_elsewhere_is_compared_exactly(
    sample: Sample, tmp_path: Path
) -> None:
    _with_metadata(sample, tmp_path / "x.mcap", "versions", machine="aarch64")
    genuine = verify(tmp_path / "x.mcap", row)
    assert genuine.ok, genuine.problem
    ended = Sample(tmp_path / "x.mcap", sample.trace)
    _with_metadata(ended, tmp_path / "y.mcap", "result", outcome="timeout")
    assert not verify(tmp_path / "y.mcap", row).ok


def test_unfinished_log_is_refused(sample: Sample, tmp_path: Path) -> None:
    data = sample.path.read_bytes()
    (tmp_path / "x.mcap").write_bytes(data[: int(0.7 * len(data))])
    problem = verify(tmp_path / "x.mcap", row).problem
    assert problem is not None
    assert "unfinished" in problem


def test_without_a_row_function_the_row_is_not_checked(
    sample: Sample, tmp_path: Path
) -> None:
    _with_metadata(sample, tmp_path / "x.mcap", "result", row='{"steps":1}')
    found = verify(tmp_path / "x.mcap")
    assert found.ok
    assert not found.row_checked


def test_a_log_of_another_schema_gets_one_clear_line(
    sample: Sample, tmp_path: Path
) -> None:
    _with_metadata(sample, tmp_path / "x.mcap", "config", schema="2")
    with pytest.raises(LogError, match="schema 3 but it is of schema 2: read it with"):
        read_log(tmp_path / "x.mcap")
