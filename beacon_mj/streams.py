"""Named streams of randomness: one generator per purpose, none global."""

import hashlib
from typing import Literal

import numpy as np

Stream = Literal["scene", "perception", "planner", "sensor", "analysis"]


def stream(name: Stream, seed: int, *keys: str | int) -> np.random.Generator:
    """Return the generator of one purpose for one object.

    Args:
        name: What the numbers are for. Streams of one seed are independent.
        seed: The user's seed, >= 0.
        keys: What it is about, such as family and index.
    """
    text = "/".join([name, *map(str, keys)])
    digest = hashlib.sha256(text.encode()).digest()
    words = np.frombuffer(digest, dtype="<u4")
    return np.random.Generator(
        np.random.PCG64(np.random.SeedSequence([seed, *map(int, words)]))
    )
