"""What a log shows at one control step, as a decorated picture.

Obstacles take the colour of the planner's class belief, a dot on top the colour of
their true class; those not sensed yet are pale. The planned path lies on the floor,
contact forces are arrows, broken obstacles turn dark.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, Self

import mujoco
import numpy as np

from beacon_mj.constants import CLASSES
from beacon_mj.geometry import Array
from beacon_mj.recording.drawing import BROKEN_RGBA
from beacon_mj.recording.reader import Log
from beacon_mj.recording.rebuild import rebuild_trace
from beacon_mj.rendering.gl import Canvas, Image, camera_over
from beacon_mj.scene_gen.mjcf import scene_mjcf
from beacon_mj.trace import StepRecord

PATH_RGBA = (0.1, 0.45, 0.85, 0.9)
TRAIL_RGBA = (0.1, 0.12, 0.2, 0.75)
ARROW_RGBA = (0.85, 0.05, 0.05, 1.0)
ARROW_M_PER_N = 0.015  #: Length of a contact arrow per newton.
ARROW_MIN_N = 1.0  #: Smallest contact force that is drawn [N].
PALE = 0.6  #: Share of white in the colour of an obstacle not sensed yet.

_IDENTITY = np.eye(3).ravel()


class Playback:
    """Draws the steps of one log; use as a context manager."""

    def __init__(self, log: Log, width: int = 960, height: int = 720) -> None:
        """Compile the log's scene and prepare to draw at a size in pixels."""
        self.log = log
        self.trace = rebuild_trace(log)
        scene = log.scene
        self._model = mujoco.MjModel.from_xml_string(scene_mjcf(scene))
        self._data = mujoco.MjData(self._model)
        self._canvas = Canvas(self._model, width, height)
        self._camera = camera_over(scene.workspace_m)
        self._tops = np.array([o.shape.height_m for o in scene.obstacles])
        self._bodies = [self._model.body(o.id).id for o in scene.obstacles]
        self._number = {b: i for i, b in enumerate(self._bodies)}
        self._ids = {o.id: i for i, o in enumerate(scene.obstacles)}
        self._colours = np.array([s.rgba[:3] for s in scene.surfaces])
        self._history = list(self._sensed_and_broken())
        self._positions = np.array(
            [self.trace.start_m, *(s.outcome.position_m for s in self.trace.steps)]
        )

    @property
    def steps(self) -> int:
        """Number of control steps."""
        return len(self.trace.steps)

    def record(self, step: int) -> StepRecord | None:
        """Return the record of a step, None for the start."""
        return None if step == 0 else self.trace.steps[step - 1]

    def picture(self, step: int) -> Image:
        """Return the state after `step`, decorated; 0 is the start."""
        self._data.qpos[:] = self.log.qpos[step]
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        return self._canvas.draw(
            self._data, self._camera, lambda scene: self._decorate(scene, step)
        )

    def close(self) -> None:
        """Free the canvas."""
        self._canvas.close()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Free the canvas."""
        self.close()

    def _sensed_and_broken(self) -> Iterator[tuple[frozenset[str], frozenset[str]]]:
        """Yield what had been sensed and broken at the start and after each step."""
        sensed, broken = set(self.trace.first_sensed), set[str]()
        yield frozenset(sensed), frozenset(broken)
        for step in self.trace.steps:
            sensed |= set(step.newly_sensed)
            broken |= {d.obstacle for d in step.outcome.damages}
            yield frozenset(sensed), frozenset(broken)

    def _decorate(self, scene: Any, step: int) -> None:
        self._paint(scene, step)
        self._mark_truth(scene, step)
        _polyline(scene, self._positions[: step + 1], 0.012, TRAIL_RGBA)
        # The decision in force after a step is the next one; the last has none.
        record = self.record(min(step + 1, self.steps))
        if record is not None and record.command.rationale.path_m is not None:
            path = np.asarray(record.command.rationale.path_m)
            _polyline(scene, path, 0.018, PATH_RGBA)
        self._draw_contacts(scene, step)

    def _paint(self, scene: Any, step: int) -> None:
        """Recolour the geoms of all obstacles."""
        colours = self.obstacle_colours(step)
        for k in range(scene.ngeom):
            geom = scene.geoms[k]
            if geom.objtype != mujoco.mjtObj.mjOBJ_GEOM or geom.objid < 0:
                continue
            i = self._number.get(int(self._model.geom_bodyid[geom.objid]))
            if i is not None:
                geom.rgba[:3] = colours[i]

    def obstacle_colours(self, step: int) -> Array:
        """Return the colour of each obstacle, shape (n, 3)."""
        sensed, broken = self._history[step]
        record = self.record(min(step + 1, self.steps))
        beliefs = {} if record is None else record.command.rationale.beliefs
        out = np.empty((len(self._ids), 3))
        for name, i in self._ids.items():
            truth = self._true_colour(i)
            if name in broken:
                out[i] = BROKEN_RGBA[:3]
            elif name in beliefs:
                out[i] = np.asarray(beliefs[name]) @ self._colours
            elif name in sensed:
                out[i] = truth if not beliefs else 0.6
            else:
                out[i] = (1.0 - PALE) * truth + PALE
        return out

    def _true_colour(self, i: int) -> Array:
        kind = self.log.scene.obstacles[i].interaction
        return np.asarray(self._colours[CLASSES.index(kind)])

    def _mark_truth(self, scene: Any, step: int) -> None:
        """Put a dot of the true class's colour on every obstacle."""
        for i, body in enumerate(self._bodies):
            x, y, z = self._data.xpos[body]
            place = np.array([x, y, z + 0.5 * self._tops[i] + 0.004])
            for radius, colour in ((0.045, np.ones(3)), (0.03, self._true_colour(i))):
                place[2] += 0.004
                rgba = np.array([*colour, 1.0])
                size = np.array([radius, 0.004, 0.0])
                _add(scene, mujoco.mjtGeom.mjGEOM_CYLINDER, size, place, rgba)

    def _draw_contacts(self, scene: Any, step: int) -> None:
        """Draw the forces on obstacles, above them so that nothing hides them."""
        record = self.record(step)
        for contact in () if record is None else record.outcome.contacts:
            force = contact.force_n.copy()
            force[2] = 0.0
            size = float(np.hypot(force[0], force[1]))
            if size < ARROW_MIN_N:
                continue
            top = float(self._tops[self._ids[contact.obstacle]])
            start = np.array([*contact.point_m[:2], top + 0.08])
            end = start + force * ARROW_M_PER_N
            _connect(scene, mujoco.mjtGeom.mjGEOM_ARROW, 0.045, start, end, ARROW_RGBA)


def _polyline(
    scene: Any, points: Array, width_m: float, rgba: tuple[float, ...]
) -> None:
    """Draw a line on the floor through points (m, 2)."""
    height = np.full((len(points), 1), 0.012)
    for a, b in pairwise(np.hstack([points, height])):
        if np.hypot(*(b - a)[:2]) > 1e-4:
            _connect(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, width_m, a, b, rgba)


def _connect(
    scene: Any,
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
    scene: Any, kind: mujoco.mjtGeom, size: Array, place: Array, rgba: Array
) -> Any | None:
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
