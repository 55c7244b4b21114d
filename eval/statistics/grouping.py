"""Which rows make a table: all of them, those of a suite, those of a family."""

from collections.abc import Callable, Sequence
from typing import TypeVar

from beacon_mj.eval.metrics.row import Row

OVERALL = "overall"
SUITE = "suite "  #: Begins the name of a suite's table; no family's name has a space.
NO_SUITE = "no suite"  #: Rows whose scenes are of no released suite.

T = TypeVar("T")


def groups(items: Sequence[T], row: Callable[[T], Row]) -> dict[str, list[T]]:
    """Return what is in each table by its name: overall, then family by family.

    Where more than one suite is present, the families of each stand together after a
    table of the whole suite, such as `suite paper-v1`; a suite of a single family has
    no table of its own.

    Args:
        items: Rows, or pairs of them.
        row: Returns an item's row.
    """
    of: dict[str | None, dict[str, list[T]]] = {}
    for item in items:
        found = row(item)
        of.setdefault(found.suite, {}).setdefault(found.family, []).append(item)
    out = {OVERALL: [*items]}
    for suite, families in of.items():
        if len(of) > 1 and len(families) > 1:
            out[suite_title(suite)] = [i for own in families.values() for i in own]
        for family, own in families.items():
            out[family] = [*out.get(family, ()), *own]
    return out


def suite_title(suite: str | None) -> str:
    """Return how the table of a suite is called."""
    return NO_SUITE if suite is None else f"{SUITE}{suite}"


def shown(names: Sequence[str]) -> list[str]:
    """Return the names of the tables without one that would say the same again."""
    return [*names[1:]] if len(names) == 2 else [*names]
