"""OpenGL without a screen: which backend works here, and a picture from it."""

import functools
import importlib
import os
import subprocess
import sys
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from beacon_mj.errors import BeaconError

Image = NDArray[np.uint8]  #: A picture, shape (height, width, 3).
BACKENDS = ("egl", "osmesa")  #: Headless backends, in the order they are tried.
PACKAGES = {"egl": "libegl1 libgl1-mesa-dri", "osmesa": "libosmesa6", "glfw": "libgl1"}
SHADOW_PIXELS = 1024  #: Side of the shadow map; software rendering pays for more.
MAX_GEOMS = 4000

_PROBE = "import mujoco; c = mujoco.GLContext(8, 8); c.make_current()"


class RenderError(BeaconError):
    """Nothing can be drawn here: a system library is missing or fails."""


@functools.cache
def backend() -> str:
    """Return the backend to draw with: MUJOCO_GL if set, else the first that works.

    Raises:
        RenderError: If none works, with the Debian packages that would help.
    """
    chosen = os.environ.get("MUJOCO_GL", "").lower().strip()
    if sys.platform != "linux":
        return chosen or ("cgl" if sys.platform == "darwin" else "wgl")
    candidates = (chosen,) if chosen in PACKAGES else BACKENDS
    for name in candidates:
        if _works(name):
            return name
    asked = f"MUJOCO_GL={chosen} asks for it" if chosen else "no MUJOCO_GL is set"
    hints = " or ".join(f"`apt-get install {PACKAGES[n]}`" for n in candidates)
    raise RenderError(
        f"Expected OpenGL through {' or '.join(candidates)} but it does not work here "
        f"({asked}). On Debian or Ubuntu: {hints}; or set MUJOCO_GL to one of "
        f"{', '.join(PACKAGES)}."
    )


def check_display(otherwise: str) -> None:
    """Raise RenderError, with what to do `otherwise`, if no window can open."""
    displays = ("DISPLAY", "WAYLAND_DISPLAY")
    if sys.platform == "linux" and not any(os.environ.get(d) for d in displays):
        raise RenderError(
            "Expected a display for the viewer but neither DISPLAY nor "
            f"WAYLAND_DISPLAY is set; {otherwise}."
        )


def _works(name: str) -> bool:
    """Try a backend in a process of its own; a failed one cannot be unloaded."""
    environment = {k: v for k, v in os.environ.items() if k != "PYOPENGL_PLATFORM"}
    probe = subprocess.run(
        [sys.executable, "-c", _PROBE],
        env=environment | {"MUJOCO_GL": name},
        capture_output=True,
        timeout=60,
        check=False,
    )
    return probe.returncode == 0


def _context(width: int, height: int) -> Any:
    """Return an OpenGL context of the chosen backend, made current."""
    name = backend()
    if name in BACKENDS:
        os.environ["PYOPENGL_PLATFORM"] = name
    context = importlib.import_module(f"mujoco.{name}").GLContext(width, height)
    context.make_current()
    return context


class Canvas:
    """Draws one model off screen; use as a context manager."""

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        """Prepare to draw `model` at a size in pixels."""
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        _set_look(model)
        self._model = model
        self._size = height, width
        self._rectangle = mujoco.MjrRect(0, 0, width, height)
        self._scene = mujoco.MjvScene(model, MAX_GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_HAZE] = False
        self._option = mujoco.MjvOption()
        self._gl = _context(width, height)
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)

    def draw(
        self,
        data: mujoco.MjData,
        camera: mujoco.MjvCamera,
        decorate: Callable[[mujoco.MjvScene], None] | None = None,
    ) -> Image:
        """Return a picture of a state; `decorate` may change and add geoms."""
        self._gl.make_current()
        mujoco.mjv_updateScene(
            self._model,
            data,
            self._option,
            None,
            camera,
            mujoco.mjtCatBit.mjCAT_ALL,
            self._scene,
        )
        if decorate is not None:
            decorate(self._scene)
        pixels = np.empty((*self._size, 3), np.uint8)
        mujoco.mjr_render(self._rectangle, self._scene, self._context)
        mujoco.mjr_readPixels(pixels, None, self._rectangle, self._context)
        return pixels[::-1].copy()

    def close(self) -> None:
        """Free the context."""
        self._context.free()
        self._gl.free()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Free the context."""
        self.close()


def _set_look(model: mujoco.MjModel) -> None:
    """Choose light, shadows and depth range for pictures taken from above."""
    model.vis.quality.shadowsize = SHADOW_PIXELS
    model.vis.headlight.ambient[:] = 0.36
    model.vis.headlight.diffuse[:] = 0.2
    model.light_diffuse[:] = 0.48
    # A near plane close to the scene leaves depth precision where things are.
    model.vis.map.znear = 0.3
    model.vis.map.shadowclip = 1.5
    model.geom_size[model.geom("floor").id, :2] = 0.0  # Drawn without an end.
