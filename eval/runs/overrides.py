"""Values given as text, such as `beacon.push_bias=0.5`, checked for their target."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import msgspec

from beacon_mj.errors import PlannerError, RunError, unknown
from beacon_mj.planners.base import Planner

T = TypeVar("T")
Settings = Mapping[str, Mapping[str, str]]


def parse_settings(texts: Sequence[str], targets: Sequence[str]) -> Settings:
    """Return the values of `target.field=value` texts, by target and field.

    Args:
        texts: As given with `--set`; of two for one field the later wins.
        targets: Names that may stand before the dot.

    Raises:
        RunError: If a text has another form, or its target is not among `targets`.
    """
    out: dict[str, dict[str, str]] = {}
    for text in texts:
        left, equals, value = text.partition("=")
        target, dot, field = left.strip().rpartition(".")
        if not (equals and dot and target and field):
            raise RunError(f"--set {text}: expected TARGET.FIELD=VALUE.")
        if target not in targets:
            raise RunError(f"--set {text}: {unknown('target', target, targets)}")
        out.setdefault(target, {})[field] = value.strip()
    return out


def configure(cls: type[Planner], values: Mapping[str, str], name: str) -> Any:
    """Return the planner's configuration with `values` in place of defaults.

    Raises:
        PlannerError: If a field does not exist, or a value has the wrong type or is
            out of range.
    """
    return convert(cls.Config, values, name, PlannerError)


def convert(
    target: type[T], values: Mapping[str, str], name: str, error: type[Exception]
) -> T:
    """Return a `target` built from text values; raise `error` if one does not fit."""
    known = field_names(target)
    for field, text in values.items():
        if field not in known:
            raise error(unknown(f"field of {name}", field, known))
        if text.lower().lstrip("+-") in ("nan", "inf", "infinity"):
            raise error(f"Expected {name}.{field} to be finite but it was {text}.")
    try:
        return msgspec.convert(dict(values), target, strict=False)
    except msgspec.ValidationError as problem:
        raise error(f"{name}: {_readable(str(problem), values)}") from problem
    except PlannerError as problem:
        raise error(f"{name}: {problem}") from problem
    except Exception as problem:
        raise error(f"{name}: {type(problem).__name__}: {problem}") from problem


def _readable(message: str, values: Mapping[str, str]) -> str:
    """Turn "Expected `float`, got `str` - at `$.a`" into "a: expected float ..."."""
    what, _, path = message.partition(" - at `$.")
    field = path.rstrip("`")
    wanted = what.partition(", got")[0].replace("`", "").replace("Expected", "expected")
    return f"{field}: {wanted} but it was {values.get(field)!r}."


def field_names(target: type) -> tuple[str, ...]:
    """Return the fields of a struct or dataclass."""
    if issubclass(target, msgspec.Struct):
        return target.__struct_fields__
    return tuple(getattr(target, "__dataclass_fields__", ()))
