"""The JSON schema of what crosses between an evaluation and a program."""

import dataclasses
import json
import re
import types
from collections.abc import Mapping
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import msgspec
from reference_python import flowing, meanings, parsed

from beacon_mj.eval.runs.isolation import lines
from beacon_mj.geometry import Array
from beacon_mj.interface import Observation, Task

_PLAIN = {bool: "boolean", int: "integer", float: "number", str: "string"}
_POINT = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
_NUMBER = {"type": "integer", "minimum": 0}
Schema = dict[str, Any]


def exec_schema() -> str:
    """Return the schema of all messages, as JSON text."""
    task, config = record(Task), {"type": "object"}
    requests = {
        "hello": {"protocol": {"const": lines.PROTOCOL}, "beacon_mj": kind(str)},
        "reset": {"task": task, "config": config},
        "next_day": {"task": task},
        "act": {"observation": record(Observation, lines.LEFT_OUT)},
    }
    replies = (lines.Greeting, lines.Ready, lines.Failed, lines.Decision)
    found = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"beacon-mj exec protocol, version {lines.PROTOCOL}",
        "description": "One message a line; requests go to stdin, replies to stdout.",
        "oneOf": [{"$ref": "#/$defs/request"}, {"$ref": "#/$defs/reply"}],
        "$defs": {
            "request": {"oneOf": [request(*each) for each in requests.items()]},
            "reply": {"oneOf": [reply(each) for each in replies]},
        },
    }
    return json.dumps(found, indent=1) + "\n"


def request(name: str, properties: Schema) -> Schema:
    """Return the schema of a request. Of a later version, others may be in it too."""
    own = {"type": {"const": name}, "id": _NUMBER, **properties}
    return {"type": "object", "properties": own, "required": [*own]}


def reply(cls: type[msgspec.Struct]) -> Schema:
    """Return the schema of a reply."""
    found = record(cls)
    found["properties"] = {"type": {"const": cls.__struct_config__.tag}} | found[
        "properties"
    ]
    found["required"] = ["type", *found["required"]]
    return found


def record(cls: type, left_out: frozenset[str] = frozenset()) -> Schema:
    """Return the schema of a class with named fields."""
    notes, hints = meanings(cls), get_type_hints(cls)
    own = {
        name: kind(hints[name], notes.get(name, "")) | described(notes.get(name, ""))
        for name in fields(cls)
        if name not in left_out
    }
    struct = issubclass(cls, msgspec.Struct)
    needed = (
        [f.name for f in msgspec.structs.fields(cls) if f.required] if struct else []
    )
    return {
        "type": "object",
        "description": flowing(parsed(cls).short_description),
        "properties": own,
        "required": needed if struct else [*own],
        **({"additionalProperties": False} if struct else {}),
    }


def fields(cls: type) -> tuple[str, ...]:
    """Return the names of the fields of a dataclass, named tuple or struct."""
    if dataclasses.is_dataclass(cls):
        return tuple(field.name for field in dataclasses.fields(cls))
    names = getattr(cls, "_fields", None) or getattr(cls, "__struct_fields__", None)
    assert names is not None, cls
    return tuple(names)


def described(text: str) -> Schema:
    """Return a description, if there is one."""
    return {"description": text} if text else {}


def kind(hint: Any, note: str = "") -> Schema:
    """Return the schema of a type; a note may say what shape an array has."""
    origin, arguments = get_origin(hint), get_args(hint)
    if hint in _PLAIN:
        return {"type": _PLAIN[hint]}
    if hint is type(None):
        return {"type": "null"}
    if hint == Array:
        return array(note)
    if origin in (Union, types.UnionType):
        return {"anyOf": [kind(each, note) for each in arguments]}
    if origin is Literal:
        return {"enum": [*arguments]}
    if origin in (dict, Mapping):
        return {"type": "object", "additionalProperties": kind(arguments[1])}
    if origin in (tuple, list):
        return several(origin, arguments)
    return record(hint)


def several(origin: type, arguments: tuple[Any, ...]) -> Schema:
    """Return the schema of a tuple or list."""
    found = {"type": "array", "items": kind(arguments[0])}
    if origin is list or arguments[-1] is ...:
        return found
    return found | {"minItems": len(arguments), "maxItems": len(arguments)}


def array(note: str) -> Schema:
    """Return the schema of an array whose note has its shape."""
    shape = re.search(r"shape \((\w+), ?(\w*)\)", note)
    assert shape is not None, f"expected a shape: {note}"
    if shape[2] == "2":
        return {"type": "array", "items": _POINT}
    assert shape[1].isdigit() or not shape[2], note
    number: Schema = {"type": "number"}
    if "infinite" in note:  # JSON has no such number.
        number = {"type": ["number", "null"]}
    count = {"minItems": 2, "maxItems": 2} if shape[1] == "2" else {}
    return {"type": "array", "items": number, **count}
