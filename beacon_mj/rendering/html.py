"""A log as one HTML page with a 3-D scene and a scrubber, which opens from disk.

mjviser turns the compiled world into meshes, viser records how they move, and viser's
own client goes into the file with that recording: no server and no network.
"""

import socket
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from html import escape
from io import StringIO
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import viser
from mjviser.conversions import merge_geoms, merge_sites

from beacon_mj.errors import printable
from beacon_mj.files import replacing
from beacon_mj.geometry import Array
from beacon_mj.recording.encoding import split_path
from beacon_mj.recording.reader import Log, log_of
from beacon_mj.recording.rebuild import rebuild_trace
from beacon_mj.rendering.annotations import (
    ARROW_M_PER_N,
    ARROW_MIN_N,
    SCALE_OFFSET,
    cross,
    cross_reach,
    scale_m,
    shown_kind,
)
from beacon_mj.rendering.captions import describe
from beacon_mj.rendering.colors import Paint
from beacon_mj.rendering.legend import entries, html_legend
from beacon_mj.scene import Obstacle

HOLD_S = 1.5  #: How long the end stays before the replay starts again [s].
PIECE_M = 0.05  #: Length of a piece of the way travelled [m].
LIFT_M = 0.02  #: Height of lines above the floor [m].
ARROW_Z_M = 0.7  #: Height of force arrows, where nothing hides them [m].
#: What the page may do: run the viewer in it, whose labels need `eval`, and load
#: nothing from anywhere.
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; "
    "worker-src blob:; connect-src data: blob:; base-uri 'none'; form-action 'none'"
)
POLICY_TAG = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
WAY_RGB, PATH_RGB, ARROW_RGB = (40, 46, 70), (26, 115, 217), (217, 26, 26)
CROSS_RGB = (255, 255, 255)


def render_page(log: Log | str | Path, out: str | Path) -> Path:
    """Write a log as one self-contained HTML file.

    Its clock shows simulated seconds; how fast they pass is chosen in the page.

    Args:
        log: A log, or the path of one, finished or not.
        out: The page; written whole or not at all.

    Raises:
        LogError: If the log cannot be read.
    """
    log = log_of(log)
    with _server() as server, replacing(Path(out)) as part:
        part.write_text(_Page(server, log).html(), encoding="utf-8")
    return Path(out)


@contextmanager
def _server() -> Iterator[viser.ViserServer]:
    """Yield a server that only collects messages; it listens on this host alone."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    # It reports its address and its end on stdout, which nobody can use.
    with redirect_stdout(StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=port, verbose=False)
        try:
            yield server
        finally:
            server.stop()


class _Page:
    """Plays one log into a viser server."""

    def __init__(self, server: viser.ViserServer, log: Log) -> None:
        self._scene, self._camera = server.scene, server.initial_camera
        self._serializer = server.get_scene_serializer
        self._log, self._trace = log, rebuild_trace(log)
        self._model = mujoco.MjModel.from_xml_string(log.regenerated())
        self._data = mujoco.MjData(self._model)
        self._paint = Paint(self._trace)
        self._path = np.zeros((0, 2))
        self._forces = False
        self._build()

    def html(self) -> str:
        """Return the page."""
        self._show(0)
        recording = self._serializer()
        period_s = self._log.scene.robot.control_period_s
        for step in range(1, self._log.steps + 1):
            recording.insert_sleep(period_s)
            self._show(step)
        recording.insert_sleep(HOLD_S)
        title = escape(printable(f"{self._log.scene.name}, {self._log.planner}"))
        head = f"<head>{POLICY_TAG}<title>{title}</title>"
        page = str(recording.as_html()).replace("<head>", head, 1)
        # The last one: the client's own script has another in a text.
        start, _, end = page.rpartition("</body>")
        shown = html_legend(entries(self._log.scene, dots=False))
        return f"{start}{shown}</body>{end}"

    def _build(self) -> None:
        """Add everything that is there from start to end."""
        scene, model = self._log.scene, self._model
        west, south, east, north = scene.workspace_m
        middle = 0.5 * (west + east), 0.5 * (south + north)
        self._scene.set_up_direction("+z")
        extent = max(east - west, north - south)
        self._camera.position = middle[0], middle[1] - 0.62 * extent, 0.66 * extent
        self._camera.look_at = middle[0], middle[1] - 0.06 * extent, 0.0
        mujoco.mj_kinematics(model, self._data)
        self._scene.add_grid(
            "/floor",
            width=east - west,
            height=north - south,
            cell_size=0.5,
            section_size=1.0,
            position=(*middle, 0.0),
        )
        walls = [g for g in range(model.ngeom) if model.geom_bodyid[g] == 0]
        walls.remove(model.geom("floor").id)
        self._scene.add_mesh_trimesh("/walls", merge_geoms(model, walls))
        self._scene.add_mesh_trimesh(
            "/marks", merge_sites(model, [model.site(n).id for n in ("start", "goal")])
        )
        self._bodies: dict[int, Any] = {
            model.body(name).id: self._scene.add_mesh_trimesh(
                f"/robot/{name}", merge_geoms(model, self._geoms(name))
            )
            for name in ("base", "bumper")
        }
        self._way = self._add_way()
        self._meshes = [self._mesh(o) for o in scene.obstacles]
        broken = self._paint.broken(self._log.steps)
        self._crosses = {i: self._add_cross(i) for i in broken}
        self._add_scale()
        north_west = (west, north + 0.15, 0.3)
        self._text = self._scene.add_label(
            "/text", "", position=north_west, anchor="bottom-left"
        )

    def _geoms(self, body: str) -> list[int]:
        """Return the visible geoms of a body."""
        found = self._model.body(body)
        first = int(found.geomadr[0])
        geoms = range(first, first + int(found.geomnum[0]))
        return [g for g in geoms if self._model.geom_rgba[g, 3] > 0.0]

    def _mesh(self, obstacle: Obstacle) -> Any:
        """Add an obstacle as a mesh whose pose and colour can change."""
        shape = merge_geoms(self._model, self._geoms(obstacle.id))
        handle = self._scene.add_mesh_simple(
            f"/obstacles/{obstacle.id}", shape.vertices, shape.faces, flat_shading=True
        )
        self._bodies[self._model.body(obstacle.id).id] = handle
        if (kind := shown_kind(obstacle)) is not None:
            above = (obstacle.x_m, obstacle.y_m, obstacle.shape.height_m + 0.1)
            self._scene.add_label(f"/kinds/{obstacle.id}", kind, position=above)
        return handle

    def _show(self, step: int) -> None:
        """Move, recolour and redraw what one step changed; viser sends only that."""
        self._data.qpos[:] = self._log.positions[step]
        mujoco.mj_kinematics(self._model, self._data)
        for body, handle in self._bodies.items():
            handle.position = self._data.xpos[body]
            handle.wxyz = self._data.xquat[body]
        for handle, colour in zip(self._meshes, self._paint.colours(step), strict=True):
            handle.color = tuple((255.0 * colour).astype(int).tolist())
        for i in self._paint.broken(step):
            self._crosses[i].position = self._meshes[i].position
            self._crosses[i].visible = True
        self._text.text = "\n".join(filter(None, describe(self._trace, step)))
        if step in self._way:
            self._way[step].visible = True
        self._draw_path(step)
        self._draw_forces(step)

    def _add_cross(self, i: int) -> Any:
        """Add the cross of an obstacle that breaks, hidden; see `_add_way`."""
        obstacle = self._log.scene.obstacles[i]
        lines = np.array(cross((0.0, 0.0), cross_reach(obstacle)))
        top = np.full((2, 2, 1), 0.5 * obstacle.shape.height_m + LIFT_M)
        return self._scene.add_line_segments(
            f"/broken/{obstacle.id}",
            np.concatenate([lines, top], axis=2),
            CROSS_RGB,
            thickness=0.05,
            visible=False,
        )

    def _add_scale(self) -> None:
        """Lay a bar of a known length on the floor."""
        west, south, *_ = self._log.scene.workspace_m
        length = scale_m(self._log.scene.workspace_m)
        y = south - SCALE_OFFSET * length
        bar = _lifted(np.array([[west, y], [west + length, y]]))[None]
        self._scene.add_line_segments("/scale/bar", bar, WAY_RGB, thickness=0.06)
        place = (west + 1.1 * length, y, LIFT_M)
        self._scene.add_label(
            "/scale/text",
            f"{length:g} m",
            position=place,
            anchor="center-left",
        )

    def _add_way(self) -> dict[int, Any]:
        """Add the way travelled as hidden pieces; return each with its last step.

        A replay that starts again only hides what was hidden at its start; what was
        added later would stay.
        """
        last = self._trace.start_m
        out: dict[int, Any] = {}
        for step in self._trace.steps:
            here = step.outcome.position_m
            if np.hypot(*(here - last)) > PIECE_M or step is self._trace.steps[-1]:
                piece = _lifted(np.array([last, here]))[None]
                name = f"/way/{len(out)}"
                handle = self._scene.add_line_segments(
                    name, piece, WAY_RGB, thickness=0.02, visible=False
                )
                out[step.outcome.step] = handle
                last = here
        return out

    def _draw_path(self, step: int) -> None:
        """Replace the planned path when it is another one."""
        record = self._paint.decision(step)
        path = None if record is None else record.command.info.path_m
        path = np.zeros((0, 2)) if path is None else np.asarray(path)
        # A robot on its way only drops points; that is not worth a new line.
        if split_path(path, self._path) is None:
            points = _lifted(path)
            pieces = np.stack([points[:-1], points[1:]], axis=1)
            self._scene.add_line_segments("/path", pieces, PATH_RGB, thickness=0.03)
            self._path = path

    def _draw_forces(self, step: int) -> None:
        """Replace the arrows of contact forces on obstacles."""
        contacts = self._trace.steps[step - 1].outcome.contacts if step else ()
        strong = [c for c in contacts if np.hypot(*c.force_n[:2]) > ARROW_MIN_N]
        points = np.zeros((max(1, len(strong)), 2, 3))
        for k, contact in enumerate(strong):
            points[k, :] = *contact.point_m[:2], ARROW_Z_M
            points[k, 1, :2] += ARROW_M_PER_N * contact.force_n[:2]
        if step == 0 or strong or self._forces:
            shown = len(strong) > 0
            self._scene.add_arrows("/forces", points, ARROW_RGB, visible=shown)
            self._forces = shown


def _lifted(points: Array) -> Array:
    """Return points (m, 2) as points a little above the floor, (m, 3)."""
    return np.hstack([points, np.full((len(points), 1), LIFT_M)])
