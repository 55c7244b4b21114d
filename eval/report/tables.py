"""The tables of a report as plain text, for HTML and for Markdown."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from beacon_mj.eval.statistics.compare import Comparison, Cost, Difference, Improvement
from beacon_mj.eval.statistics.oracles import marked, oracles_of
from beacon_mj.eval.statistics.summary import OUTCOMES, OVERALL
from beacon_mj.planners.registry import PAPER, REFERENCE

NOTHING = "–"  # noqa: RUF001  An en dash, where there is nothing to say.
#: Kinds of planners; reference planners stand beside the table, never in the contest.
KINDS = (
    "Planners of the paper",
    "Further planners",
    "Reference planners, out of the contest",
)


class Number(NamedTuple):
    """A number and its interval, as text."""

    text: str
    interval: str = ""


class Group(NamedTuple):
    """Lines of one kind: label and cells of each."""

    label: str
    lines: list[tuple[str, list[Number]]]


class Table(NamedTuple):
    """A table: its title, what stands above the columns, and its lines."""

    title: str
    headings: list[str]
    groups: list[Group]
    prose: bool = False  #: Whether the last column is a text, which may be long.


#: Columns of the tables of results: heading, entry of a summary's cell, digits.
MEANS: tuple[tuple[str, str, str, int], ...] = (
    ("steps", "mean", "steps", 0),
    ("path m", "mean", "path_length_m", 2),
    ("path m, solved", "mean_over_successes", "path_length_m", 2),
    ("contacts", "mean", "contacts", 2),
    ("sensed", "mean", "sensed_obstacles", 1),
    ("energy J", "mean", "energy_j", 0),
    ("energy J at κ_d = 2 J/m", "mean", "energy_rolling_j", 1),
    ("broken", "mean", "obstacles_broken", 2),
    ("peak force N", "mean", "filtered_peak_force_n", 1),
)
#: Columns of the tables of missions: heading, column, digits.
SUMS = (
    ("steps", "steps", 0),
    ("path m", "path_length_m", 2),
    ("energy J", "energy_j", 0),
    ("pushes", "pushes", 1),
    ("failed pushes", "failed_pushes", 1),
    ("broken", "obstacles_broken", 2),
)
COSTS = (
    ("path m", "path_length_m", 2),
    ("steps", "steps", 1),
    ("energy J", "energy_j", 1),
    ("energy J at κ_d = 2 J/m", "energy_rolling_j", 1),
    ("contacts", "contacts", 2),
    ("broken", "obstacles_broken", 2),
)
BELIEFS = (
    ("Brier, first sight", "brier_prior"),
    ("Brier, end", "brier_posterior"),
    ("Brier, first sight, pushed", "brier_pushed_prior"),
    ("Brier, end, pushed", "brier_pushed_posterior"),
    ("log loss, first sight", "log_loss_prior"),
    ("log loss, end", "log_loss_posterior"),
    ("identified after s", "time_to_identify_s"),
)


def results(summary: dict[str, Any], family: str) -> Table:
    """Return a table of results: a line a planner."""
    lines = [
        (name, [*_rates(cells[family]), *_means(cells[family])])
        for name, cells in summary["tables"].items()
        if family in cells
    ]
    headings = ["solved", "success %", "clean %", *(m[0] for m in MEANS)]
    n = max(c[family]["n"] for c in summary["tables"].values() if family in c)
    told = oracles_of(summary)
    return Table(f"{title(family)}, {_scenes(n)}", headings, grouped(lines, told))


def missions(summary: dict[str, Any], family: str) -> Table:
    """Return a table of whole missions: a line a planner."""
    cells = {n: own[family] for n, own in summary["missions"].items() if family in own}
    days = max(cell["days"] for cell in cells.values())
    lines = [
        (
            name,
            [
                *_rates(cell),
                *(mean(cell["mean"][column], digits) for _, column, digits in SUMS),
                *(mean(day["mean"]["steps"], 0) for day in cell["by_day"]),
            ],
        )
        for name, cell in cells.items()
    ]
    headings = ["all days solved", "success %", "clean %", *(h for h, _, _ in SUMS)]
    headings += [f"steps, day {1 + k}" for k in range(days)]
    n = max(cell["n"] for cell in cells.values())
    title = f"{family}, {n} mission{'s' if n != 1 else ''} of {days} days"
    return Table(title, headings, grouped(lines, oracles_of(summary)))


def outcomes(summary: dict[str, Any]) -> Table:
    """Return how the episodes of each planner ended, in counts."""
    total = {n: cells[OVERALL]["outcomes"] for n, cells in summary["tables"].items()}
    used = [o for o in OUTCOMES if any(counts[o] for counts in total.values())]
    lines = [(n, [Number(str(counts[o])) for o in used]) for n, counts in total.items()]
    return Table(
        "How episodes ended",
        [o.replace("_", " ") for o in used],
        grouped(lines, oracles_of(summary)),
    )


def beliefs(summary: dict[str, Any]) -> Table | None:
    """Return the scores of class beliefs; None if no planner reports any."""
    lines = [
        (name, [mean(cells[OVERALL]["mean"][column], 2) for _, column in BELIEFS])
        for name, cells in summary["tables"].items()
        if cells[OVERALL]["mean"]["brier_prior"]["n"]
    ]
    if not lines:
        return None
    headings = [h for h, _ in BELIEFS]
    return Table("Scores of beliefs", headings, grouped(lines, oracles_of(summary)))


def differences(
    found: Sequence[Comparison], family: str, *, whole_missions: bool = False
) -> Table:
    """Return paired differences from the baseline in one family: a line a planner.

    Args:
        found: The comparisons.
        family: Which family, or all.
        whole_missions: Whether missions are compared, in place of scenes.
    """
    lines, sizes = [], [0]
    for comparison in found:
        cells_by = comparison.missions if whole_missions else comparison.cells
        if (cell := cells_by.get(family)) is None:
            continue
        sizes.append(cell.scenes)
        success = cell.rates["success"]
        cells = [
            difference(success.difference, 1, 100.0),
            Number(p_value(success.p_value)),
            Number(str(cell.costs["steps"].solved.n)),
            *(difference(cell.costs[c].solved, digits) for _, c, digits in COSTS),
            _improvement(cell.costs["path_length_m"]),
        ]
        if family == OVERALL and not whole_missions:
            cells.insert(2, Number(p_value(comparison.p_holm)))
        lines.append((comparison.first, cells))
    headings = ["success, points", "p", "both solved"]
    if family == OVERALL and not whole_missions:
        headings.insert(2, "p, Holm")
    headings += [*(h for h, _, _ in COSTS), "P(shorter path) %"]
    told = [c.first for c in found if c.first_oracle]
    size = f"{max(sizes)} missions" if whole_missions else _scenes(max(sizes))
    return Table(f"{title(family)}, {size}", headings, grouped(lines, told))


def reasons(found: Sequence[tuple[str, str, int]]) -> Table:
    """Return why episodes were no success: planner, why, and how often."""
    lines = [(name, [Number(str(n)), Number(why)]) for name, why, n in found]
    return Table(
        "Why episodes were no success, the commonest reasons of each planner",
        ["episodes", "outcome and detail"],
        [Group("", lines)] if lines else [],
        prose=True,
    )


def grouped(
    lines: Iterable[tuple[str, list[Number]]], told: Sequence[str]
) -> list[Group]:
    """Return lines by kind of planner, without kinds that no planner is of.

    Args:
        lines: Planner and cells.
        told: The planners that are oracles.
    """
    kinds: dict[str, list[tuple[str, list[Number]]]] = {kind: [] for kind in KINDS}
    for line in lines:
        name, cells = line
        shown = marked(name, name in told)
        kinds[kind_of(name, oracle=name in told)].append((shown, cells))
    return [Group(kind, own) for kind, own in kinds.items() if own]


def kind_of(planner: str, *, oracle: bool) -> str:
    """Return which of `KINDS` a planner is; an oracle is one of reference."""
    if oracle:
        return KINDS[2]
    if planner in PAPER:
        return KINDS[0]
    return KINDS[2] if planner in REFERENCE else KINDS[1]


def title(family: str) -> str:
    """Return how a family is called above a table."""
    if family == OVERALL:
        return "All families"
    return family[:1].upper() + family[1:] if " " in family else family


def difference(found: Difference, digits: int, scale: float = 1.0) -> Number:
    """Return a signed difference with its interval."""
    if found.estimate is None:
        return Number(NOTHING)
    form = f"+.{digits}f"
    interval = _interval(found.low, found.high, form, scale)
    return Number(_signed(scale * found.estimate, form), interval)


def p_value(value: float) -> str:
    """Return a p-value with as many digits as matter."""
    return "< 0.001" if value < 0.001 else f"{value:.3f}"


def percent(rate: dict[str, Any], digits: int = 1) -> Number:
    """Return a rate in percent with its interval."""
    if rate["rate"] is None:
        return Number(NOTHING)
    interval = _interval(rate["low"], rate["high"], f".{digits}f", 100.0)
    return Number(f"{100.0 * rate['rate']:.{digits}f}", interval)


def _scenes(n: int) -> str:
    return f"{n} scene{'s' if n != 1 else ''}"


def _rates(cell: dict[str, Any]) -> list[Number]:
    won = cell["success"]
    return [
        Number(f"{won['count']}/{won['n']}"),
        percent(won),
        percent(cell["clean_success"]),
    ]


def _means(cell: dict[str, Any]) -> list[Number]:
    return [mean(cell[over][column], digits) for _, over, column, digits in MEANS]


def mean(cell: dict[str, Any], digits: int) -> Number:
    """Return a mean with its interval."""
    if cell["mean"] is None:
        return Number(NOTHING)
    form = f".{digits}f"
    return Number(
        f"{cell['mean']:{form}}", _interval(cell["low"], cell["high"], form, 1.0)
    )


def _improvement(cost: Cost) -> Number:
    found: Improvement = cost.improvement
    interval = _interval(found.low, found.high, ".0f", 100.0)
    return Number(f"{100.0 * found.probability:.0f}", interval)


def _interval(low: float | None, high: float | None, form: str, scale: float) -> str:
    if low is None or high is None:
        return ""
    return f"[{_signed(scale * low, form)}, {_signed(scale * high, form)}]"


def _signed(value: float, form: str) -> str:
    """Return a number without the sign of a zero that rounding made."""
    text = f"{value:{form}}"
    return f"{0.0:{form}}" if float(text) == 0.0 else text
