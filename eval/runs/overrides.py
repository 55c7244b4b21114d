"""Values given as text, such as `beacon.weights.w_t=0.5`, checked for their target.

A configuration may hold others; a dotted name leads to a field at any depth. Values
are laid over the defaults of the configuration as a whole, so that a planner's own
defaults of what it holds stay.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar, get_type_hints

import msgspec

from beacon_mj.errors import PlannerError, RunError, TemplateError, unknown
from beacon_mj.eval.runs.text_values import BadValue, describe, parse_value
from beacon_mj.planners.base import Planner
from beacon_mj.planners.checks import FieldError

T = TypeVar("T")
#: Fields that have another name, and other values, now.
_FORMER = {
    name: "belief.memory=belief, failures or none"
    for name in ("update_belief", "belief.update_belief")
}
Settings = Mapping[str, Mapping[str, str]]


def parse_settings(texts: Sequence[str], targets: Sequence[str]) -> Settings:
    """Return the values of `target.field=value` texts, by target and dotted field.

    Args:
        texts: As given with `--set`; of two for one field the later wins.
        targets: Names that may stand before the first dot.

    Raises:
        RunError: If a text has another form, or its target is not among `targets`.
    """
    out: dict[str, dict[str, str]] = {}
    for text in texts:
        left, equals, value = text.partition("=")
        left = left.strip()
        own = [name for name in targets if left.startswith(f"{name}.")]
        target = max(own, key=len, default=left.partition(".")[0])
        field = left[len(target) + 1 :]
        if not (equals and target and field):
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
    """Return a `target` built from text values; raise `error` if one does not fit.

    Args:
        target: A dataclass or struct, all fields of which have defaults.
        values: Texts by dotted field.
        name: What the user calls it, to stand before the field in errors.
        error: What to raise.
    """
    try:
        default = target()
        known = flat(default)
        for field in values:
            if field not in known and field in _FORMER:
                raise error(f"{name}.{field} is now {name}.{_FORMER[field]}.")
            if field not in known:
                raise error(unknown(f"field of {name}", field, known))
        return _laid_over(default, _tree(values), name)
    except (FieldError, TemplateError) as problem:
        raise error(str(problem)) from problem
    except error:
        raise
    except PlannerError as problem:
        raise error(f"{name}: {problem}") from problem
    except Exception as problem:
        raise error(f"{name}: {type(problem).__name__}: {problem}") from problem


def built_ins(config: Any) -> dict[str, Any]:
    """Return a configuration as a run folder stores it."""
    found: Any = msgspec.to_builtins(config, enc_hook=repr, order="deterministic")
    return found if isinstance(found, dict) else {}


def flat(config: object) -> dict[str, Any]:
    """Return every value of a configuration, and of those it holds, by dotted name."""
    out: dict[str, Any] = {}
    for name in _own_fields(config):
        value = getattr(config, name)
        if _own_fields(value):
            out |= {f"{name}.{inner}": each for inner, each in flat(value).items()}
        else:
            out[name] = value
    return out


def dotted(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return the same of a recorded configuration, in which mappings stand for it."""
    out: dict[str, Any] = {}
    for name, value in record.items():
        if isinstance(value, Mapping):
            out |= {f"{name}.{inner}": each for inner, each in dotted(value).items()}
        else:
            out[name] = value
    return out


def _own_fields(config: object) -> tuple[str, ...]:
    """Return the fields of a struct or dataclass; of anything else none."""
    if isinstance(config, msgspec.Struct):
        return config.__struct_fields__
    return tuple(getattr(config, "__dataclass_fields__", ()))


def _tree(values: Mapping[str, str]) -> dict[str, Any]:
    """Return the texts as nested mappings, one for each configuration."""
    tree: dict[str, Any] = {}
    for full, text in values.items():
        *path, field = full.split(".")
        node = tree
        for name in path:
            node = node.setdefault(name, {})
        node[field] = text
    return tree


def _laid_over(default: T, tree: Mapping[str, Any], name: str) -> T:
    """Return `default` with the values of a tree; `name` leads to it."""
    hints = get_type_hints(type(default), include_extras=True)
    changes = {}
    for field, value in tree.items():
        path = f"{name}.{field}"
        if isinstance(value, dict):
            changes[field] = _laid_over(getattr(default, field), value, path)
        else:
            changes[field] = _parsed(value, hints[field], path)
    try:
        if isinstance(default, msgspec.Struct):
            return msgspec.structs.replace(default, **changes)
        return dataclasses.replace(default, **changes)  # type: ignore[type-var]
    except FieldError as problem:
        raise problem.within(name) from problem


def _parsed(text: str, hint: Any, name: str) -> Any:
    """Return the value of one field."""
    try:
        return parse_value(text, hint)
    except BadValue as problem:
        raise FieldError(name, describe(hint), text) from problem
