"""The versions of everything that may change a number."""

import functools
import hashlib
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import beacon_mj

PACKAGES = ("mujoco", "numpy", "numba", "scipy", "shapely", "python-fcl")


#: What scenes, decisions, physics and rows depend on; see docs/same-rows.md.
DECISIVE = (
    "episode", "eval/metrics", "learning", "mjcf_templates", "motion", "planners",
    "pushing", "scene", "scene_gen", "world",
)  # fmt: skip


def versions() -> dict[str, str]:
    """Return the version of each, by name; of the machine, its system and kind.

    `beacon-mj-source` is a digest over the source that decides results: it tells two
    states of it apart that bear the same version.
    """
    return package_versions() | {"beacon-mj-source": source_sha256()}


def package_versions() -> dict[str, str]:
    """Return the same without the digest of the source."""
    out = {"beacon-mj": beacon_mj.__version__, "python": platform.python_version()}
    for package in PACKAGES:
        try:
            out[package] = version(package)
        except PackageNotFoundError:
            out[package] = "missing"
    return out | {"machine": f"{platform.system()} {platform.machine()}"}


@functools.cache
def source_sha256() -> str:
    """Return a digest over the package's own source that decides results."""
    root = Path(beacon_mj.__file__).parent
    files = sorted(root.glob("*.py"))
    for name in DECISIVE:
        found = (root / name).rglob("*")
        files += sorted(p for p in found if p.suffix in (".npz", ".py", ".xml"))
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.relative_to(root).as_posix().encode() + b"\0")
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]
