"""Our Foxglove messages are Foxglove's; our own are documented."""

from typing import Any

import pytest
from google.protobuf import descriptor_pb2

from beacon_mj.recording.messages import message, schema_data
from beacon_mj.recording.schemas import BEACON, TOPICS
from tests.repository import REPOSITORY


def _files(data: bytes) -> dict[str, Any]:
    files = descriptor_pb2.FileDescriptorSet.FromString(data).file
    for file in files:
        for kind in file.message_type:
            for field in kind.field:
                field.ClearField("json_name")
    return {file.name: file for file in files}


FOXGLOVE_TOPICS = sorted({n for n in TOPICS.values() if n.startswith("foxglove.")})


@pytest.mark.parametrize("name", FOXGLOVE_TOPICS)
def test_schema_is_foxgloves_own(name: str) -> None:
    theirs = pytest.importorskip("foxglove.messages")
    official = getattr(theirs, name.removeprefix("foxglove.")).get_schema()
    ours, expected = _files(schema_data(name)), _files(official.data)
    assert ours.keys() == expected.keys()
    assert len(expected) > 1
    for file, definition in expected.items():
        assert ours[file] == definition, file


@pytest.mark.parametrize("name", sorted(BEACON))
def test_message_round_trips_empty_and_has_schema(name: str) -> None:
    kind = message(f"beacon_mj.{name}")
    assert kind.FromString(kind().SerializeToString()) == kind()
    assert f"beacon_mj/{name}.proto" in _files(schema_data(f"beacon_mj.{name}"))


def test_every_topic_and_field_is_documented() -> None:
    text = (REPOSITORY / "docs" / "logs.md").read_text()
    for topic, name in TOPICS.items():
        assert f"`{topic}`" in text, topic
        assert f"`{name}`" in text, name
    for name, fields in BEACON.items():
        for field in fields.split():
            assert f"`{field.split(':')[0]}`" in text, f"{name}.{field}"
