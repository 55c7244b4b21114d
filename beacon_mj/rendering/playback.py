"""What a log shows at one control step, as a decorated picture.

Obstacles take the colour of the planner's class belief, a dot on top the colour of
their true class; those not sensed yet are pale. The planned path lies on the floor,
contact forces are arrows, broken obstacles turn dark. Above what a lidar hit is a dot.
"""

from typing import Self

import mujoco

from beacon_mj.episode.trace import StepRecord
from beacon_mj.geometry import Array
from beacon_mj.recording.reader import Log
from beacon_mj.recording.rebuild import rebuild_trace
from beacon_mj.recording.scans import SCAN_TOPIC, scan_points
from beacon_mj.rendering.annotations import Marks, draw_scan
from beacon_mj.rendering.camera import camera_over
from beacon_mj.rendering.colors import Paint
from beacon_mj.rendering.gl import Canvas, Image
from beacon_mj.rendering.legend import Entry, entries


def legend_of(log: Log) -> list[Entry]:
    """Return the legend of the pictures of a log."""
    return entries(log.scene, lidar=bool(log.messages[SCAN_TOPIC]))


class Playback:
    """Draws the steps of one log; use as a context manager."""

    def __init__(self, log: Log, width: int = 960, height: int = 720) -> None:
        """Compile the log's scene and prepare to draw at a size in pixels."""
        self.log = log
        self.trace = rebuild_trace(log)
        scene = log.scene
        self._model = mujoco.MjModel.from_xml_string(log.regenerated())
        self._data = mujoco.MjData(self._model)
        self._canvas = Canvas(self._model, width, height)
        self._camera = camera_over(scene.workspace_m, width / height)
        self._number = {
            self._model.body(o.id).id: i for i, o in enumerate(scene.obstacles)
        }
        self._paints = Paint(self.trace)
        self._marks = Marks(self.trace, self._model)
        tops = [o.shape.height_m for o in scene.obstacles]
        self._scan_m = max([*tops, scene.robot.height_m]) + 0.05

    @property
    def steps(self) -> int:
        """Number of control steps."""
        return len(self.trace.steps)

    def record(self, step: int) -> StepRecord | None:
        """Return the record of a step, None for the start."""
        return None if step == 0 else self.trace.steps[step - 1]

    def picture(self, step: int) -> Image:
        """Return the state after `step`, decorated; 0 is the start."""
        self._data.qpos[:] = self.log.positions[step]
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

    def _decorate(self, scene: mujoco.MjvScene, step: int) -> None:
        self._paint(scene, step)
        self._marks.draw(scene, self._data, step)
        draw_scan(scene, scan_points(self.log, step), self._scan_m)

    def _paint(self, scene: mujoco.MjvScene, step: int) -> None:
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
        return self._paints.colours(step)
