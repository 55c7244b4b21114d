"""A step of a trace in words: what the planner decided and what happened."""

from beacon_mj.episode.trace import StepRecord, Trace
from beacon_mj.errors import printable

EVENT_S = 1.0  #: How long an event is told [s].


def describe(trace: Trace, step: int) -> list[str]:
    """Return the lines about one step: title, decision, costs and force, events.

    They can be shown anywhere: what cannot be printed is escaped.
    """
    return [printable(line) for line in _lines(trace, step)]


def summary(trace: Trace) -> str:
    """Return an episode in a line: scene, planner, how it ended, steps and time."""
    outcome = (trace.outcome or "unfinished").replace("_", " ")
    steps = len(trace.steps)
    time_s = trace.steps[-1].outcome.time_s if steps else 0.0
    line = f"{trace.scene.name}, {trace.planner}: {outcome}, {steps} steps"
    return printable(f"{line}, {time_s:.1f} s")


def decision(record: StepRecord) -> str:
    """Return what a planner decided and why, in one line of at most 100 characters."""
    return printable(_decision(record))


def _lines(trace: Trace, step: int) -> list[str]:
    record = trace.steps[step - 1] if step else None
    time_s = 0.0 if record is None else record.outcome.time_s
    title = f"{trace.scene.name}, {trace.planner}, t = {time_s:.1f} s"
    if step == len(trace.steps) and trace.outcome is not None:
        title += f", END: {trace.outcome}"
    if record is None:
        return [title]
    return [
        title,
        _decision(record),
        ", ".join([*_costs(record), *_force(record)]),
        "; ".join(recent_events(trace, step)),
    ]


def _decision(record: StepRecord) -> str:
    info = record.command.info
    target = "" if info.target is None else f" {info.target}"
    line = f"{info.action}{target}"
    if info.reason:
        line += f": {info.reason}"
    return line if len(line) <= 100 else line[:99] + "…"


def _costs(record: StepRecord) -> list[str]:
    info = record.command.info
    return [
        f"{name} = {value:.1f}"
        for name, value in (
            ("cost_push", info.cost_push),
            ("cost_detour", info.cost_detour),
        )
        if value is not None
    ]


def _force(record: StepRecord) -> list[str]:
    """Return the strongest contact of a step, in words."""
    strongest = max(
        record.outcome.contacts, key=lambda c: c.filtered_peak_n, default=None
    )
    if strongest is None or strongest.filtered_peak_n < 1.0:
        return []
    return [
        f"{strongest.counterpart} on {strongest.obstacle}: "
        f"{strongest.filtered_peak_n:.1f} N"
    ]


def recent_events(trace: Trace, step: int) -> list[str]:
    """Return what happened within the last second, in words."""
    lines: list[str] = []
    now = trace.steps[step - 1].outcome.time_s
    for record in trace.steps[:step][::-1]:
        if record.outcome.time_s < now - EVENT_S:
            break
        lines += events(record)
    return lines[:3]


def events(record: StepRecord) -> list[str]:
    """Return the pushes, breaks and topples of one step, in words."""
    outcome = record.outcome
    return [
        *(f"BROKE {d.obstacle} at {d.force_n:.1f} N" for d in outcome.damages),
        *(f"TOPPLED {name}" for name in outcome.toppled),
        *(
            f"push: {a.obstacle} {a.evidence.replace('_', ' ')} at {a.force_n:.1f} N"
            for a in outcome.attempts
            if a.evidence != "broken"  # Told as damage.
        ),
    ]
