"""The paper's Table I: which parameters are swept, and over which values."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import msgspec

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import RunError
from beacon_mj.eval.runs.config import PlannerEntry
from beacon_mj.eval.runs.experiment import single_planner
from beacon_mj.eval.runs.overrides import dotted
from beacon_mj.eval.runs.variants import (
    PROTOCOL,
    check_combinations,
    setting_of,
    text_of,
    variant,
)

Grid = Literal["one-at-a-time", "full"]
#: What some fields of one planner are set to, as text, by field.
Changes = Mapping[str, str]


class Swept(NamedTuple):
    """One line of Table I.

    Attributes:
        field: Dotted field of the planner's configuration.
        default: The paper's default.
        values: All values, the default among them.
    """

    field: str
    default: str
    values: tuple[str, ...]


#: Table I. The paper's default radius is that of our robots, which the field's own
#: default of 0 stands for.
TABLE_I = (
    Swept("robot_radius_m", "0.12", ("0.12", "0.45")),
    Swept("weights.w_e", "1.0", ("0.5", "1.0", "1.5")),
    Swept("lambda_occ", "5.0", ("2.5", "5.0", "7.5")),
    Swept("lambda_sem", "2.5", ("1.5", "2.5", "3.5")),
    Swept("push_bias", "0.35", ("0.20", "0.35", "0.50")),
    Swept("detour_margin", "0.50", ("0.25", "0.50", "0.75")),
)


def swept(spec: str) -> tuple[Swept, ...]:
    """Return the lines of Table I that a planner has.

    Raises:
        RunError: If it has none of them.
        PlannerError: If there is no such planner.
    """
    entry = single_planner(spec).entry
    known = dotted(entry.config)
    found = tuple(line for line in TABLE_I if line.field in known)
    if not found:
        raise RunError(
            f"{entry.name}: expected a planner with parameters of Table I "
            f"({', '.join(line.field for line in TABLE_I)}) but it has none."
        )
    return found


def varied_line(
    base: PlannerEntry,
    protocol: Protocol,
    target: str,
    field: str,
    values: Sequence[str],
) -> Swept:
    """Return the line of a field that the user sweeps; what it is now is the default.

    Args:
        base: The planner.
        protocol: The run's.
        target: The planner's name, or `protocol`.
        field: The field.
        values: As given; the default is added if it is not among them.

    Raises:
        BeaconError: If the field or a value is no good.
    """
    name = f"protocol.{field}" if target == PROTOCOL else field
    whole = msgspec.structs.replace(base, protocol=protocol)
    changed = {value: variant(whole, {name: value}, protocol) for value in values}
    same = [
        value
        for value, entry in changed.items()
        if (entry.config, entry.protocol) == (base.config, protocol)
    ]
    if same:
        return Swept(name, same[0], tuple(values))
    now = setting_of(whole, name, protocol)
    return Swept(name, text_of(now), (text_of(now), *values))


def settings_of(lines: Sequence[Swept], grid: Grid) -> list[dict[str, str]]:
    """Return what each configuration of a grid changes; the default comes first.

    Args:
        lines: What is swept.
        grid: `one-at-a-time` changes one parameter and leaves the others at their
            defaults; `full` is the product of all values.

    Raises:
        RunError: If the product is too large.
    """
    if grid == "full":
        check_combinations(len(_default_first(line)) for line in lines)
        product = itertools.product(*(_default_first(line) for line in lines))
        return [_changed(lines, values) for values in product]
    singles = [
        {line.field: value}
        for line in lines
        for value in line.values
        if value != line.default
    ]
    return [{}, *singles]


def _default_first(line: Swept) -> tuple[str, ...]:
    return (line.default, *(v for v in line.values if v != line.default))


def _changed(lines: Sequence[Swept], values: Sequence[str]) -> dict[str, str]:
    return {
        line.field: value
        for line, value in zip(lines, values, strict=True)
        if value != line.default
    }
