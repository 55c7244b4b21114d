"""Where two logs differ in what was recorded."""

from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any

import msgspec
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata

from beacon_mj.recording.container import Container
from beacon_mj.recording.drawing import NS
from beacon_mj.recording.messages import message
from beacon_mj.recording.schemas import TOPICS

#: Metadata that may differ between equal recordings: who recorded, and where.
_RECORDER = ("versions", "machine")

Essence = tuple[str, int, Any]


def first_difference(
    log: Path, other: Path, again: str = "the simulation", *, rows: bool = True
) -> str | None:
    """Say where two logs first differ in what was recorded, or return None.

    Args:
        log: The one that is judged.
        other: What it is compared with.
        again: What the other is called.
        rows: Whether the stored rows are compared as well.

    Raises:
        LogError: If one of them cannot be read.
    """
    for one, two in zip_longest(_essence(log, rows), _essence(other, rows)):
        if one != two:
            return f"{log}: {_difference(one, two, again)}"
    return None


def _essence(path: Path, rows: bool) -> Iterator[Essence]:
    """Yield (kind or topic, time [ns], content) of all that must be equal.

    Messages come in their order, then attachments and metadata in the order of names,
    for where those stand between chunks is no matter of content.
    """
    topics: dict[int, str] = {}
    fixed: list[Essence] = []
    for record in Container(path).records():
        if isinstance(record, Channel):
            topics[record.id] = record.topic
        elif isinstance(record, Message):
            yield topics.get(record.channel_id, "?"), record.log_time, record.data
        else:
            fixed += _fixed(record, rows)
    yield from sorted(fixed, key=lambda entry: entry[0])


def _fixed(record: McapRecord, rows: bool) -> Iterator[Essence]:
    """Yield attachments and metadata; those of who recorded are left out."""
    if isinstance(record, Attachment):
        yield f"attachment {record.name}", 0, record.data
    elif isinstance(record, Metadata) and record.name not in _RECORDER:
        data = dict(record.metadata)
        if not rows:
            data.pop("row", None)
        yield f"metadata {record.name}", 0, data


def _difference(logged: Essence | None, other: Essence | None, again: str) -> str:
    """Say in one line how two entries differ."""
    if logged is None or other is None:
        there = logged or other
        assert there is not None
        where = "the log" if other is None else again
        return f"only {where} goes on, with {there[0]} at {there[1] / NS:.1f} s."
    name, time_ns, content = logged
    if (name, time_ns) != other[:2]:
        return (
            f"at {time_ns / NS:.1f} s the log has {name} where {again} has "
            f"{other[0]} at {other[1] / NS:.1f} s."
        )
    where = f"{name} at {time_ns / NS:.1f} s" if name in TOPICS else name
    before, after = _flat(name, content), _flat(name, other[2])
    for key in [*before, *after]:
        if before.get(key) != after.get(key):
            return (
                f"{where}: {key} is {before.get(key)!r} in the "
                f"log but {after.get(key)!r} in {again}."
            )
    return f"{where}: encoded differently."


def _flat(name: str, content: Any) -> dict[str, Any]:
    """Return the named values in an entry."""
    if name in TOPICS:
        return dict(_fields("", message(TOPICS[name]).FromString(content)))
    if isinstance(content, bytes):
        return {"content": f"{len(content)} bytes"}
    out = dict(content)
    try:
        row = msgspec.json.decode(out.get("row", "{}"), type=dict[str, Any])
    except msgspec.DecodeError:
        return out
    out.pop("row", None)
    return out | {f"row.{column}": value for column, value in row.items()}


def _fields(prefix: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield (path, scalar) of everything set in a protobuf message."""
    for field, content in value.ListFields():
        path = f"{prefix}{field.name}"
        items = (
            [(path, content)]
            if not field.is_repeated
            else [(f"{path}[{k}]", item) for k, item in enumerate(content)]
        )
        for key, item in items:
            if hasattr(item, "ListFields"):
                yield from _fields(f"{key}.", item)
            else:
                yield key, item
