"""What happened, in words: the messages of `/log`."""

from collections.abc import Iterator
from typing import Any, Literal

from beacon_mj.episode.trace import StepRecord, Trace
from beacon_mj.interface import PlannerInfo
from beacon_mj.recording.drawing import stamp
from beacon_mj.recording.messages import message

Level = Literal["DEBUG", "INFO", "WARNING", "ERROR"]


def replanned(info: PlannerInfo, time_ns: int) -> Any:
    """Return that the path was planned anew."""
    text = f"replan: {info.expansions} expansions"
    if info.reason:
        text += f"; {info.reason}"
    return _event(time_ns, "INFO", "planner", text)


def of_step(record: StepRecord, time_ns: int) -> Iterator[Any]:
    """Yield the events of one control step."""
    outcome = record.outcome
    for name in record.newly_sensed:
        yield _event(time_ns, "DEBUG", "sensor", f"first sight of {name}")
    for attempt in outcome.attempts:
        stalled = attempt.evidence == "not_moved"
        yield _event(
            time_ns,
            "WARNING" if stalled else "INFO",
            "push",
            f"{'stall' if stalled else 'push'}: {attempt.obstacle} {attempt.evidence} "
            f"at {attempt.force_n:.1f} N",
        )
    for damage in outcome.damages:
        text = f"break: {damage.obstacle} by {damage.counterpart}"
        yield _event(time_ns, "ERROR", "damage", f"{text} at {damage.force_n:.1f} N")
    for name in outcome.toppled:
        yield _event(time_ns, "WARNING", "world", f"topple: {name}")


def ended(trace: Trace, time_ns: int) -> Any:
    """Return how the episode ended."""
    level: Level = "INFO" if trace.outcome == "reached" else "WARNING"
    text = f"end: {trace.outcome} after {len(trace.steps)} steps"
    if trace.detail:
        text += f"; {trace.detail}"
    return _event(time_ns, level, "episode", text)


def _event(time_ns: int, level: Level, name: str, text: str) -> Any:
    out = message("foxglove.Log")(message=text, name=name, level=level)
    stamp(out.timestamp, time_ns)
    return out
