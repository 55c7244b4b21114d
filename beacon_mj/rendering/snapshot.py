"""Looking at a scene: a picture without a screen, or the interactive viewer."""

from pathlib import Path

import mujoco
import mujoco.viewer
from PIL import Image as Pillow

from beacon_mj.files import replacing
from beacon_mj.rendering.camera import camera_over
from beacon_mj.rendering.gl import Canvas, check_display
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.mjcf import scene_mjcf


def render_scene(
    scene: Scene, out: str | Path, *, width: int = 1280, height: int = 960
) -> Path:
    """Write a PNG of a scene, obstacles coloured by their true class.

    Raises:
        RenderError: If nothing can be drawn here.
    """
    model, data = _compiled(scene)
    with Canvas(model, width, height) as canvas:
        picture = canvas.draw(data, camera_over(scene.workspace_m, width / height))
    with replacing(Path(out)) as part:
        Pillow.fromarray(picture).save(part, format="PNG")
    return Path(out)


def view_scene(scene: Scene) -> None:
    """Open MuJoCo's interactive viewer on a scene; return when it is closed.

    Raises:
        RenderError: If there is no display.
    """
    check_display("write a picture instead: --png out.png")
    model, data = _compiled(scene)
    mujoco.viewer.launch(model, data)


def _compiled(scene: Scene) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(scene_mjcf(scene))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data
