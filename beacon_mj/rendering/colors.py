"""Which colour an obstacle has at one step of a log.

The planner's class belief mixes the classes' colours. What has not been sensed yet is
pale, what broke is dark.
"""

from collections.abc import Iterator

import numpy as np

from beacon_mj.constants import CLASSES
from beacon_mj.episode.trace import StepRecord, Trace
from beacon_mj.geometry import Array
from beacon_mj.recording.drawing import BROKEN_RGBA

PALE = 0.6  #: Share of white in the colour of an obstacle not sensed yet.
UNKNOWN = 0.6  #: Grey level of an obstacle that a planner's belief leaves out.


class Paint:
    """Colours of the obstacles of one trace."""

    def __init__(self, trace: Trace) -> None:
        """Go through the trace once."""
        self._trace = trace
        self._names = [o.id for o in trace.scene.obstacles]
        self._classes = np.array([s.rgba[:3] for s in trace.scene.surfaces])
        self._history = list(self._sensed_and_broken())

    def decision(self, step: int) -> StepRecord | None:
        """Return the record whose decision is in force after `step`: the next one."""
        steps = self._trace.steps
        return steps[min(step, len(steps) - 1)] if steps else None

    def true_colour(self, i: int) -> Array:
        """Return the colour of an obstacle's true class, shape (3,)."""
        kind = self._trace.scene.obstacles[i].interaction
        return np.asarray(self._classes[CLASSES.index(kind)])

    def colours(self, step: int) -> Array:
        """Return the colour of each obstacle after `step`, shape (n, 3), 0 to 1."""
        sensed, broken = self._history[step]
        record = self.decision(step)
        beliefs = {} if record is None else record.command.info.beliefs
        out = np.empty((len(self._names), 3))
        for i, name in enumerate(self._names):
            truth = self.true_colour(i)
            if name in broken:
                out[i] = BROKEN_RGBA[:3]
            elif name in beliefs:
                out[i] = np.asarray(beliefs[name]) @ self._classes
            elif name in sensed:
                out[i] = truth if not beliefs else UNKNOWN
            else:
                out[i] = (1.0 - PALE) * truth + PALE
        return out

    def broken(self, step: int) -> list[int]:
        """Return the indices of the obstacles that are broken after `step`."""
        broken = self._history[step][1]
        return [i for i, name in enumerate(self._names) if name in broken]

    def _sensed_and_broken(self) -> Iterator[tuple[frozenset[str], frozenset[str]]]:
        """Yield what had been sensed and broken at the start and after each step."""
        left = self._trace.left
        sensed = set(self._trace.first_sensed)
        broken = set[str]() if left is None else set(left.broken)
        yield frozenset(sensed), frozenset(broken)
        for step in self._trace.steps:
            sensed |= set(step.newly_sensed)
            broken |= {d.obstacle for d in step.outcome.damages}
            yield frozenset(sensed), frozenset(broken)
