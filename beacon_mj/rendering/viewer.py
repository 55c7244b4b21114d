"""A log in MuJoCo's interactive viewer, with pause and scrubbing."""

import time
from pathlib import Path
from typing import Any

import mujoco
import mujoco.viewer

from beacon_mj.recording.reader import Log, log_of
from beacon_mj.recording.rebuild import rebuild_trace
from beacon_mj.rendering.annotations import Marks
from beacon_mj.rendering.camera import camera_over
from beacon_mj.rendering.captions import describe
from beacon_mj.rendering.colors import Paint
from beacon_mj.rendering.gl import check_display
from beacon_mj.rendering.scrubber import HELP, Scrubber

FRAME_S = 1.0 / 30.0


def view_log(log: Log | str | Path) -> None:
    """Open MuJoCo's viewer on a log; return when it is closed.

    Raises:
        LogError: If the log cannot be read.
        RenderError: If there is no display.
    """
    log = log_of(log)
    check_display("write a page or a video instead: --html out.html, --video out.mp4")
    _Show(log).run()


class _Show:
    """One log in one window."""

    def __init__(self, log: Log) -> None:
        self._log, self._trace = log, rebuild_trace(log)
        self._model = mujoco.MjModel.from_xml_string(log.regenerated())
        self._data = mujoco.MjData(self._model)
        self._marks, self._paint = Marks(self._trace, self._model), Paint(self._trace)
        self._scrubber = Scrubber(log.steps, log.scene.robot.control_period_s)

    def run(self) -> None:
        """Play until the window is closed."""
        with mujoco.viewer.launch_passive(
            self._model,
            self._data,
            key_callback=self._scrubber.press,
            show_left_ui=False,
            show_right_ui=False,
        ) as window:
            self._aim(window.cam)
            last = time.monotonic()
            while window.is_running():
                now = time.monotonic()
                self._scrubber.advance(now - last)
                last = now
                self._draw(window, self._scrubber.step)
                time.sleep(FRAME_S)

    def _aim(self, camera: mujoco.MjvCamera) -> None:
        """Look at the whole workspace."""
        wanted = camera_over(self._log.scene.workspace_m)
        camera.lookat[:] = wanted.lookat
        camera.distance = wanted.distance
        camera.azimuth, camera.elevation = wanted.azimuth, wanted.elevation

    def _draw(self, window: Any, step: int) -> None:
        """Show the state after `step`, decorated."""
        with window.lock():
            self._data.qpos[:] = self._log.positions[step]
            self._data.time = step * self._log.scene.robot.control_period_s
            mujoco.mj_kinematics(self._model, self._data)
            mujoco.mj_camlight(self._model, self._data)
            self._recolour(step)
            window.user_scn.ngeom = 0
            self._marks.draw(window.user_scn, self._data, step)
        window.set_texts(
            (None, None, "\n".join([*describe(self._trace, step), HELP]), None)
        )
        window.sync()

    def _recolour(self, step: int) -> None:
        """Give the geoms of every obstacle its colour."""
        obstacles = self._log.scene.obstacles
        for o, colour in zip(obstacles, self._paint.colours(step), strict=True):
            body = self._model.body(o.id)
            first = int(body.geomadr[0])
            last = first + int(body.geomnum[0])
            self._model.geom_rgba[first:last, :3] = colour
