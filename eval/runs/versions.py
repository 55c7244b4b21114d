"""The versions of everything that may change a number."""

import platform
from importlib.metadata import PackageNotFoundError, version

import beacon_mj

PACKAGES = ("mujoco", "numpy", "numba", "scipy", "shapely", "python-fcl")


def versions() -> dict[str, str]:
    """Return the version of each, by name; of the machine, its system and kind."""
    out = {"beacon-mj": beacon_mj.__version__, "python": platform.python_version()}
    for package in PACKAGES:
        try:
            out[package] = version(package)
        except PackageNotFoundError:
            out[package] = "missing"
    return out | {"machine": f"{platform.system()} {platform.machine()}"}
