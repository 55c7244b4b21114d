"""How a run tells its caller what is done; the caller decides how it is shown."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager

from beacon_mj.eval.metrics.row import Row

#: Told first of the rows that were there before, then of new ones as they come.
Update = Callable[[Sequence[Row]], None]
#: Opens the progress of a part of a run, by its name (empty for the whole) and its
#: number of episodes; it is open while the part runs.
Progress = Callable[[str, int], AbstractContextManager[Update]]


@contextmanager
def quiet(name: str, total: int) -> Iterator[Update]:
    """Show no progress."""
    yield lambda rows: None
