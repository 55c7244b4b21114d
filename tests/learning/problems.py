"""Small decision problems at doors, and every way in which nature may draw them."""

import itertools
import math

import numpy as np
from hypothesis import strategies as st

from beacon_mj.geometry import Array
from beacon_mj.learning import DoorPart, DoorProblem, DoorStage

SHAPES = ((1, 3), (2, 2), (3, 2), (2, 3))  #: Stages, doors; small enough for all trees.


class Atoms:
    """Every way in which nature may have drawn one part, with its probability."""

    def __init__(self, part: DoorPart) -> None:
        count = len(part.opens[0])
        rows, chances = [], []
        groups = {frozenset(s.doors) for s in part.stages}
        for weight, opens in zip(part.weights, part.opens, strict=True):
            drawn = []
            for row in itertools.product((False, True), repeat=count):
                chance = math.prod(
                    p if o else 1 - p for p, o in zip(opens, row, strict=True)
                )
                if chance > 0 and all(any(row[d] for d in g) for g in groups):
                    drawn.append((row, chance))
            total = math.fsum(c for _, c in drawn)
            rows += [row for row, _ in drawn]
            chances += [weight * c / total for _, c in drawn]
        self.opens, self.chance = np.array(rows), np.array(chances)


def times(draw: st.DrawFn, *shape: int) -> Array:
    seed = draw(st.integers(0, 2**32 - 1))
    return np.round(np.random.default_rng(seed).uniform(0.0, 9.0, shape), 3)


def stage(draw: st.DrawFn, doors: range) -> DoorStage:
    k = len(doors)
    between = times(draw, k, k)
    return DoorStage(
        doors=tuple(doors),
        enter_s=tuple(times(draw, k).tolist()),
        between_s=tuple(map(tuple, between.tolist())),
        cross_s=tuple(times(draw, k).tolist()),
    )


@st.composite
def kinds_problem(draw: st.DrawFn) -> DoorProblem:
    """Doors that follow their kind with probability rho, else are drawn anew."""
    stages, doors = draw(st.sampled_from(SHAPES))
    rho = draw(st.sampled_from((1.0, 0.9, 0.5, 0.0)))
    p = draw(st.sampled_from((0.5, 0.3)))
    bits = [w for w in itertools.product((0, 1), repeat=doors) if 0 < sum(w) < doors]
    bits = bits or [(1,) * doors]
    weights = [math.prod(p if b else 1 - p for b in w) for w in bits]
    kinds = [draw(st.permutations(range(doors))) for _ in range(stages)]
    opens = tuple(
        tuple(rho * w[k] + (1 - rho) * p for names in kinds for k in names)
        for w in bits
    )
    part = DoorPart(
        stages=tuple(
            stage(draw, range(b * doors, (b + 1) * doors)) for b in range(stages)
        ),
        weights=tuple(w / sum(weights) for w in weights),
        opens=opens,
    )
    return problem(draw, part)


@st.composite
def loads_problem(draw: st.DrawFn) -> DoorProblem:
    """Doors of several nominal forces, all wrong by one hidden factor."""
    stages, doors = draw(st.sampled_from(SHAPES))
    loads = np.linspace(0.4, 3.0, draw(st.integers(2, 5)))
    nominal = 10.0 + 6.0 * times(draw, stages * doors)
    nominal[::doors] = 15.0  # One door of each stage opens whatever the load.
    opens = tuple(tuple(float(f * load < 60.0) for f in nominal) for load in loads)
    part = DoorPart(
        stages=tuple(
            stage(draw, range(b * doors, (b + 1) * doors)) for b in range(stages)
        ),
        weights=tuple(np.full(len(loads), 1.0 / len(loads)).tolist()),
        opens=opens,
    )
    return problem(draw, part)


@st.composite
def days_problem(draw: st.DrawFn) -> DoorProblem:
    """The same doors on several days, each with a latent of its own."""
    days, doors = draw(st.sampled_from(SHAPES))
    sure = draw(st.booleans())
    bits = [w for w in itertools.product((0, 1), repeat=doors) if 0 < sum(w) < doors]
    if sure:
        opens = tuple(tuple(map(float, w)) for w in bits)
    else:
        opens = tuple(tuple(0.1 + 0.7 * b for b in w) for w in bits)
    part = DoorPart(
        stages=tuple(stage(draw, range(doors)) for _ in range(days)),
        weights=(1.0 / len(bits),) * len(bits),
        opens=opens,
    )
    return problem(draw, part)


def problem(draw: st.DrawFn, *parts: DoorPart) -> DoorProblem:
    fail, passed = times(draw, 2).tolist()
    return DoorProblem(parts=parts, fail_s=fail, pass_s=passed)


PROBLEMS = st.one_of(kinds_problem(), loads_problem(), days_problem())


def stage_of(
    doors: tuple[int, int],
    *,
    enter_s: tuple[float, float] = (1.0, 1.0),
    cross_s: tuple[float, float] = (0.0, 0.0),
) -> DoorStage:
    """A stage of two doors, 1 s apart."""
    return DoorStage(
        doors=doors,
        enter_s=enter_s,
        between_s=((0.0, 1.0), (1.0, 0.0)),
        cross_s=cross_s,
    )


#: Two stages, two kinds of which one opens.
TWO_KINDS = DoorProblem(
    parts=(
        DoorPart(
            stages=(stage_of((0, 1)), stage_of((2, 3))),
            weights=(0.5, 0.5),
            opens=((1.0, 0.0, 1.0, 0.0), (0.0, 1.0, 0.0, 1.0)),
        ),
    ),
    fail_s=2.0,
    pass_s=0.7,
)
