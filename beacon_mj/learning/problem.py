"""Rooms with doors as a decision problem: stages, travel times, and a prior.

A robot crosses stages one after another. A stage has an entry, doors, and an exit where
the next stage begins, so stages are tied together by what was learned and by nothing
else. In a stage the robot goes to a door and pushes. Either the door opens: the robot
goes through to the exit. Or it does not: the robot loses `fail_s`, stands before the
door, and tries another one. This is a Canadian traveller problem with remote edges
removed (Papadimitriou and Yannakakis 1991; Eyerich, Keller, Helmert 2010).

Whether a door opens is drawn once: first a world, with its prior weight; then, given
the world, every door on its own with the probability `opens[world][door]`; and in every
stage at least one door opens. What was tried is known for good. Two stages may have the
same doors (a room that is crossed again), else they have none in common.

Shapes: w worlds, n doors of a part, k doors of a stage.
"""

import math
from dataclasses import dataclass
from itertools import combinations

from beacon_mj.errors import SceneError

Times = tuple[float, ...]


@dataclass(frozen=True, kw_only=True, slots=True)
class DoorStage:
    """One stage; times are those of driving, without pushing.

    Attributes:
        doors: Numbers of its doors in the part, (k,).
        enter_s: From the stage's entry to the place before each door, (k,) [s].
        between_s: From the place before one door to that before another, (k, k) [s].
        cross_s: From the place before each door, through it, to the exit, (k,) [s].
    """

    doors: tuple[int, ...]
    enter_s: Times
    between_s: tuple[Times, ...]
    cross_s: Times

    def __post_init__(self) -> None:
        """Check the shapes."""
        k = len(self.doors)
        rows = [self.enter_s, self.cross_s, *self.between_s]
        if k == 0 or len(self.between_s) != k or any(len(row) != k for row in rows):
            raise SceneError(
                f"Expected a stage of {k} doors to have {k} times to enter and to "
                f"cross and {k} x {k} between its doors but it had {len(self.enter_s)},"
                f" {len(self.cross_s)} and {[len(row) for row in self.between_s]}."
            )
        if any(t < 0.0 or not math.isfinite(t) for row in rows for t in row):
            raise SceneError("Expected times of a stage to be finite and not negative.")


@dataclass(frozen=True, kw_only=True, slots=True)
class DoorPart:
    """Stages that share one latent.

    Attributes:
        stages: In the order in which they are crossed.
        weights: Prior weight of each world, (w,), with sum 1.
        opens: Probability that a door opens, given the world, (w, n).
    """

    stages: tuple[DoorStage, ...]
    weights: tuple[float, ...]
    opens: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        """Check that the numbers are a prior, and that no stage can be a dead end."""
        if len(self.weights) != len(self.opens) or not self.weights:
            raise SceneError(
                f"Expected one weight per world but there were {len(self.weights)} for "
                f"{len(self.opens)}."
            )
        if min(self.weights) <= 0.0 or abs(math.fsum(self.weights) - 1.0) > 1e-9:
            raise SceneError(
                f"Expected positive weights with sum 1 but they were {self.weights}."
            )
        if any(not 0.0 <= p <= 1.0 for row in self.opens for p in row):
            raise SceneError("Expected probabilities of opening in [0, 1].")
        doors = 1 + max((d for s in self.stages for d in s.doors), default=-1)
        if any(len(row) < doors for row in self.opens):
            raise SceneError(
                f"Expected probabilities of opening of {doors} doors in every world "
                f"but there were {[len(row) for row in self.opens]}."
            )
        for a, b in combinations({frozenset(s.doors) for s in self.stages}, 2):
            if a & b:
                raise SceneError(
                    "Expected two stages to have all doors in common or none but they "
                    f"share {sorted(a & b)} of {sorted(a | b)}."
                )
        for stage in self.stages:
            if any(max(row[d] for d in stage.doors) <= 0.0 for row in self.opens):
                raise SceneError(
                    f"Expected a door of {stage.doors} that may open in every world."
                )


@dataclass(frozen=True, kw_only=True, slots=True)
class DoorProblem:
    """A scene, or a mission, as parts that have independent latents.

    Attributes:
        parts: What is learned in one says nothing about another.
        fail_s: Time lost by a push that fails [s].
        pass_s: Time lost, beyond driving, by a push that works [s].
    """

    parts: tuple[DoorPart, ...]
    fail_s: float
    pass_s: float
