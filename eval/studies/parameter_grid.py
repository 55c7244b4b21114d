"""The paper's Table I: which parameters are swept, and over which values."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import RunError
from beacon_mj.eval.runs.config import PlannerEntry, configuration
from beacon_mj.eval.runs.overrides import field_names
from beacon_mj.planners.registry import load_planner

Grid = Literal["one-at-a-time", "full"]
Settings = Mapping[str, str]


class Swept(NamedTuple):
    """One line of Table I.

    Attributes:
        field: Field of the planner's configuration.
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
    Swept("w_e", "1.0", ("0.5", "1.0", "1.5")),
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
    name, cls = load_planner(spec)
    known = field_names(cls.Config)
    found = tuple(line for line in TABLE_I if line.field in known)
    if not found:
        raise RunError(
            f"{name}: expected a planner with parameters of Table I "
            f"({', '.join(line.field for line in TABLE_I)}) but it has none."
        )
    return found


def settings_of(lines: Sequence[Swept], grid: Grid) -> list[dict[str, str]]:
    """Return what each configuration of a grid changes; the default comes first.

    Args:
        lines: What is swept.
        grid: `one-at-a-time` changes one parameter and leaves the others at their
            defaults; `full` is the product of all values.
    """
    if grid == "full":
        product = itertools.product(*(_default_first(line) for line in lines))
        return [_changed(lines, values) for values in product]
    singles = [
        {line.field: value}
        for line in lines
        for value in line.values
        if value != line.default
    ]
    return [{}, *singles]


def variant(base: PlannerEntry, settings: Settings) -> PlannerEntry:
    """Return a planner with some values changed, under a name that says which."""
    own = {**base.settings, **settings}
    limits = Protocol() if base.isolated else None
    return PlannerEntry(
        name=variant_name(base.name, settings),
        spec=base.spec,
        settings=own,
        config=configuration(base.spec, own, base.name, limits),
        isolated=base.isolated,
    )


def variant_name(planner: str, settings: Settings) -> str:
    """Return a name such as `beacon[w_e=0.5]`; the default keeps the planner's."""
    inside = ",".join(f"{field}={value}" for field, value in settings.items())
    return f"{planner}[{inside}]" if inside else planner


def _default_first(line: Swept) -> tuple[str, ...]:
    return (line.default, *(v for v in line.values if v != line.default))


def _changed(lines: Sequence[Swept], values: Sequence[str]) -> dict[str, str]:
    return {
        line.field: value
        for line, value in zip(lines, values, strict=True)
        if value != line.default
    }
