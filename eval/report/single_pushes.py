"""What single pushes say: predicted cascades, evidence and energy, as Markdown."""

from collections.abc import Iterator, Sequence
from statistics import median, quantiles

from beacon_mj.eval.report.worlds import rate, share
from beacon_mj.eval.studies.push_trials import Push

MASSES_KG = (2.0, 5.0, 12.0)  #: Ends of the classes of mass.


def predictions(found: Sequence[Push]) -> str:
    """Return how well predicted cascades hold in each world, as Markdown."""
    worlds = [*found[0].trials]
    lines = ["## Single pushes\n",
             f"{len(found)} pushes of 25 cm through the centroid of free obstacles. "
             "*Precision* and *recall* are of which obstacles move more than 10 mm. "
             "*Evidence right*: moved, or did not, as predicted. *Force* is the "
             "evidence of those that moved, over mu m g, and *energy* the work of the "
             "drives over sum F d of what moved: medians, and quartiles.\n",
             "| | n | world | precision % | recall % | evidence right % | force | "
             "energy |",
             "|---|---:|---|---:|---:|---:|---:|---:|"]  # fmt: skip
    for label, own in groups(found):
        for world in worlds:
            cells = " | ".join(_prediction(own, world))
            lines.append(f"| {label} | {len(own)} | {world} | {cells} |")
    return "\n".join([*lines, ""])


def groups(found: Sequence[Push]) -> Iterator[tuple[str, list[Push]]]:
    """Yield all pushes, and those of each family, shape and class of mass."""
    yield "all", [*found]
    for family in dict.fromkeys(p.family for p in found):
        yield family, [p for p in found if p.family == family]
    for shape in sorted({p.shape for p in found}):
        yield shape, [p for p in found if p.shape == shape]
    low = 0.0
    for high in (*MASSES_KG, float("inf")):
        own = [p for p in found if low <= p.mass_kg < high]
        if own:
            end = f"{low:g} to {high:g} kg" if high < 1e9 else f"above {low:g} kg"
            yield end, own
        low = high


def _prediction(own: Sequence[Push], world: str) -> list[str]:
    precision, recall = hits(own, world)
    gave = [p.feasible == (p.trials[world].evidence == "moved") for p in own]
    return [
        share(*precision), share(*recall), rate(gave),
        _middle(force_ratios(own, world)), _middle(energy_ratios(own, world)),
    ]  # fmt: skip


def hits(own: Sequence[Push], world: str) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return hits of all that is predicted to move, and of all that moves."""
    found = [(p.predicted, p.trials[world].moved) for p in own]
    right = sum(len(predicted & moved) for predicted, moved in found)
    predicted = sum(len(each) for each, _ in found)
    return (right, predicted), (right, sum(len(each) for _, each in found))


def force_ratios(own: Sequence[Push], world: str) -> list[float]:
    """Return the force of the evidence of what moved, over its mu m g."""
    moved = [p for p in own if p.trials[world].evidence == "moved"]
    return [p.trials[world].force_n / p.breakaway_n for p in moved]


def energy_ratios(own: Sequence[Push], world: str) -> list[float]:
    """Return the work of the drives over sum F d, of pushes that moved something."""
    trials = [p.trials[world] for p in own]
    return [t.work_j / t.model_j for t in trials if t.model_j > 0.0]


def middle(values: Sequence[float]) -> tuple[float, float, float]:
    """Return the median, and the quartiles; of a single value, that value."""
    if len(values) < 2:
        return (values[0],) * 3
    low, _, high = quantiles(values, method="inclusive")
    return median(values), low, high


def _middle(values: Sequence[float]) -> str:
    if not values:
        return "-"
    centre, low, high = middle(values)
    return f"{centre:.2f} [{low:.2f}, {high:.2f}]"
