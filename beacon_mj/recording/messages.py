"""Protobuf classes of the log's messages, built at run time from `schemas`."""

import functools
from collections.abc import Iterator
from typing import Any

from google.protobuf import descriptor_pb2 as pb
from google.protobuf import descriptor_pool, duration_pb2, timestamp_pb2
from google.protobuf.message_factory import GetMessageClass

from beacon_mj.errors import unknown
from beacon_mj.recording.schemas import BEACON, ENUMS, FOXGLOVE

Field = pb.FieldDescriptorProto
_SCALARS = {
    "bool": Field.TYPE_BOOL,
    "bytes": Field.TYPE_BYTES,
    "double": Field.TYPE_DOUBLE,
    "fixed32": Field.TYPE_FIXED32,
    "string": Field.TYPE_STRING,
    "uint32": Field.TYPE_UINT32,
    "uint64": Field.TYPE_UINT64,
}
_WELL_KNOWN = {
    "Timestamp": timestamp_pb2.DESCRIPTOR,
    "Duration": duration_pb2.DESCRIPTOR,
}
_TABLES = {"foxglove": FOXGLOVE, "beacon_mj": BEACON}


def message(name: str) -> Any:
    """Return the protobuf class of a message, such as `foxglove.Log`."""
    return _classes()[name]


@functools.cache
def schema_data(name: str) -> bytes:
    """Return the FileDescriptorSet of a message with all it depends on."""
    out = pb.FileDescriptorSet()
    for descriptor in _closure(message(name).DESCRIPTOR.file, set()):
        descriptor.CopyToProto(out.file.add())
    return bytes(out.SerializeToString(deterministic=True))


def _closure(file: Any, seen: set[str]) -> Iterator[Any]:
    """Yield a file descriptor after those it imports."""
    if file.name in seen:
        return
    seen.add(file.name)
    for dependency in file.dependencies:
        yield from _closure(dependency, seen)
    yield file


@functools.cache
def _classes() -> dict[str, Any]:
    """Build every class, in a pool of its own."""
    pool = descriptor_pool.DescriptorPool()
    for descriptor in _WELL_KNOWN.values():
        pool.AddSerializedFile(descriptor.serialized_pb)
    out = {}
    for package, table in _TABLES.items():
        for name, fields in table.items():
            pool.Add(_file(package, name, fields))
            full = f"{package}.{name}"
            out[full] = GetMessageClass(pool.FindMessageTypeByName(full))
    return out


def _file(package: str, name: str, fields: str) -> pb.FileDescriptorProto:
    """Return the file that defines one message."""
    file = pb.FileDescriptorProto(
        name=f"{package}/{name}.proto", package=package, syntax="proto3"
    )
    descriptor = file.message_type.add(name=name)
    imports = set()
    for number, field in enumerate(fields.split(), start=1):
        label, kind = field.split(":")
        imports.add(_add_field(descriptor, package, number, label, kind))
    file.dependency.extend(sorted(imports - {""}))
    return file


def _add_field(
    descriptor: pb.DescriptorProto, package: str, number: int, name: str, kind: str
) -> str:
    """Add a field to a message; return the file it needs, or an empty string."""
    base = kind.lstrip("*?")
    field = descriptor.field.add(name=name, number=number)
    repeated = kind.startswith("*")
    field.label = Field.LABEL_REPEATED if repeated else Field.LABEL_OPTIONAL
    if kind.startswith("?"):
        field.proto3_optional = True
        field.oneof_index = len(descriptor.oneof_decl)
        descriptor.oneof_decl.add(name=f"_{name}")
    if base in _SCALARS:
        field.type = _SCALARS[base]
        return ""
    if (values := ENUMS.get(f"{descriptor.name}.{base}")) is not None:
        _add_enum(descriptor, base, values)
        field.type = Field.TYPE_ENUM
        field.type_name = f".{package}.{descriptor.name}.{base}"
        return ""
    field.type = Field.TYPE_MESSAGE
    if base in _WELL_KNOWN:
        field.type_name = f".google.protobuf.{base}"
        return str(_WELL_KNOWN[base].name)
    full = base if "." in base else f"{package}.{base}"
    package, _, base = full.partition(".")
    assert base in _TABLES[package], unknown("message", base, _TABLES[package])
    field.type_name = f".{full}"
    return f"{package}/{base}.proto"


def _add_enum(
    descriptor: pb.DescriptorProto, name: str, values: tuple[str, ...]
) -> None:
    enum = descriptor.enum_type.add(name=name)
    for number, value in enumerate(values):
        enum.value.add(name=value, number=number)
