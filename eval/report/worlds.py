"""What survives physics: the same planners on the same scenes in several worlds.

Markdown of a page, from runs; no number of ours is typed.
"""

from collections.abc import Callable, Mapping, Sequence

from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.report.reproduction import TABLE_2, TABLE_3
from beacon_mj.eval.statistics.intervals import (
    Interval,
    paired_interval,
    rank_correlation_interval,
    wilson_interval,
)

Rows = Mapping[str, Mapping[str, Sequence[Row]]]  #: By world, then by planner.
BASELINE = "beacon"
_METRICS: Mapping[str, Callable[[Row], float]] = {
    "success": lambda row: 100.0 * row.success,
    "steps": lambda row: float(row.steps),
    "path m": lambda row: row.path_length_m,
    "energy J": lambda row: row.energy_j,
}


def on_common_scenes(runs: Mapping[str, Sequence[Row]]) -> Rows:
    """Return the rows of episodes that every world has, by world and planner.

    Raises:
        RunError: If there are none.
    """
    keys = set.intersection(*({_key(row) for row in own} for own in runs.values()))
    planners = dict.fromkeys(row.planner for row in next(iter(runs.values())))
    scenes = {
        name: {scene for planner, scene in keys if planner == name} for name in planners
    }
    if not keys:
        raise RunError("Expected runs of the same scenes but they share none.")
    shared = set.intersection(*(found for found in scenes.values() if found))
    return {
        world: {
            name: sorted(
                (r for r in own if r.planner == name and r.scene_sha256 in shared),
                key=lambda row: row.key,
            )
            for name in planners
            if scenes[name]
        }
        for world, own in runs.items()
    }


def _key(row: Row) -> tuple[str, str]:
    return row.planner, row.scene_sha256


def comparison(rows: Rows) -> str:
    """Return the tables of planners in all worlds, as Markdown."""
    return "\n".join([
        _scope(rows), _levels(rows), _differences(rows), _orders(rows),
        _agreement(rows),
    ])  # fmt: skip


def _scope(rows: Rows) -> str:
    own = next(iter(next(iter(rows.values())).values()))
    counts: dict[str, int] = {}
    for row in own:
        counts[row.family] = counts.get(row.family, 0) + 1
    families = ", ".join(f"{n} {name}" for name, n in counts.items())
    return (
        f"## {' and '.join(rows)}\n\n{len(own)} scenes ({families}), the same in "
        "both. Brackets are 95 % intervals: Wilson's for rates, BCa bootstrap over "
        "scenes for means.\n"
    )


def _levels(rows: Rows) -> str:
    """Return success, steps and path of each planner, the paper's beside them."""
    lines = ["### Levels\n",
             "| planner | world | success % | steps | path m | energy J |",
             "|---|---|---:|---:|---:|---:|"]  # fmt: skip
    for name in next(iter(rows.values())):
        for world, own in rows.items():
            cells = [rate([row.success for row in own[name]])]
            cells += [_mean(own[name], m) for m in ("steps", "path m", "energy J")]
            lines.append(f"| {name} | {world} | " + " | ".join(cells) + " |")
        if name in TABLE_2:
            success, steps, path = TABLE_2[name]
            energy = f"{TABLE_3[name][1]} (its units)" if name in TABLE_3 else "-"
            lines.append(f"| {name} | the paper | {success} | {steps} | {path} | "
                         f"{energy} |")  # fmt: skip
    return "\n".join([*lines, ""])


def _differences(rows: Rows) -> str:
    """Return each planner less the baseline in each world, and what is kept."""
    worlds = [*rows]
    found = differences(rows)
    lines = [f"### Differences to `{BASELINE}`, paired by scene\n",
             "| planner | of | " + " | ".join(worlds) + " | kept of the physical |",
             "|---|---|" + "---:|" * len(worlds) + "---|"]  # fmt: skip
    for (name, metric), spans in found.items():
        cells = " | ".join(_span(each) for each in spans)
        kept = "; ".join(
            f"{world}: {_kept(spans[0], each)}"
            for world, each in zip(worlds[1:], spans[1:], strict=True)
        )
        lines.append(f"| {name} | {metric} | {cells} | {kept} |")
    return "\n".join([*lines, ""])


def differences(rows: Rows) -> dict[tuple[str, str], list[Interval]]:
    """Return each planner less the baseline, by planner and metric, world by world."""
    return {
        (name, metric): [_paired(own, name, value) for own in rows.values()]
        for name in next(iter(rows.values()))
        if name != BASELINE
        for metric, value in _METRICS.items()
    }


def _kept(physical: Interval, planar: Interval) -> str:
    """Say whether a difference keeps its sign, and its size."""
    signs = [_sign(each) for each in (physical, planar)]
    if signs[0] == 0:
        return "none to keep" if signs[1] == 0 else "only there"
    if signs[1] == 0:
        return "lost"
    if signs[0] != signs[1]:
        return "reversed"
    same = planar.low <= physical.high and physical.low <= planar.high
    return "sign and size" if same else "sign"


def _sign(found: Interval) -> int:
    """Return the sign of a difference, 0 if its interval holds zero."""
    if found.low > 0.0:
        return 1
    return -1 if found.high < 0.0 else 0


def _orders(rows: Rows) -> str:
    """Return the rank correlations of the order of planners."""
    first, *others = rows
    lines = ["### The order of planners\n",
             f"Spearman's rank correlation with `{first}` over "
             f"{len(rows[first])} planners, and Fisher's interval.\n",
             "| | " + " | ".join(others) + " |",
             "|---|" + "---:|" * len(others)]  # fmt: skip
    for metric, value in _METRICS.items():
        means = {
            world: [sum(map(value, r)) / len(r) for r in own.values()]
            for world, own in rows.items()
        }
        cells = [
            _span(rank_correlation_interval(means[first], means[w])) for w in others
        ]
        lines.append(f"| {metric} | " + " | ".join(cells) + " |")
    return "\n".join([*lines, ""])


def _agreement(rows: Rows) -> str:
    """Return how often single episodes agree with those of the physical world."""
    first, *others = rows
    lines = ["### Single episodes, against the same in the physical world\n",
             "| family | world | n | same success % | same number of failed pushes % | "
             "same that something broke % | friction energy over physical |",
             "|---|---|---:|---:|---:|---:|---:|"]  # fmt: skip
    families = dict.fromkeys(r.family for r in next(iter(rows[first].values())))
    for family in families:
        for world in others:
            pairs = [
                (ours, theirs)
                for name in rows[first]
                for ours, theirs in zip(
                    rows[first][name], rows[world][name], strict=True
                )
                if ours.family == family
            ]
            physical = sum(a.push_energy_j for a, _ in pairs)
            energy = sum(b.push_energy_j for _, b in pairs)
            ratio = f"{energy / physical:.2f}" if physical > 0.0 else "-"
            cells = [
                rate([a.success == b.success for a, b in pairs]),
                rate([a.failed_pushes == b.failed_pushes for a, b in pairs]),
                rate([(a.obstacles_broken > 0) == (b.obstacles_broken > 0)
                       for a, b in pairs]),
            ]  # fmt: skip
            lines.append(f"| {family} | {world} | {len(pairs)} | "
                         + " | ".join(cells) + f" | {ratio} |")  # fmt: skip
    return "\n".join([*lines, ""])


def _paired(
    own: Mapping[str, Sequence[Row]], name: str, value: Callable[[Row], float]
) -> Interval:
    return paired_interval(
        [value(row) for row in own[name]], [value(row) for row in own[BASELINE]]
    )


def rate(flags: Sequence[bool]) -> str:
    """Return a share of flags in percent, with Wilson's interval."""
    return share(sum(flags), len(flags))


def share(count: int, n: int) -> str:
    """Return `count` of `n` in percent, with Wilson's interval; - of none."""
    if n == 0:
        return "-"
    low, high = wilson_interval(count, n)
    return f"{100 * count / n:.0f} [{100 * low:.0f}, {100 * high:.0f}]"


def _mean(rows: Sequence[Row], metric: str) -> str:
    values = [_METRICS[metric](row) for row in rows]
    return f"{sum(values) / len(values):.1f}"


def _span(found: Interval) -> str:
    if found.low != found.low:
        return f"{found.estimate:+.2f}" if found.estimate == found.estimate else "-"
    return f"{found.estimate:+.2f} [{found.low:+.2f}, {found.high:+.2f}]"


__all__ = ["comparison", "differences", "on_common_scenes", "rate", "share"]
