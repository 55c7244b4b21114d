"""The states of a logged episode, kept as what changed from step to step.

A log of a few kilobytes may describe many steps of many obstacles. What is kept here is
in proportion to the log; one state, or all, are put together when they are asked for.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from beacon_mj.errors import LogError
from beacon_mj.geometry import Array
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.robot_contract import robot_sizes
from beacon_mj.scene_gen.robots import RobotFile

KEYFRAME = 200  #: Steps after which a whole state is kept, so that seeking is quick.


def state_sizes(scene: Scene, robot: RobotFile) -> tuple[int, int]:
    """Return (nq, nv) of a scene's world: the robot's, and a free joint each."""
    free = len([o for o in scene.obstacles if not o.fixed])
    nq, nv = robot_sizes(robot)
    return nq + 7 * free, nv + 6 * free


class StateSequence:
    """States after each step, the start first; `sequence[k]` is one, (n,)."""

    def __init__(self, start: Iterable[float], size: int, path: Path) -> None:
        """Begin with the start. Raises LogError if it has not `size` numbers."""
        self._path = path
        state = np.fromiter(start, np.float64)
        if len(state) != size:
            raise LogError(
                f"{path}: expected states of {size} numbers, as its scene has them, "
                f"but the first has {len(state)}."
            )
        self._changes: list[tuple[NDArray[np.int64], Array]] = []
        self._keyframes = [state]
        self._last = state.copy()
        self._at, self._state = 0, state.copy()

    def append(self, index: Any, values: Any) -> None:
        """Add a state that differs from the last at places `index`, in order.

        Raises:
            LogError: If the places are not places of a state.
        """
        size = len(self._state)
        if len(index) != len(values) or len(index) > size:
            raise self._unfit(len(index), len(values))
        where = np.fromiter(index, np.int64, len(index))
        if len(where) and (where[-1] >= size or (np.diff(where) <= 0).any()):
            raise self._unfit(len(index), len(values))
        numbers = np.fromiter(values, np.float64, len(values))
        self._last[where] = numbers
        self._changes.append((where, numbers))
        if len(self._changes) % KEYFRAME == 0:
            self._keyframes.append(self._last.copy())

    def __len__(self) -> int:
        """Return the number of states, the start included."""
        return len(self._changes) + 1

    def __getitem__(self, step: int) -> Array:
        """Return the state after a step, a copy, (n,)."""
        if not -len(self) <= step < len(self):
            raise IndexError(step)
        step %= len(self)
        if not self._at <= step < self._at + KEYFRAME:
            self._at = step - step % KEYFRAME
            self._state = self._keyframes[step // KEYFRAME].copy()
        for where, values in self._changes[self._at : step]:
            self._state[where] = values
        self._at = step
        return self._state.copy()

    def array(self) -> Array:
        """Return all states, (steps + 1, n)."""
        out = np.empty((len(self), len(self._state)))
        out[0] = self._keyframes[0]
        for k, (where, values) in enumerate(self._changes):
            out[k + 1] = out[k]
            out[k + 1, where] = values
        return out

    def _unfit(self, places: int, values: int) -> LogError:
        return LogError(
            f"{self._path}: expected a state to change numbers it has, in order, but "
            f"it changes {places} places to {values} values."
        )
