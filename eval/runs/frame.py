"""Rows as a table of typed columns, with a column for every setting that varies."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec import UNSET

from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import RunConfig
from beacon_mj.eval.runs.variants import setting_of, text_of

if TYPE_CHECKING:
    import polars as pl

SET = "set."  #: Begins the column of a setting, such as `set.beacon.push_bias`.


def varied_settings(config: RunConfig) -> dict[str, dict[str, Any]]:
    """Return the value of each varied setting by column, then by planner.

    A planner that does not have the setting is not there.
    """
    columns: dict[str, dict[str, Any]] = {}
    for entry in config.planners:
        for target in entry.varied:
            key = target.removeprefix(f"{entry.base}.")
            value = setting_of(entry, key, config.protocol)
            columns.setdefault(SET + target, {})[entry.name] = value
    return columns


def frame(rows: Sequence[Row], config: RunConfig | None = None) -> "pl.DataFrame":
    """Return rows as a polars frame, in canonical order and with typed columns.

    Args:
        rows: Rows in any order.
        config: Their run, for the columns of what it varies; None for none of them.
    """
    ordered = sorted(rows, key=lambda row: row.key)
    found = typed_frame(ordered, Row)
    columns = {} if config is None else varied_settings(config)
    return found.with_columns(
        _column(name, [values.get(row.planner) for row in ordered])
        for name, values in columns.items()
    )


def typed_frame(
    rows: Sequence[msgspec.Struct], kind: type[msgspec.Struct]
) -> "pl.DataFrame":
    """Return structs of one kind as a polars frame, a column a field.

    A field that is unset in all of them is no column; in some of them it is null there.
    """
    import polars as pl

    names = {int: pl.Int64, float: pl.Float64, bool: pl.Boolean, str: pl.String}
    unset = {
        field.name
        for field in msgspec.structs.fields(kind)
        if field.default is UNSET
        and all(getattr(row, field.name) is UNSET for row in rows)
    }
    schema = {
        field.name: names.get(_plain(field.type), pl.String)
        for field in msgspec.structs.fields(kind)
        if field.name not in unset
    }
    return pl.DataFrame([_columns(row, schema) for row in rows], schema=schema)


def _columns(row: msgspec.Struct, names: Iterable[str]) -> dict[str, Any]:
    values = ((name, getattr(row, name)) for name in names)
    return {name: None if value is UNSET else value for name, value in values}


def _column(name: str, values: Sequence[Any]) -> "pl.Series":
    """Return a column of numbers or of flags; of anything else as text."""
    import polars as pl

    kinds = {type(value) for value in values if value is not None}
    for dtype, allowed in (
        (pl.Boolean, {bool}),
        (pl.Int64, {int}),
        (pl.Float64, {int, float}),
    ):
        if kinds <= allowed:
            return pl.Series(name, values, dtype=dtype, strict=False)
    texts = [None if value is None else text_of(value) for value in values]
    return pl.Series(name, texts, dtype=pl.String)


def _plain(annotation: Any) -> Any:
    """Return the type of a column without its `| None`."""
    return next(
        (a for a in getattr(annotation, "__args__", ()) if a in (float, int)),
        annotation,
    )
