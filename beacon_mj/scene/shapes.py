"""The solid shapes that an obstacle can have.

Each shape stands on the floor in its own frame: origin at the footprint's centroid,
z up from the centre of its height. Lengths in [m], volumes in [m^3].
"""

import math
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from beacon_mj.geometry import (
    Array,
    Footprint,
    convex_hull,
    polygon_area,
)
from beacon_mj.numerics import angles_of, rotated_3d, unit_vectors

Length = Annotated[float, Meta(ge=0.001, le=10.0)]
Coordinate = Annotated[float, Meta(ge=-100.0, le=100.0)]
PrismKind = Literal["triangle", "trapezoid", "parallelogram", "pentagon", "hexagon"]

#: Facets that stand for a cylinder's rim once it has tipped over.
RIM_FACETS = 24


class _Shape(
    msgspec.Struct,
    frozen=True,
    kw_only=True,
    forbid_unknown_fields=True,
    tag=str.lower,
    dict=True,
):
    """Base of all shapes; `type` in JSON is the class name in lower case."""


class Sphere(_Shape, frozen=True, kw_only=True):
    """A ball; it rolls."""

    radius_m: Length

    @property
    def height_m(self) -> float:
        """Height above the floor [m]."""
        return 2.0 * self.radius_m

    @property
    def volume_m3(self) -> float:
        """Volume [m^3]."""
        return 4.0 / 3.0 * math.pi * (self.radius_m * self.radius_m * self.radius_m)

    def core(self) -> tuple[Array, float]:
        """Return 3-D core points (k, 3) and rounding radius [m]."""
        return np.zeros((1, 3)), self.radius_m


class Box(_Shape, frozen=True, kw_only=True):
    """A box; its footprint is the rectangle."""

    length_m: Length
    width_m: Length
    height_m: Length

    @property
    def volume_m3(self) -> float:
        """Volume [m^3]."""
        return self.length_m * self.width_m * self.height_m

    def core(self) -> tuple[Array, float]:
        """Return 3-D core points (k, 3) and rounding radius [m]."""
        x, y = 0.5 * self.length_m, 0.5 * self.width_m
        return _extrude(np.array([(-x, -y), (x, -y), (x, y), (-x, y)]), self.height_m)


class Cylinder(_Shape, frozen=True, kw_only=True):
    """An upright cylinder; its footprint is the circle."""

    radius_m: Length
    height_m: Length

    @property
    def volume_m3(self) -> float:
        """Volume [m^3]."""
        return math.pi * (self.radius_m * self.radius_m) * self.height_m

    def core(self) -> tuple[Array, float]:
        """Return 3-D core points (k, 3) and rounding radius [m], rim as facets."""
        angle = np.arange(RIM_FACETS) * (2.0 * math.pi / RIM_FACETS)
        rim = self.radius_m * unit_vectors(angle)
        return _extrude(rim, self.height_m)


class Capsule(_Shape, frozen=True, kw_only=True):
    """A capsule lying along its x axis; it rolls sideways. Length is tip to tip."""

    radius_m: Length
    length_m: Length

    @property
    def height_m(self) -> float:
        """Height above the floor [m]."""
        return 2.0 * self.radius_m

    @property
    def half_axis_m(self) -> float:
        """Half the length of the straight part [m]."""
        return 0.5 * self.length_m - self.radius_m

    @property
    def volume_m3(self) -> float:
        """Volume [m^3]."""
        straight = 2.0 * self.half_axis_m
        disc = math.pi * (self.radius_m * self.radius_m)
        return disc * (4.0 / 3.0 * self.radius_m + straight)

    def core(self) -> tuple[Array, float]:
        """Return 3-D core points (k, 3) and rounding radius [m]."""
        half = self.half_axis_m
        return np.array([(-half, 0.0, 0.0), (half, 0.0, 0.0)]), self.radius_m


class Prism(_Shape, frozen=True, kw_only=True):
    """An upright prism over a convex polygon with its centroid at the origin."""

    kind: PrismKind
    vertices_m: Annotated[
        tuple[tuple[Coordinate, Coordinate], ...], Meta(min_length=3, max_length=16)
    ]
    height_m: Length

    @property
    def volume_m3(self) -> float:
        """Volume [m^3]."""
        return polygon_area(np.array(self.vertices_m)) * self.height_m

    def core(self) -> tuple[Array, float]:
        """Return 3-D core points (k, 3) and rounding radius [m]."""
        return _extrude(np.array(self.vertices_m), self.height_m)


class Hulls(_Shape, frozen=True, kw_only=True):
    """A body made of convex parts, each given by its vertices.

    This is what an obstacle authored as an MJCF file becomes. The volume, from which
    mass follows, is measured once when the template is read.
    """

    name: str
    parts_m: Annotated[
        tuple[
            Annotated[
                tuple[tuple[Coordinate, Coordinate, Coordinate], ...],
                Meta(min_length=4, max_length=256),
            ],
            ...,
        ],
        Meta(min_length=1, max_length=32),
    ]
    volume_m3: Annotated[float, Meta(gt=0.0)]

    @property
    def height_m(self) -> float:
        """Height above the floor [m]."""
        return float(np.ptp(self.core()[0][:, 2]))

    def core(self) -> tuple[Array, float]:
        """Return 3-D core points (k, 3) and rounding radius [m]."""
        return np.concatenate([np.array(part) for part in self.parts_m]), 0.0


Shape = Sphere | Box | Cylinder | Capsule | Prism | Hulls


def name_of(shape: Shape) -> str:
    """Return the shape's everyday name: `box`, `pentagon`, `chair`."""
    if isinstance(shape, Prism):
        return shape.kind
    if isinstance(shape, Hulls):
        return shape.name
    return type(shape).__name__.lower()


def footprint(shape: Shape) -> Footprint:
    """Return the outline on the floor of an upright shape, in its own frame.

    A shape keeps it: an obstacle is tried in many places, and looked at many times.
    """
    known: Footprint | None = shape.__dict__.get("footprint")
    if known is None:
        known = shape.__dict__["footprint"] = _footprint(shape)
    return known


def _footprint(shape: Shape) -> Footprint:
    if isinstance(shape, Cylinder):
        return Footprint(np.zeros((1, 2)), shape.radius_m)
    points, radius = shape.core()
    return Footprint(convex_hull(points[:, :2]), radius)


def tilted_footprint(shape: Shape, rotation: Array) -> Footprint:
    """Return the shadow of a shape turned by `rotation` (3, 3), about its origin."""
    points, radius = shape.core()
    return Footprint(convex_hull(rotated_3d(points, rotation)[:, :2]), radius)


def hull_volume(points: Array) -> float:
    """Return the volume of the convex hull of points (k, 3) [m^3].

    Raises:
        ValueError: If they lie in a plane.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        return float(ConvexHull(points).volume)
    except QhullError as error:
        raise ValueError("Expected points of a solid but they lie flat.") from error


def is_convex_ccw(vertices: Array) -> bool:
    """Whether a polygon (k, 2) is strictly convex and counter-clockwise.

    Every turn is to the left and all turns together are one revolution: a star
    turns left everywhere, too, but twice round.
    """
    edges = np.roll(vertices, -1, axis=0) - vertices
    following = np.roll(edges, -1, axis=0)
    cross = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    turns = angles_of(np.column_stack([(edges * following).sum(axis=1), cross]))
    return bool((cross > 0.0).all() and turns.sum() < 3.0 * math.pi)


def _extrude(outline: Array, height: float) -> tuple[Array, float]:
    """Return the vertices of the upright prism over `outline` (k, 2)."""
    half = np.full((len(outline), 1), 0.5 * height)
    return np.vstack([np.hstack([outline, -half]), np.hstack([outline, half])]), 0.0
