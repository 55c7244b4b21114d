"""Names and numbers that several packages share."""

from collections.abc import Mapping
from typing import Literal

InteractionClass = Literal["safe", "movable", "fragile"]
#: Interaction classes of the paper (III.B), in the order of every probability vector.
CLASSES: tuple[InteractionClass, ...] = ("safe", "movable", "fragile")
#: Version of rows and run folders: raised when a column changes its name or its
#: meaning. Those of version 0.1 carry none.
SCHEMA = 2
#: Version of logs: raised when a topic or a field changes. Those of 0.1 carry none.
LOG_SCHEMA = 3
#: The columns of a row that no two runs need share.
WALL_CLOCK_COLUMNS = frozenset({"plan_ms_p50", "plan_ms_p99", "wall_time_s"})
#: Least and largest whole numbers that options, calls and run folders may hold.
WHOLE_NUMBERS: Mapping[str, tuple[int, int]] = {
    "seed": (0, 2**53),
    "scenes_per_family": (1, 10**6),
    "workers": (1, 4096),
    "trials": (0, 10**5),
}
MAX_OBSTACLES = 2500  #: Of a scene.
GRAVITY = 9.81  #: Gravitational acceleration [m/s^2].
CONTACT_N = 1.0  #: Filtered force above which bumper and obstacle are in contact [N].
MOVED_M = 0.010  #: Travel above which an obstacle counts as moved [m].

#: The perceived kind of inner walls, which never give way.
WALL_KIND = "wall"
