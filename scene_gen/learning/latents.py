"""Latents: what doors have in common, and how worlds are dealt.

Worlds of equal weight are dealt in rounds: every world once, in an order that the seed
shuffles anew for each round. So the prior holds exactly in a run of whole rounds, and
the index of a scene tells nothing of its world.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from beacon_mj.errors import GenerationError, TemplateError
from beacon_mj.scene_gen.family import Family
from beacon_mj.scene_gen.learning.room import Door, Part
from beacon_mj.scene_gen.rooms import robot_of
from beacon_mj.scene_gen.sampling import FEASIBLE
from beacon_mj.streams import stream

#: A door that is too heavy needs at least this share of F_max: one that only just holds
#: is moved a little by a robot that rams it.
FAR_TOO_HEAVY = 1.3
PLACES = 12  #: Decimals of probabilities; what is rarer than that never happens.
_TRIES = 10_000


@dataclass(frozen=True, kw_only=True, slots=True)
class KindLatent:
    """Every label moves or not; a door follows its label with some reliability.

    Attributes:
        bits: Whether each label moves, by world, (w, k).
        weights: Prior weights, (w,).
        reliability: Probability that a door follows its label; else it is drawn anew.
        prior: Probability that a door that is drawn anew moves.
        error: Standard deviation of the logarithm of true over perceived force.
        limit_n: Largest true force of a door that moves.
    """

    bits: tuple[tuple[int, ...], ...]
    weights: tuple[float, ...]
    reliability: float
    prior: float
    error: float
    limit_n: float
    welded: bool = True
    scores: tuple[float, float, float] | None = None
    scale_error: float = 0.0

    def chance(self, world: int, door: Door) -> float:
        """Return the probability that a door opens, given the world."""
        follows = self.reliability * self.bits[world][door.label]
        return round(follows + (1.0 - self.reliability) * self.prior, PLACES)

    def force_n(
        self, world: int, door: Door, opens: bool, rng: np.random.Generator
    ) -> float:
        """Draw the true force; that of a welded door is what it would be."""
        return _drawn(
            lambda: door.nominal_n * math.exp(self.error * rng.standard_normal()),
            lambda force: force <= self.limit_n,
            f"a door of {door.nominal_n:.1f} N to need at most {self.limit_n:g} N",
        )


def kind_latent(
    family: Family, labels: int, *, reliability: float | None = None
) -> KindLatent:
    """Return the latent of `labels` kinds, of which not all are alike."""
    prior = family.value("kind_prior")
    limit = FEASIBLE * robot_of(family).force_max_n
    heaviest = family.range("door_force")[1]
    if heaviest > limit:
        raise TemplateError(
            f"{family.source}: expected numeric 'door_force' to be at most {limit:g} "
            f"N, which the robot can push, but it was up to {heaviest:g}."
        )
    bits = [
        b for b in itertools.product((0, 1), repeat=labels) if 0 < b.count(1) < labels
    ]
    weights = [math.prod(prior if v else 1.0 - prior for v in b) for b in bits]
    total = math.fsum(weights)
    given = family.value("kind_reliability") if reliability is None else reliability
    return KindLatent(
        bits=tuple(bits),
        weights=tuple(w / total for w in weights),
        reliability=given,
        prior=prior,
        error=family.value("door_force_error"),
        limit_n=limit,
    )


@dataclass(frozen=True, kw_only=True, slots=True)
class LoadLatent:
    """One factor between the perceived and the true forces of all doors.

    Attributes:
        loads: The factor, by world, (w,).
        error: Standard deviation of the logarithm of a door's own error.
        force_max_n: What the robot's drive can apply [N].
        scores: Perceived class scores of every door.
    """

    loads: tuple[float, ...]
    error: float
    force_max_n: float
    scores: tuple[float, float, float]
    welded: bool = False

    @property
    def weights(self) -> tuple[float, ...]:
        """Prior weights, all alike, (w,)."""
        return (1.0 / len(self.loads),) * len(self.loads)

    @property
    def scale_error(self) -> float:
        """Standard deviation of the logarithm of the load, over the worlds."""
        logs = [math.log(load) for load in self.loads]
        mean = math.fsum(logs) / len(logs)
        square = math.fsum((each - mean) * (each - mean) for each in logs) / len(logs)
        return math.sqrt(square)

    def chance(self, world: int, door: Door) -> float:
        """Return the probability that a door opens, given the load.

        Of forces F = load * nominal * exp(error z), z normal, those between 0.95 and
        1.3 F_max do not occur.
        """
        usual = math.log(self.loads[world] * door.nominal_n / self.force_max_n)
        light = _below(math.log(FEASIBLE) - usual, self.error)
        heavy = _below(usual - math.log(FAR_TOO_HEAVY), self.error)
        if light + heavy <= 0.0:
            raise GenerationError(
                "Expected doors that are clearly light or clearly too heavy but one of "
                f"{door.nominal_n:.1f} N under load {self.loads[world]:.2f} is neither."
            )
        return round(light / (light + heavy), PLACES)

    def force_n(
        self, world: int, door: Door, opens: bool, rng: np.random.Generator
    ) -> float:
        """Draw the true force."""
        usual = self.loads[world] * door.nominal_n
        limit = self.force_max_n
        return _drawn(
            lambda: usual * math.exp(self.error * rng.standard_normal()),
            lambda f: f <= FEASIBLE * limit if opens else f >= FAR_TOO_HEAVY * limit,
            f"a door of {usual:.1f} N to be clearly light or clearly too heavy",
        )


def load_latent(family: Family) -> LoadLatent:
    """Return the latent of a load that is empty or full, each in several levels."""
    levels = family.whole("load_levels")
    loads = []
    for name in ("load_empty", "load_full"):
        low, high = family.range(name)
        loads += [low + (high - low) * (k + 0.5) / levels for k in range(levels)]
    safe, movable, fragile = family.numerics["door_scores"]
    return LoadLatent(
        loads=tuple(loads),
        error=family.value("door_force_error"),
        force_max_n=robot_of(family).force_max_n,
        scores=(safe, movable, fragile),
    )


def dealt_in_rounds(part: Part) -> bool:
    """Whether the worlds of a part are equally probable, and dealt in rounds."""
    weights = part.latent.weights
    return max(weights) - min(weights) <= 1e-12


def deal(part: Part, family: str, seed: int, number: int) -> int:
    """Return the world of a part in the scene, or mission, of that number."""
    weights = part.latent.weights
    if not dealt_in_rounds(part):
        rng = stream("scene", seed, family, "world", part.key, number)
        return int(rng.choice(len(weights), p=weights))
    turn, place = divmod(number, len(weights))
    rng = stream("scene", seed, family, "round", part.key, turn)
    return int(rng.permutation(len(weights))[place])


def draw_outcomes(part: Part, world: int, rng: np.random.Generator) -> dict[str, bool]:
    """Draw which doors of a part open; in every stage at least one does."""
    outcomes: dict[str, bool] = {}
    for stage in part.stages:
        if stage.doors[0].id in outcomes:  # The same doors on another day.
            continue
        chances = np.array([part.latent.chance(world, d) for d in stage.doors])
        opens = rng.random(len(chances)) < chances
        while not opens.any():
            opens = rng.random(len(chances)) < chances
        outcomes |= {d.id: bool(o) for d, o in zip(stage.doors, opens, strict=True)}
    return outcomes


def _drawn(
    draw: Callable[[], float], fits: Callable[[float], bool], expected: str
) -> float:
    for _ in range(_TRIES):
        value = draw()
        if fits(value):
            return value
    raise GenerationError(f"Expected {expected} but no draw did.")


def _below(distance: float, spread: float) -> float:
    """Return the probability that a normal error of that spread is below a distance."""
    if spread == 0.0:
        return float(distance >= 0.0)
    return 0.5 * math.erfc(-distance / (spread * math.sqrt(2.0)))
