"""Sampling of obstacles: shape, class, and material, from a family's ranges."""

import math
from dataclasses import dataclass

import numpy as np

from beacon_mj.constants import CLASSES, GRAVITY, InteractionClass
from beacon_mj.errors import GenerationError
from beacon_mj.scene import Obstacle, Perceived, Robot
from beacon_mj.scene.certificates import DOOR_FORCE_SHARE
from beacon_mj.scene.shapes import Capsule, Shape, Sphere
from beacon_mj.scene_gen.family import Family
from beacon_mj.scene_gen.prototypes import DECIMALS
from beacon_mj.scene_gen.rooms import Bounds, workspace_m

#: A free obstacle needs at least this share of the drive's limit to count as too heavy;
#: between `FEASIBLE` and this, whether it moves would hang on a per cent of friction.
TOO_HEAVY = 1.15
FEASIBLE = 0.95
_TRIES = 1000


class NoMaterialError(GenerationError):
    """No density and friction of the family's fit a shape that was drawn."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Sampler:
    """Draws obstacles of one family with one generator."""

    family: Family
    robot: Robot
    rng: np.random.Generator

    @property
    def workspace_m(self) -> Bounds:
        """West, south, east, north of the family's room [m]."""
        return workspace_m(self.family)

    def count(self, name: str) -> int:
        """Draw a whole number from the family's range `name`, ends included."""
        low, high = self.family.range(name)
        return int(self.rng.integers(round(low), round(high) + 1))

    def uniform(self, bounds: tuple[float, float]) -> float:
        """Draw a number from a range."""
        return float(self.rng.uniform(*bounds))

    def interaction(self) -> InteractionClass:
        """Draw an interaction class by the family's `class_mix`."""
        weights = np.array(self.family.numerics["class_mix"])
        return CLASSES[self.rng.choice(3, p=weights / weights.sum())]

    def shape(self, length_m: float | None = None, *, rollers: bool = True) -> Shape:
        """Draw a shape.

        Args:
            length_m: Longer side; drawn from the family's range if None.
            rollers: Whether balls and lying capsules may occur.
        """
        family, rng = self.family, self.rng
        choices = [
            p
            for p in family.prototypes
            if rollers or not isinstance(p.nominal, Sphere | Capsule)
        ]
        if not choices:
            raise GenerationError(
                f"{family.source}: expected at least one obstacle that does not roll."
            )
        prototype = choices[rng.integers(len(choices))]
        own = self.uniform(family.shape_range(prototype.name, "size"))
        length = (
            own
            if length_m is None or isinstance(prototype.nominal, Sphere)
            else length_m
        )
        width = length * self.uniform(family.range("aspect"))
        height = self.uniform(family.shape_range(prototype.name, "height"))
        return prototype.scaled(length, width, height)

    def material(
        self, shape: Shape, interaction: InteractionClass, fixed: bool
    ) -> tuple[float, float]:
        """Draw density [kg/m^3] and friction that fit the class.

        Free safe obstacles are too heavy to push, fragile ones light enough; movable
        ones are what the family's ranges make of them, but never within a hair of the
        drive's limit.
        """
        limit = self.robot.force_max_n
        for _ in range(_TRIES):
            density, friction = self._draw(interaction)
            force = friction * density * shape.volume_m3 * GRAVITY
            if fixed or _fits(interaction, force / limit):
                return density, friction
        raise NoMaterialError(
            f"{self.family.source}: expected the ranges of {interaction} density and "
            f"friction to allow a force "
            f"{'above' if interaction == 'safe' else 'below'} {limit:g} N for a "
            f"volume of {shape.volume_m3:.4f} m^3 but {_TRIES} draws gave none."
        )

    def door_material(self, shape: Shape) -> tuple[float, float]:
        """Draw density and friction of a door: movable, with force to spare."""
        limit = DOOR_FORCE_SHARE * self.robot.force_max_n
        for _ in range(_TRIES):
            density, friction = self._draw("movable")
            if friction * density * shape.volume_m3 * GRAVITY <= limit:
                return density, friction
        raise NoMaterialError(
            f"{self.family.source}: expected the ranges of movable density and "
            f"friction to allow a door of {shape.volume_m3:.4f} m^3 below {limit:g} N."
        )

    def break_force(self, shape: Shape, density: float, friction: float) -> float:
        """Draw a break force [N], at least twice what a steady push needs."""
        least = 2.0 * friction * density * shape.volume_m3 * GRAVITY
        drawn = self.uniform(self.family.range("fragile_break_force"))
        return round(max(drawn, least), DECIMALS)

    def obstacle(
        self,
        shape: Shape,
        interaction: InteractionClass,
        *,
        fixed: bool | None = None,
        door: bool = False,
    ) -> Obstacle:
        """Return an obstacle at the origin, not yet named; see `placed`."""
        if fixed is None:
            fixed = interaction == "safe" and self._is_fixed(shape)
        density, friction = (
            self.door_material(shape)
            if door
            else self.material(shape, interaction, fixed)
        )
        fragile = interaction == "fragile"
        return Obstacle(
            id="unnamed",
            shape=shape,
            x_m=0.0,
            y_m=0.0,
            yaw_rad=0.0,
            interaction=interaction,
            fixed=fixed,
            density_kgm3=density,
            friction=friction,
            break_force_n=self.break_force(shape, density, friction)
            if fragile
            else None,
            perceived=Perceived(
                scores=(1.0, 1.0, 1.0), density_kgm3=density, friction=friction
            ),
        )

    def _is_fixed(self, shape: Shape) -> bool:
        """Draw whether a safe obstacle is welded; a small one always is."""
        drawn = self.rng.random() < self.family.value("safe_fixed_fraction")
        density = self.family.range("safe_density")[1]
        friction = self.family.range("safe_friction")[1]
        heaviest = density * friction * shape.volume_m3 * GRAVITY
        return bool(drawn) or heaviest < 1.3 * TOO_HEAVY * self.robot.force_max_n

    def yaw(self) -> float:
        """Draw a heading [rad]."""
        return round(self.uniform((-math.pi, math.pi)), DECIMALS)

    def _draw(self, interaction: InteractionClass) -> tuple[float, float]:
        density = self.uniform(self.family.range(f"{interaction}_density"))
        friction = self.uniform(self.family.range(f"{interaction}_friction"))
        return round(density, DECIMALS), round(friction, DECIMALS)


def _fits(interaction: InteractionClass, share: float) -> bool:
    """Whether a force, as a share of the drive's limit, fits the class."""
    if interaction == "safe":
        return share >= TOO_HEAVY
    if interaction == "fragile":
        return share <= FEASIBLE
    return share <= FEASIBLE or share >= TOO_HEAVY
