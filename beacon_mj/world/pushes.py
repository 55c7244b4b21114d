"""Push attempts: when one begins, and the single piece of evidence that it leaves.

An attempt on an obstacle begins when the robot's filtered force on it exceeds
`CONTACT_N` while the commanded velocity points into it. It ends with `moved` when the
obstacle's origin has travelled `MOVED_M`, with `not_moved` when the force has stayed
above `SATURATION` of the drive's limit for `SATURATED_S` without that, with `broken`
when it breaks, and with nothing when contact is lost first. After evidence, contact
must be lost before another attempt on the same obstacle can begin.

The force of `moved` is the largest filtered force until the obstacle slipped: an upper
bound on its breakaway force, 1.1 to 1.8 times mu m g depending on the speed of touch.
What comes after it is inertia. The force of `not_moved` is what it held in the end.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from beacon_mj.constants import CONTACT_N, MOVED_M
from beacon_mj.geometry import Array
from beacon_mj.interface import Evidence
from beacon_mj.jit import kernel
from beacon_mj.world.contacts import FILTERED, FX, FY

SLIP_M = 0.0002  #: Travel up to which the force is still that of breaking away [m].
SATURATION = 0.9  #: Share of the drive's limit that counts as pushing with all force.
SATURATED_S = 0.3  #: Time at saturation after which the obstacle did not move [s].
LOST_S = 0.1  #: Time without contact after which an attempt is over [s].

# Phases of an obstacle.
IDLE, TRYING, CONCLUDED = 0, 1, 2
# Columns of the attempt table.
PHASE, START_X, START_Y, LOST, SATURATED, LARGEST, RESULT, WHEN, BEGAN = range(9)
COLUMNS = 9
_RESULTS: dict[int, Evidence] = {1: "moved", 2: "not_moved", 3: "broken"}


@dataclass(frozen=True, slots=True)
class AttemptEnd:
    """One attempt that left evidence.

    Attributes:
        obstacle: Obstacle id.
        evidence: How it ended.
        force_n: The force that this is evidence of [N]; see the module.
        began_s: When it began, simulation time [s].
        ended_s: When its evidence was complete [s].
    """

    obstacle: str
    evidence: Evidence
    force_n: float
    began_s: float
    ended_s: float


class PushMonitor:
    """Watches the push attempts of one episode."""

    def __init__(self, obstacles: Sequence[str], force_max_n: float) -> None:
        """Watch obstacles by id, pushed with at most `force_max_n` [N]."""
        self.table = np.zeros((len(obstacles), COLUMNS))
        self._ids = tuple(obstacles)
        self.force_max_n = force_max_n

    def reset(self) -> None:
        """Forget all attempts."""
        self.table[:] = 0.0

    @property
    def active(self) -> bool:
        """Whether any obstacle is not idle."""
        return bool(np.count_nonzero(self.table[:, PHASE]))

    def broke(self, index: int, time_s: float, force_n: float) -> None:
        """Note that an obstacle broke: evidence, whether or not it was pushed."""
        row = self.table[index]
        if row[PHASE] != TRYING:
            row[BEGAN] = time_s
        row[[PHASE, RESULT, WHEN, LOST]] = CONCLUDED, 3.0, time_s, 0.0
        row[LARGEST] = max(row[LARGEST], force_n)

    def collect(self) -> tuple[AttemptEnd, ...]:
        """Return the attempts that ended with evidence since the last call."""
        if not np.count_nonzero(self.table[:, RESULT]):
            return ()
        ended = np.flatnonzero(self.table[:, RESULT])
        ends = tuple(self._end(int(i)) for i in ended)
        self.table[ended, RESULT] = 0.0
        return ends

    def _end(self, i: int) -> AttemptEnd:
        row = self.table[i]
        return AttemptEnd(
            self._ids[i], _RESULTS[int(row[RESULT])], float(row[LARGEST]),
            float(row[BEGAN]), float(row[WHEN]),
        )  # fmt: skip


@kernel
def update_attempts(
    table: Array,
    ids: NDArray[np.int64],
    values: Array,
    count: int,
    qpos: Array,
    position_address: NDArray[np.int64],
    command: Array,
    force_max_n: float,
    time_s: float,
    timestep_s: float,
) -> None:
    """Advance every obstacle's attempt by one physics step.

    Args:
        table: The attempt table, shape (n, COLUMNS); updated.
        ids: See `PairTable`.
        values: See `PairTable`.
        count: Number of pairs in use.
        qpos: Generalised positions of the model.
        position_address: Where each obstacle's x and y stand in `qpos`, -1 if fixed.
        command: Commanded velocity, shape (2,) [m/s].
        force_max_n: Limit of the drive [N].
        time_s: Simulation time [s].
        timestep_s: Physics step [s].
    """
    n = table.shape[0]
    for i in range(n):
        if table[i, PHASE] != IDLE:
            table[i, LOST] += timestep_s
    for k in range(count):
        i = ids[k, 0]
        if ids[k, 1] != n or values[k, FILTERED] <= CONTACT_N:
            continue
        table[i, LOST] = 0.0
        into = values[k, FX] * command[0] + values[k, FY] * command[1] > 0.0
        if table[i, PHASE] == IDLE and into:
            _begin(table[i], qpos, position_address[i], time_s)
        if table[i, PHASE] == TRYING:
            _advance(
                table[i], values[k, FILTERED], qpos, position_address[i],
                SATURATION * force_max_n, time_s, timestep_s,
            )  # fmt: skip
    for i in range(n):
        if table[i, PHASE] != IDLE and table[i, LOST] > LOST_S:
            table[i, PHASE] = IDLE


@kernel
def _begin(row: Array, qpos: Array, address: int, time_s: float) -> None:
    row[PHASE] = TRYING
    row[BEGAN] = time_s
    row[SATURATED] = 0.0
    row[LARGEST] = 0.0
    if address >= 0:
        row[START_X], row[START_Y] = qpos[address], qpos[address + 1]


@kernel
def _advance(
    row: Array,
    force_n: float,
    qpos: Array,
    address: int,
    saturation_n: float,
    time_s: float,
    timestep_s: float,
) -> None:
    row[SATURATED] = row[SATURATED] + timestep_s if force_n > saturation_n else 0.0
    travel2 = 0.0
    if address >= 0:
        dx, dy = qpos[address] - row[START_X], qpos[address + 1] - row[START_Y]
        travel2 = dx * dx + dy * dy
    if travel2 < SLIP_M * SLIP_M:
        row[LARGEST] = max(row[LARGEST], force_n)
    result = 0.0
    if travel2 >= MOVED_M * MOVED_M:
        result = 1.0
    elif row[SATURATED] >= SATURATED_S:
        result = 2.0
        row[LARGEST] = force_n
    if result > 0.0:
        row[PHASE], row[RESULT], row[WHEN] = CONCLUDED, result, time_s
