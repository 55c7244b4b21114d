"""What a log says about where it came from: versions, configuration, result."""

import functools
import platform
from collections.abc import Mapping
from importlib import metadata
from typing import Any

import msgspec
import mujoco
import numpy as np
from msgspec import UNSET

from beacon_mj import __version__
from beacon_mj.constants import LOG_SCHEMA, WALL_CLOCK_COLUMNS
from beacon_mj.episode.trace import Trace

_PACKAGES = ("numpy", "numba", "shapely")


@functools.cache
def log_versions() -> dict[str, str]:
    """Return the versions on which bitwise equal physics depends."""
    found = {name: metadata.version(name) for name in _PACKAGES}
    return found | {
        "beacon-mj": __version__,
        "mujoco": str(mujoco.__version__),
        "python": platform.python_version(),
        "machine": platform.machine(),
    }


def config(trace: Trace, planner_config: Any, seed: int) -> dict[str, str]:
    """Return what is needed to repeat an episode, as metadata."""
    scene = trace.scene
    told = {"oracle": "true"} if trace.oracle else {}
    return told | {
        "schema": str(LOG_SCHEMA),
        "planner": trace.planner,
        "planner_config": to_json(planner_config),
        "planner_seed": str(seed),
        "protocol": to_json(trace.protocol),
        "suite": trace.suite or "",
        "family": scene.family,
        "index": str(scene.index),
        "scene_seed": str(scene.seed),
        "perception": scene.perception,
        "scene_sha256": scene.sha256,
        **_mission(trace),
    }


def _mission(trace: Trace) -> dict[str, str]:
    """Return which day of a mission an episode is, and how it found the room."""
    scene = trace.scene
    if scene.mission is UNSET:
        return {}
    found = {
        "mission": str(scene.mission),
        "day": str(scene.day),
        "days": str(scene.days),
    }
    return found if trace.left is None else found | {"left": to_json(trace.left)}


def result(trace: Trace, row: Mapping[str, Any] | None) -> dict[str, str]:
    """Return how an episode ended, as metadata."""
    out = {
        "outcome": str(trace.outcome),
        "detail": trace.detail,
        "steps": str(len(trace.steps)),
    }
    return out if row is None else out | {"row": to_json(stable_row(row))}


def stable_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return an episode's row without its wall-clock columns."""
    return {k: v for k, v in row.items() if k not in WALL_CLOCK_COLUMNS}


def to_json(value: Any) -> str:
    """Return JSON in which floats keep every digit; NaN and infinity become null."""
    return msgspec.json.encode(value, enc_hook=_plain).decode()


def _plain(value: Any) -> Any:
    """Return a NumPy scalar, an array or anything else as what JSON knows."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    return str(value)
