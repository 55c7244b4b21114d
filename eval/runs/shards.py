"""Parts of a run: every n-th scene or mission, so that each family is in all."""

import re
from collections.abc import Sequence
from typing import Annotated, NamedTuple, TypeVar

from msgspec import Meta

from beacon_mj.errors import RunError

T = TypeVar("T")
MOST = 10**6  #: Shards of one run.


class Shard(NamedTuple):
    """Part `number` of `of`, counted from 1."""

    number: Annotated[int, Meta(ge=1, le=MOST)]
    of: Annotated[int, Meta(ge=1, le=MOST)]

    def __str__(self) -> str:
        """Return the form that `--shard` reads, such as `3/8`."""
        return f"{self.number}/{self.of}"


def parse_shard(text: str) -> Shard:
    """Return the shard that `text`, such as `3/8`, stands for.

    Raises:
        RunError: If it is none.
    """
    found = re.fullmatch(r"([0-9]{1,7})/([0-9]{1,7})", text)
    shard = Shard(*map(int, found.groups())) if found else Shard(0, 0)
    if not 1 <= shard.number <= shard.of <= MOST:
        raise RunError(
            f"--shard {text}: expected I/N with 1 <= I <= N <= {MOST}, such as 3/8."
        )
    return shard


def share(items: Sequence[T], shard: Shard | None) -> list[T]:
    """Return the items number, number + of, number + 2 of, ...; all of them for None.

    The shares of 1/n to n/n are disjoint and together are the items.

    Raises:
        RunError: If there are fewer items than shards.
    """
    if shard is None:
        return list(items)
    if len(items) < shard.of:
        raise RunError(
            f"--shard {shard}: expected at most as many shards as scenes (or "
            f"missions) but there are {len(items)}."
        )
    return list(items[shard.number - 1 :: shard.of])
