"""A planner with some values changed: what `--set` and `--vary` stand for.

A *variant* is a planner with some values changed, under a name that says which, such as
`beacon[push_bias=0.5]`. The values may be the protocol's: each variant has its own.
"""

import itertools
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import msgspec

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import RunError
from beacon_mj.eval.runs.config import PlannerEntry
from beacon_mj.eval.runs.isolation.host import describe_isolated
from beacon_mj.eval.runs.isolation.wire import Ready
from beacon_mj.eval.runs.overrides import (
    built_ins,
    configure,
    convert,
    parse_settings,
)
from beacon_mj.planners.base import Planner
from beacon_mj.planners.registry import ALIASES, load_planner

#: Values as text, `target.field=value`, or as objects by `target.field`.
Values = Sequence[str] | Mapping[str, object]
#: Values to vary, `target.field=a,b,c`, or sequences of objects by `target.field`.
VaryValues = Sequence[str] | Mapping[str, Sequence[object]]

PROTOCOL = "protocol"  #: The target that is no planner.
MAX_COMBINATIONS = 10_000  #: Of varied values.
#: A planner's name is the name of the folder of its logs.
_NAME = re.compile(r"(?!\.)[^/\\\x00-\x1f\x7f]{1,200}")
BRACKETS = re.compile(r"[][]")  #: They tell a variant from its planner.


def axes(vary: VaryValues, targets: Sequence[str]) -> dict[tuple[str, str], list[str]]:
    """Return the values of each varied (target, field).

    Raises:
        RunError: If a text has no such form, a target is not among `targets`, or the
            values of a field do not differ.
    """
    found = dict[tuple[str, str], list[str]]()
    for text in vary_texts(vary):
        key, _, listed = text.partition("=")
        values = alternatives(listed)
        if len({*values}) < len(values) or not all(values):
            raise RunError(
                f"--vary {key}: expected values that differ, such as a,b,c, but they "
                f"were {','.join(values) or 'none'}."
            )
        parsed = parse_settings([f"{canonical(key)}={values[0]}"], targets)
        [(target, fields)] = parsed.items()
        [field] = fields
        if (target, field) in found:
            raise RunError(f"--vary {key}: expected each field once but it repeats.")
        found[target, field] = values
    return found


def variant(
    base: PlannerEntry,
    changes: Mapping[str, str],
    protocol: Protocol,
    cls: type[Planner] | None = None,
) -> PlannerEntry:
    """Return a planner with some values changed, under a name that says which.

    Args:
        base: The planner.
        changes: Text by `field`, or by `protocol.field`.
        protocol: The run's, which the changes of the protocol are applied to.
        cls: Its class; None for that of its spec.

    Raises:
        BeaconError: If a field or a value is no good.
    """
    rules = {
        field.removeprefix("protocol."): text
        for field, text in changes.items()
        if field.startswith("protocol.")
    }
    own = {f: text for f, text in changes.items() if not f.startswith("protocol.")}
    settings = {**base.settings, **own}
    ruled = with_protocol(protocol, rules) if rules else base.protocol
    config = base.config
    if own:
        config = configuration(base, settings, ruled or protocol, cls).config
    return msgspec.structs.replace(
        base,
        name=checked_name(variant_name(base.name, changes)),
        settings=settings,
        config=config,
        protocol=ruled,
        varied={
            field if field.startswith("protocol.") else f"{base.name}.{field}": text
            for field, text in changes.items()
        },
    )


def configuration(
    entry: PlannerEntry,
    settings: Mapping[str, str],
    protocol: Protocol,
    cls: type[Planner] | None = None,
) -> Ready:
    """Return what a planner says of itself: the values of its configuration first.

    Args:
        entry: The planner; one that is isolated is imported in a process of its own,
            and not here.
        settings: Values given as text.
        protocol: Whose limits hold for such a process.
        cls: Its class; None for that of its spec.

    Raises:
        PlannerError: If the planner, a field or a value is no good.
    """
    if entry.isolated:
        limits = protocol.decision_limit_s, protocol.memory_limit_mib
        return describe_isolated(entry.spec, settings, entry.base, *limits)
    cls = cls or load_planner(entry.spec)[1]
    config = built_ins(configure(cls, settings, entry.base))
    return Ready(0, config, cls.bit_reproducible is True)


def variants(
    entry: PlannerEntry,
    cls: type[Planner] | None,
    axes: Mapping[str, Iterable[str]],
    protocol: Protocol,
) -> list[PlannerEntry]:
    """Return a planner with every combination of values; itself if there is none."""
    if not axes:
        return [entry]
    listed = {field: tuple(values) for field, values in axes.items()}
    check_combinations(len(values) for values in listed.values())
    return [
        variant(entry, dict(zip(listed, values, strict=True)), protocol, cls)
        for values in itertools.product(*listed.values())
    ]


def check_combinations(counts: Iterable[int]) -> None:
    """Raise RunError if there are too many combinations of so many values each."""
    found = math.prod(counts)
    if found > MAX_COMBINATIONS:
        raise RunError(
            f"--vary: expected at most {MAX_COMBINATIONS} combinations of values but "
            f"there are {found}."
        )


def variant_name(planner: str, changes: Mapping[str, str]) -> str:
    """Return a name such as `beacon[w_e=0.5]`; no change keeps the planner's."""
    inside = ",".join(f"{field}={value}" for field, value in changes.items())
    return f"{planner}[{inside}]" if inside else planner


def with_protocol(base: Protocol, texts: Mapping[str, str]) -> Protocol:
    """Return a protocol with some fields changed. Raises RunError if one is no good."""
    changed = convert(Protocol, texts, PROTOCOL, RunError)
    values = {field: getattr(changed, field) for field in texts}
    return msgspec.structs.replace(base, **values)


def setting_of(entry: PlannerEntry, key: str, protocol: Protocol) -> object:
    """Return the value of `field`, or of `protocol.field`, of a planner in a run.

    Args:
        entry: The planner.
        key: The field; a dot leads into a nested configuration.
        protocol: The run's.
    """
    try:
        if key.startswith("protocol."):
            rules = entry.protocol or protocol
            own: object = getattr(rules, key.removeprefix("protocol."))
            return own
        found: Any = entry.config
        for part in key.split("."):
            found = found[part]
        return found
    except (AttributeError, LookupError, TypeError) as error:
        raise RunError(f"{entry.name}: expected a value of {key!r}.") from error


def texts_of(values: Values) -> list[str]:
    """Return values as the texts that stand for them, `target.field=value`."""
    if isinstance(values, str):
        return [values]
    if isinstance(values, Mapping):
        return [f"{target}={text_of(value)}" for target, value in values.items()]
    return list(values)


def vary_texts(vary: VaryValues) -> list[str]:
    """Return varied values as the texts that stand for them, `target.field=a;b;c`."""
    if isinstance(vary, str):
        return [vary]
    if not isinstance(vary, Mapping):
        return list(vary)
    lines = []
    for target, values in vary.items():
        texts = [text_of(value) for value in values]
        comma = "," if not any("," in text for text in texts) else ";"
        end = ";" if comma == ";" and len(texts) == 1 else ""
        lines.append(f"{target}={comma.join(texts)}{end}")
    return lines


def text_of(value: object) -> str:
    """Return the text that a value of a setting is given as: `true`, `0.5`, `1,2,3`."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return ",".join(text_of(item) for item in value)
    if isinstance(value, set | frozenset):
        return ",".join(sorted(text_of(item) for item in value))
    return str(value)


def alternatives(text: str) -> list[str]:
    """Return the values in `a,b,c`, or in `1,2;3,4` where a value has commas.

    A comma within brackets separates nothing.
    """
    if ";" in text:
        return [part.strip() for part in text.removesuffix(";").split(";")]
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "[({") - (letter in "])}")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def canonical(setting: str) -> str:
    """Return a setting whose target is called by its name and not by an alias."""
    target, dot, rest = setting.partition(".")
    return ALIASES.get(target, target) + dot + rest


def checked_name(name: str, reserved: re.Pattern[str] | None = None) -> str:
    """Return a name that can also name a folder of logs. Raises RunError if not.

    Args:
        name: The name.
        reserved: What must not be in it.
    """
    bad = reserved is not None and reserved.search(name)
    if bad or not _NAME.fullmatch(name) or len(name.encode()) > 200:
        raise RunError(
            f"Expected a planner's name of 1 to 200 characters that can name a folder "
            f"but it was {name!r}."
        )
    return name
