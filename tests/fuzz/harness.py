"""Running generated inputs: what each may cost, and what may come of it.

An input is refused with an error that the command line prints as one line, with status
2, or it is good and has to go all the way. Nothing takes more than `SECONDS` and
`MEGABYTES`. Whoever makes inputs gets a `Random`; its seed is the input's name.
"""

import contextlib
import os
import tempfile
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any, TypeVar

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from beacon_mj.errors import BeaconError
from beacon_mj.eval.runs.warm_up import compile_kernels, load_kernels

T = TypeVar("T")
CORPUS = Path(__file__).parent / "corpus"
#: Inputs of each kind in a long test, and in the short one that always runs.
INPUTS, QUICK = int(os.environ.get("FUZZ_INPUTS", "1000")), 10
SECONDS = 5.0  #: Processor time of what an input is given to.
MEGABYTES = 500.0  #: Memory beyond what the process had before.
#: What `beacon_mj.cli` prints as one line.
REFUSALS = (BeaconError, OSError, UnicodeError)


@dataclass(slots=True)
class Tally:
    """What came of all inputs of a kind; the most that one of them took."""

    inputs: int = 0
    refused: int = 0
    seconds: float = 0.0
    megabytes: float = 0.0
    failures: dict[str, int] = field(default_factory=dict)


TALLIES: dict[str, Tally] = {}


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of input.

    Attributes:
        name: Its name, that of its tally too.
        make: Returns an input.
        check: Fails if an input is neither refused nor good; gets the input and an
            empty folder to which the process has gone, and returns whether it was
            refused.
    """

    name: str
    make: Callable[[Random], Any]
    check: Callable[[Any, Path], bool]

    def run(self, each: Any) -> None:
        """Check an input in a folder of its own."""
        tally = TALLIES.setdefault(self.name, Tally())
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            with limits(tally):
                tally.refused += self.check(each, Path(folder))
        tally.inputs += 1

    def short(self) -> Callable[[], None]:
        """Return the test that always runs."""

        @settings(
            max_examples=QUICK, deadline=None, suppress_health_check=[*HealthCheck]
        )
        @given(st.randoms(use_true_random=True))
        def test(rng: Random) -> None:
            self.run(self.make(rng))

        return test

    def long(self) -> Callable[[], None]:
        """Return the test of `INPUTS` inputs, which are the same every time."""

        @pytest.mark.slow
        def test() -> None:
            compile_kernels()  # Not in the time of the first input that needs them.
            load_kernels()
            self.run_seeds(range(INPUTS))
            failures = TALLIES[self.name].failures
            assert not failures, f"seed by failure: {failures}"

        return test

    def run_seeds(self, seeds: range) -> None:
        """Check the inputs of some seeds, and note the first that fails in each way."""
        for seed in seeds:
            try:
                self.run(self.make(Random(seed)))
            except Exception as error:
                place = traceback.extract_tb(error.__traceback__)[-1]
                why = f"{Path(place.filename).name}:{place.lineno}: {error!r:.200}"
                TALLIES[self.name].failures.setdefault(why, seed)


@contextlib.contextmanager
def limits(tally: Tally) -> Iterator[None]:
    """Hold what happens within the block to the limits."""
    began, before = sum(os.times()[:4]), _memory(reset=True)
    yield
    seconds, megabytes = sum(os.times()[:4]) - began, _memory() - before
    tally.seconds = max(tally.seconds, seconds)
    tally.megabytes = max(tally.megabytes, megabytes)
    assert seconds <= SECONDS, f"{seconds:.1f} s"
    assert megabytes <= MEGABYTES, f"{megabytes:.0f} MB"


def _memory(reset: bool = False) -> float:
    """Return the most memory since the last reset [MB]; 0 where it is not told."""
    if not os.access("/proc/self/clear_refs", os.W_OK):
        return 0.0
    if reset:
        Path("/proc/self/clear_refs").write_text("5")
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(w for w in lines if w.startswith("VmHWM")).split()[1]) / 1000


def attempt(call: Callable[[], T]) -> T | None:
    """Return what a call gives, or None if it refuses its input, in words."""
    try:
        return call()
    except REFUSALS as error:
        words = str(error).strip()
    assert words
    return None


def kept(kind: str) -> list[Path]:
    """Return the inputs of a kind that once failed."""
    return sorted((CORPUS / kind).iterdir())
