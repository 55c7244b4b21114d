"""What this machine has, and what is missing on it."""

import ctypes.util
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass

from rich.table import Table

from beacon_mj.eval.runs.scene_cache import cache_folder
from beacon_mj.eval.runs.versions import versions
from beacon_mj.eval.runs.worker_process import usable_cores
from beacon_mj.rendering.tables import Tabular

LIBRARIES = {
    "egl": ("EGL", "libegl1"),
    "osmesa": ("OSMesa", "libosmesa6"),
    "glfw": ("GL", "libgl1"),
}  #: MuJoCo's GL backends: the library of each, and Debian's package for it.
RENDER_S = 60.0  #: Time within which a backend must draw one picture [s].
_RENDER = """
import mujoco
model = mujoco.MjModel.from_xml_string(
    "<mujoco><worldbody><light pos='0 0 2'/><geom size='1'/></worldbody></mujoco>"
)
with mujoco.Renderer(model, 32, 32) as renderer:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer.update_scene(data)
    assert renderer.render().any()
"""


@dataclass(frozen=True, kw_only=True, slots=True)
class Diagnosis(Tabular):
    """What this machine has.

    Attributes:
        versions: Of everything that may change a number, by name.
        cores: Processors that this process may use.
        cache: Folder of the cache of scenes, or `off`.
        backends: MuJoCo's GL backends that can draw here.
        missing: What should be installed.
    """

    versions: dict[str, str]
    cores: int
    cache: str
    backends: tuple[str, ...]
    missing: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether nothing is missing."""
        return not self.missing

    def tables(self) -> Sequence[Table | str]:
        """Return a line a fact."""
        facts = self.versions | {
            "cores": str(self.cores),
            "cache": self.cache,
            "rendering": ", ".join(self.backends) or "no backend works",
        }
        lines = [f"{name:12} {text}" for name, text in facts.items()]
        if not self.backends:
            lines.append("Pictures and videos need one of: " + "; ".join(self.missing))
        return ["\n".join(lines)]


def doctor() -> Diagnosis:
    """Return which versions are here and what is missing.

    The same as `beacon-mj doctor`. Every GL backend is tried in another process.
    """
    found = versions()
    missing = [name for name, version in found.items() if version == "missing"]
    working = tuple(backend for backend in LIBRARIES if _renders(backend))
    if not working:
        missing += [_absent(*LIBRARIES[backend]) for backend in LIBRARIES]
    return Diagnosis(
        versions=found,
        cores=usable_cores(),
        cache=str(cache_folder() or "off"),
        backends=working,
        missing=tuple(missing),
    )


def _renders(backend: str) -> bool:
    """Whether MuJoCo can draw a picture with a backend, tried in another process."""
    try:
        tried = subprocess.run(
            [sys.executable, "-c", _RENDER],
            env=os.environ | {"MUJOCO_GL": backend},
            capture_output=True,
            timeout=RENDER_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False
    return tried.returncode == 0


def _absent(library: str, package: str) -> str:
    """Return what to install, or that the library is there and does not work."""
    if ctypes.util.find_library(library):
        return f"lib{library} (found, but it cannot draw here)"
    return f"lib{library} (apt install {package})"
