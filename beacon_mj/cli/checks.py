"""`beacon-mj fidelity` and `beacon-mj doctor`."""

import ctypes.util
import os
import subprocess
import sys

from beacon_mj.cli import FAILED
from beacon_mj.cli.tables import console

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


def fidelity(*checks: str) -> int:
    """Compare the physics with closed forms; status 1 if a row fails.

    Parameters
    ----------
    checks
        Names of checks to run, such as creep; all by default.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    from beacon_mj.fidelity import fidelity_rows

    table = Table("law", box=SIMPLE_HEAD, show_edge=False, padding=0)
    for heading in ("expected", "measured", "tolerance"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("unit")
    table.add_column("", no_wrap=True)
    passed = total = 0
    for row in fidelity_rows(checks):
        numbers = [f"{x:.4g}" for x in (row.expected, row.measured, row.tolerance)]
        verdict = "ok" if row.passed else "FAIL"
        table.add_row(f"{row.check}: {row.law}", *numbers, row.unit, verdict)
        passed, total = passed + row.passed, total + 1
        if sys.stderr.isatty():
            print(f"\r{total} rows, {passed} pass", end="", file=sys.stderr)
    if sys.stderr.isatty():
        print(file=sys.stderr)
    console().print(table)
    print(f"\n{passed} of {total} rows pass")
    return 0 if passed == total else FAILED


def doctor() -> int:
    """Say what is here: versions and machine; status 1 if something is missing."""
    from beacon_mj.eval.runs.scene_cache import cache_folder
    from beacon_mj.eval.runs.versions import versions
    from beacon_mj.recording.machine import machine

    found = versions()
    for name, version in (found | machine()).items():
        print(f"{name:12} {version}")
    print(f"{'cores':12} {os.cpu_count()}")
    print(f"{'cache':12} {cache_folder() or 'off'}")
    missing = [name for name, version in found.items() if version == "missing"]
    working = [backend for backend in LIBRARIES if _renders(backend)]
    print(f"{'rendering':12} {', '.join(working) or 'no backend works'}")
    if not working:
        missing += [_absent(*LIBRARIES[backend]) for backend in LIBRARIES]
        print("Pictures and videos need one of: " + "; ".join(missing))
    elif missing:
        print(f"missing: {', '.join(missing)}", file=sys.stderr)
    return FAILED if missing else 0


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
