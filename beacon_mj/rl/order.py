"""Which scene comes next."""

from collections.abc import Iterator, Sequence
from itertools import chain, count, repeat

from beacon_mj.errors import RunError
from beacon_mj.eval.runs.whole_numbers import check_whole_numbers


class SceneOrder:
    """The indices of the scenes of one seed, one after the other.

    Attributes:
        seed: The seed of scenes, perception, and the planner's own stream.
    """

    def __init__(self, indices: Sequence[int] | None, seed: int) -> None:
        """Begin at the first one.

        Args:
            indices: Indices in their order, over and over; None for 0, 1, 2, ...
            seed: The seed.

        Raises:
            RunError: If an index or the seed is no whole number from 0.
        """
        self._indices = None if indices is None else tuple(map(int, indices))
        if self._indices == () or any(i < 0 for i in self._indices or ()):
            raise RunError(
                "Expected indices of at least one scene, whole numbers from 0, but "
                f"they were {indices}."
            )
        self.restart(seed)

    def restart(self, seed: int) -> None:
        """Begin again at the first scene, of that seed."""
        check_whole_numbers(seed=seed)
        self.seed = seed
        self._left = self._all()

    def next(self) -> int:
        """Return the index of the next scene."""
        return next(self._left)

    def _all(self) -> Iterator[int]:
        if self._indices is None:
            return count()
        return chain.from_iterable(repeat(self._indices))
