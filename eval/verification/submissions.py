"""What a leaderboard shows of a run that was verified."""

from collections.abc import Sequence

from beacon_mj.episode.protocol import PRESETS, Protocol
from beacon_mj.eval.metrics.row import Row, rows_sha256
from beacon_mj.eval.report.leaderboard import Line, Share
from beacon_mj.eval.runs.config import PlannerEntry, RunConfig
from beacon_mj.eval.statistics.grouping import suite_title
from beacon_mj.eval.statistics.summary import cell
from beacon_mj.eval.verification.checks import Check
from beacon_mj.planners.registry import is_shipped


def lines_of(
    name: str, config: RunConfig, rows: Sequence[Row], checks: Sequence[Check]
) -> list[Line]:
    """Return a line for each planner and suite of a run.

    Args:
        name: How the submission is called.
        config: Its run.
        rows: The run's rows.
        checks: What came of each level; all of them hold.
    """
    digest = rows_sha256(rows)
    lines = []
    for entry in config.planners:
        own = [row for row in rows if row.planner == entry.name]
        for suite in dict.fromkeys(row.suite for row in own):
            part = [row for row in own if row.suite == suite]
            lines.append(_line(name, config, entry, part, checks, digest))
    return lines


def _line(
    name: str,
    config: RunConfig,
    entry: PlannerEntry,
    rows: Sequence[Row],
    checks: Sequence[Check],
    digest: str,
) -> Line:
    numbers = cell(rows)
    success, clean = (
        Share(*(100.0 * numbers[rate][part] for part in ("rate", "low", "high")))
        for rate in ("success", "clean_success")
    )
    steps = numbers["mean"]["steps"]
    return Line(
        conditions=_conditions(config, entry, rows[0]),
        planner=entry.name,
        origin=_origin(entry),
        oracle=any(row.oracle for row in rows),
        proof=f"{checks[-1].level}: {checks[-1].note}",
        scenes=_scenes(rows),
        success=success,
        clean=clean,
        steps=_mean(steps["mean"], steps["low"], steps["high"]),
        steps_mean=steps["mean"],
        version=", ".join(
            f"{k} {config.versions.get(k, 'unknown')}" for k in ("beacon-mj", "mujoco")
        ),
        digest=digest,
        submission=name,
    )


def _mean(mean: float, low: float | None, high: float | None) -> str:
    if low is None or high is None:
        return f"{mean:.1f}"
    return f"{mean:.1f} [{low:.1f}, {high:.1f}]"


def _conditions(config: RunConfig, entry: PlannerEntry, row: Row) -> str:
    """Return what lines must share to be compared."""
    protocol = told(config.protocol_of(entry.name))
    return f"{suite_title(row.suite)}, perception {row.perception}, {protocol}"


def told(protocol: Protocol) -> str:
    """Return the preset that is nearest to a protocol, and what differs from it."""
    changed = {
        name: [
            f"{field}={getattr(protocol, field)}"
            for field in Protocol.__struct_fields__
            if getattr(protocol, field) != getattr(Protocol.preset(name), field)
        ]
        for name in PRESETS
    }
    nearest = min(PRESETS, key=lambda name: len(changed[name]))
    return ", ".join([f"protocol {nearest}", *changed[nearest]])


def _origin(entry: PlannerEntry) -> str:
    """Return where the planner is from, with the hash of its code."""
    if entry.code:
        files = ", ".join(f"{k} {v[:12]}" for k, v in sorted(entry.code.items()))
        return f"own code: {files}; " + ("isolated" if entry.isolated else "in-process")
    settings = ", ".join(f"{k}={v}" for k, v in entry.settings.items())
    base = "shipped" if is_shipped(entry.spec) else entry.spec
    return f"{base} with {settings}" if settings else base


def _scenes(rows: Sequence[Row]) -> str:
    families = ", ".join(dict.fromkeys(row.family for row in rows))
    seeds = ", ".join(map(str, sorted({row.seed for row in rows})))
    return f"{len(rows)} of {families}; seed {seeds}"
