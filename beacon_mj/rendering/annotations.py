"""What is drawn into a scene beside the world: way, path, forces, classes, scale."""

from itertools import pairwise

import mujoco
import numpy as np

from beacon_mj.constants import WALL_KIND
from beacon_mj.episode.trace import Trace
from beacon_mj.geometry import Array
from beacon_mj.rendering.colors import Paint
from beacon_mj.scene import Obstacle

PATH_RGBA = (0.1, 0.45, 0.85, 0.9)
TRAIL_RGBA = (0.1, 0.12, 0.2, 0.75)
ARROW_RGBA = (0.85, 0.05, 0.05, 1.0)
LABEL_RGBA = (0.05, 0.05, 0.1, 1.0)
CROSS_RGBA = (1.0, 1.0, 1.0, 1.0)  #: Of the cross on what is broken.
SCAN_RGBA = (0.95, 0.45, 0.0, 1.0)  #: Of what the lidar hit.
ARROW_M_PER_N = 0.015  #: Length of a contact arrow per newton.
ARROW_MIN_N = 1.0  #: Smallest contact force that is drawn [N].
SCALE_OFFSET = 0.35  #: Distance of the scale bar from the room, over its length.

_IDENTITY = np.eye(3).ravel()


class Marks:
    """The marks of one trace."""

    def __init__(self, trace: Trace, model: mujoco.MjModel) -> None:
        """Prepare to mark a world that was compiled from the trace's scene."""
        obstacles = trace.scene.obstacles
        self._trace, self._paint = trace, Paint(trace)
        self._tops = np.array([o.shape.height_m for o in obstacles])
        self._reaches = [cross_reach(o) for o in obstacles]
        self._bodies = [model.body(o.id).id for o in obstacles]
        self._ids = {o.id: i for i, o in enumerate(obstacles)}
        self._kinds = [shown_kind(o) for o in obstacles]
        self._positions = np.array(
            [trace.start_m, *(s.outcome.position_m for s in trace.steps)]
        )

    def draw(self, scene: mujoco.MjvScene, data: mujoco.MjData, step: int) -> None:
        """Add the marks of the state after `step`, which `data` is in, to a scene."""
        self._mark_truth(scene, data)
        self._mark_broken(scene, data, step)
        self._draw_scale(scene)
        _polyline(scene, self._positions[: step + 1], 0.012, TRAIL_RGBA)
        record = self._paint.decision(step)
        if record is not None and record.command.info.path_m is not None:
            path = np.asarray(record.command.info.path_m)
            _polyline(scene, path, 0.018, PATH_RGBA)
        self._draw_contacts(scene, step)

    def _mark_truth(self, scene: mujoco.MjvScene, data: mujoco.MjData) -> None:
        """Put a dot of the true class's colour on every obstacle."""
        for i, body in enumerate(self._bodies):
            x, y, z = data.xpos[body]
            place = np.array([x, y, z + 0.5 * self._tops[i] + 0.004])
            dots = (0.045, np.ones(3)), (0.03, self._paint.true_colour(i))
            for radius, colour in dots:
                place[2] += 0.004
                rgba = np.array([*colour, 1.0])
                size = np.array([radius, 0.004, 0.0])
                _add(scene, mujoco.mjtGeom.mjGEOM_CYLINDER, size, place, rgba)
            if (kind := self._kinds[i]) is not None:
                _label(scene, place + np.array((0.0, 0.0, 0.1)), kind)

    def _mark_broken(
        self, scene: mujoco.MjvScene, data: mujoco.MjData, step: int
    ) -> None:
        """Put a cross on what is broken: colour alone would look like a belief."""
        for i in self._paint.broken(step):
            x, y, z = data.xpos[self._bodies[i]]
            for start, end in cross((x, y), self._reaches[i]):
                top = z + 0.5 * self._tops[i] + 0.02
                a, b = np.array([*start, top]), np.array([*end, top])
                _connect(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, 0.02, a, b, CROSS_RGBA)

    def _draw_scale(self, scene: mujoco.MjvScene) -> None:
        """Lay a bar of a known length on the floor, north of the arena."""
        west, _, _, north = self._trace.scene.workspace_m
        length = scale_m(self._trace.scene.workspace_m)
        y = north + SCALE_OFFSET * length
        ends = np.array([[west, y], [west + length, y]])
        _polyline(scene, ends, 0.03 * length, LABEL_RGBA)
        place = np.array([west + 1.1 * length, y, 0.1 * length])
        _label(scene, place, f"{length:g} m")

    def _draw_contacts(self, scene: mujoco.MjvScene, step: int) -> None:
        """Draw the forces on obstacles, above them so that nothing hides them."""
        for contact in self._trace.steps[step - 1].outcome.contacts if step else ():
            force = contact.force_n.copy()
            force[2] = 0.0
            size = float(np.hypot(force[0], force[1]))
            if size < ARROW_MIN_N:
                continue
            top = float(self._tops[self._ids[contact.obstacle]])
            start = np.array([*contact.point_m[:2], top + 0.08])
            end = start + force * ARROW_M_PER_N
            _connect(scene, mujoco.mjtGeom.mjGEOM_ARROW, 0.045, start, end, ARROW_RGBA)


def draw_scan(scene: mujoco.MjvScene, points_m: Array, height_m: float) -> None:
    """Add a ball above each place that a beam hit, (k, 2), where nothing hides it."""
    for x, y in points_m.tolist():
        place, size = np.array([x, y, height_m]), np.full(3, 0.025)
        _add(scene, mujoco.mjtGeom.mjGEOM_SPHERE, size, place, np.array(SCAN_RGBA))


def shown_kind(obstacle: Obstacle) -> str | None:
    """Return the label of an obstacle in pictures: its kind, but for walls."""
    kind = obstacle.perceived.kind
    return None if kind == WALL_KIND else kind


def cross_reach(obstacle: Obstacle) -> float:
    """Return how far the arms of a cross on an obstacle reach [m]."""
    return float(0.6 * np.sqrt(obstacle.footprint.polygon().area / np.pi))


def cross(
    centre: tuple[float, float], reach: float
) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return the two lines of a cross, each from end to end [m]."""
    x, y = centre
    return [
        ((x - reach, y - reach), (x + reach, y + reach)),
        ((x - reach, y + reach), (x + reach, y - reach)),
    ]


def scale_m(workspace_m: tuple[float, float, float, float]) -> float:
    """Return the length of a scale bar: 0.5, 1, 2, 5 or 10 m, a fifth at most."""
    width = workspace_m[2] - workspace_m[0]
    return max(n for n in (0.5, 1.0, 2.0, 5.0, 10.0) if n == 0.5 or 5.0 * n <= width)


def _label(scene: mujoco.MjvScene, place: Array, text: str) -> None:
    """Write a word over a place."""
    geom = _add(
        scene, mujoco.mjtGeom.mjGEOM_LABEL, np.full(3, 0.1), place, np.array(LABEL_RGBA)
    )
    if geom is not None:
        geom.label = text


def _polyline(
    scene: mujoco.MjvScene, points: Array, width_m: float, rgba: tuple[float, ...]
) -> None:
    """Draw a line on the floor through points (m, 2)."""
    height = np.full((len(points), 1), 0.012)
    for a, b in pairwise(np.hstack([points, height])):
        if np.hypot(*(b - a)[:2]) > 1e-4:
            _connect(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, width_m, a, b, rgba)


def _connect(
    scene: mujoco.MjvScene,
    kind: mujoco.mjtGeom,
    width_m: float,
    start: Array,
    end: Array,
    rgba: tuple[float, ...],
) -> None:
    """Add a capsule or an arrow from one point to another."""
    geom = _add(scene, kind, np.zeros(3), start, np.array(rgba))
    if geom is not None:
        mujoco.mjv_connector(geom, kind, width_m, start, end)


def _add(
    scene: mujoco.MjvScene, kind: mujoco.mjtGeom, size: Array, place: Array, rgba: Array
) -> mujoco.MjvGeom | None:
    """Add a geom to a scene, unless it is full."""
    if scene.ngeom >= scene.maxgeom:
        return None
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(
        geom, kind, size, place, _IDENTITY, np.asarray(rgba, np.float32)
    )
    geom.category = mujoco.mjtCatBit.mjCAT_DECOR
    scene.ngeom += 1
    return geom
