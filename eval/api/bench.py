"""Measuring what this machine takes for an episode, and for what it is made of."""

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec
from rich.table import Table

from beacon_mj.errors import RunError, one_line, unknown
from beacon_mj.eval.runs.versions import versions
from beacon_mj.eval.studies.bench import (
    Measure,
    episodes,
    generation,
    medians,
    search,
    start_up,
)
from beacon_mj.eval.studies.bench_scale import scale
from beacon_mj.files import replacing
from beacon_mj.recording.machine import machine
from beacon_mj.regular_files import read_regular
from beacon_mj.rendering.tables import Tabular, add_line, plain_table

#: What can be measured, by name.
PARTS: dict[str, Callable[[], Iterator[Measure]]] = {
    "episodes": episodes,
    "generation": generation,
    "scale": scale,
    "start-up": start_up,
    "search": search,
}
MAX_BYTES = 1_000_000  #: Of a stored run.
_TITLE = "processor time on this machine"
_LEGEND = (
    "Medians. Bare stepping: the same commands on the engine alone, which looks for\n"
    "contacts only where the world does; naive: in every physics step."
)


class Bench(Tabular):
    """What was measured, beside what was measured before.

    Attributes:
        measures: In the order in which they were taken.
        before: Values of a stored run by name; empty if it is compared with none.
    """

    def __init__(
        self, measures: Sequence[Measure], before: dict[str, float] | None = None
    ) -> None:
        """Hold the measures; see `beacon_mj.bench`, which takes them."""
        self.measures = tuple(measures)
        self.before = before or {}

    def as_dict(self) -> dict[str, Any]:
        """Return what a stored run holds: measures, versions, and the machine."""
        values = {m.name: {"value": m.value, "unit": m.unit} for m in self.measures}
        return {"measures": values, "versions": versions(), "machine": machine()}

    def ratio(self, measure: Measure) -> float | None:
        """Return a measure over what it was before; None if it was not taken."""
        before = self.before.get(measure.name)
        return measure.value / before if before else None

    def tables(self) -> Sequence[Table | str]:
        """Return one table, with the ratios to the stored run."""
        table = plain_table(_TITLE)
        table.add_column("")
        for heading in ("now", "", *(("before", "ratio") if self.before else ())):
            table.add_column(heading, justify="right", no_wrap=True)
        for measure in self.measures:
            cells = [measure.name, f"{measure.value:.4g}", f" {measure.unit}"]
            if self.before:
                ratio, old = self.ratio(measure), self.before.get(measure.name)
                cells += ["-" if old is None else f"  {old:.4g}"]
                cells += ["-" if ratio is None else f"  {ratio:.2f}"]
            add_line(table, *cells)
        return [table, _LEGEND]


def bench(
    parts: Sequence[str] = (),
    *,
    rounds: int = 3,
    against: str | Path | None = None,
    save: str | Path | None = None,
    tell: Callable[[str], object] = lambda _: None,
) -> Bench:
    """Measure what episodes cost here, in processor time.

    The same as `beacon-mj bench`.

    Args:
        parts: What to measure: `episodes`, `generation`, `scale`, `start-up`,
            `search`; all by default.
        rounds: How often; the result holds medians, at least 1.
        against: A stored run to compare with.
        save: JSON file to write.
        tell: Told what is being measured, a line a part and round.

    Raises:
        BeaconError: If there is no such part, a file cannot be read or written, or
            the engine alone does not reach the states of the episodes.
    """
    for part in parts:
        if part not in PARTS:
            raise RunError(unknown("part", part, PARTS))
    before = None if against is None else _stored(Path(against))
    chosen = [*parts] or [*PARTS]
    taken: list[list[Measure]] = []
    for number in range(1, max(rounds, 1) + 1):
        taken.append([])
        for part in chosen:
            tell(f"round {number} of {max(rounds, 1)}: {part}")
            taken[-1].extend(PARTS[part]())
    found = Bench(medians(taken), before)
    if save is not None:
        with replacing(Path(save), RunError) as file:
            file.write_text(json.dumps(found.as_dict(), indent=1) + "\n")
    return found


class _Value(msgspec.Struct):
    value: float


class _Stored(msgspec.Struct):
    measures: dict[str, _Value]


def _stored(path: Path) -> dict[str, float]:
    """Return the values of a stored run by name."""
    try:
        run = msgspec.json.decode(read_regular(path, MAX_BYTES), type=_Stored)
    except (OSError, msgspec.DecodeError, RecursionError) as error:
        raise RunError(
            f"{path}: expected what `beacon-mj bench --json` writes but: "
            f"{one_line(str(error))}"
        ) from error
    return {name: each.value for name, each in run.measures.items()}
