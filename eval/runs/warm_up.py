"""Compiling the inner loops before anything is timed.

The machine code is kept on disk, so this takes a third of a second, but half a minute
the first time on a machine. Without it that half minute would fall on somebody's first
decision, which has a time limit.
"""

import functools
from collections.abc import Iterable

import numpy as np

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.sealed import Sealer
from beacon_mj.episode.sensor import Sensor
from beacon_mj.eval.runs import machine_code
from beacon_mj.eval.runs.scene_cache import cached_scene
from beacon_mj.motion.field_search import RepairedSearch
from beacon_mj.motion.grid import Grid
from beacon_mj.motion.visibility_graph import shortest_path
from beacon_mj.planners.program import is_program
from beacon_mj.planners.registry import load_planner
from beacon_mj.scene import Scene
from beacon_mj.world import World

#: Planners that between them use every kernel, and how far each is run [steps].
_TOURS = {"beacon": 400, "beacon-voi": 400, "dstar-lite": 150, "bug1": 120}
#: Whose kernels a planner uses; one that is not here may use any.
_LIKE = {
    "beacon": "beacon",
    "beacon-kinds": "beacon",
    "beacon-voi": "beacon-voi",
    "bug1": "bug1",
    "bug2": "bug1",
    "dstar-lite": "dstar-lite",
    "push-through": "beacon",
    "semantic": "beacon",
}
_SEED = 999_999  #: Of scenes that are in no suite.
_PATIENCE_S = 3600.0


def compile_kernels(planners: Iterable[str] = _TOURS) -> None:
    """Compile every kernel that planners use, unless its machine code is on disk.

    Args:
        planners: What they are loaded by; all kernels by default.
    """
    for name in _tours_of(planners):
        _compile(name)


def load_kernels(planners: Iterable[str] = _TOURS) -> None:
    """Load the machine code that planners use, as far as it is known to be on disk.

    Args:
        planners: What they are loaded by; all kernels by default.
    """
    for name in _tours_of(planners):
        _load(name)


def _tours_of(planners: Iterable[str]) -> list[str]:
    names = {name for name in planners if not is_program(name)}
    like = {_LIKE[name] for name in names if name in _LIKE}
    return [*_TOURS] if names - _LIKE.keys() else sorted(like)


@functools.cache
def _compile(name: str) -> None:
    if machine_code.kept(name) is None:
        _tour(name)
        machine_code.keep(name)


@functools.cache
def _load(name: str) -> None:
    machine_code.load(machine_code.kept(name) or {})


def _tour(name: str) -> None:
    scene = cached_scene("collision-required", 0, _SEED, "noisy")
    protocol = Protocol(max_steps=_TOURS[name], decision_limit_s=_PATIENCE_S)
    run_episode(scene, load_planner(name)[1](), name, protocol)
    if name in ("beacon", "beacon-voi"):
        _go_round(scene)
    if name == "beacon-voi":
        _search_large_room()


def _search_large_room() -> None:
    """Repair a search as in rooms whose grid is too large to be searched whole."""
    grid = Grid.cover((0.0, 0.0, 2.0, 2.0))
    search, cells = RepairedSearch(grid), np.arange(grid.size)
    search.update(lambda asked: np.zeros(len(asked)), 0)
    search.note(cells[50:60])
    search.update(lambda asked: np.where(asked % 7 == 3, np.inf, 0.5), 0)
    search.metres(cells[-9:], np.zeros(9), grid.size - 1)


def _go_round(scene: Scene) -> None:
    """Find a way to where a push could begin, which few episodes have to look for."""
    sensor = Sensor(World(scene), Protocol(sensing_radius_m=10.0))
    seen = Sealer().observation(sensor.observe(None, 1.0))
    shortest_path(
        np.array(scene.start_m),
        np.array(scene.goal_m),
        seen.footprints,
        scene.robot.radius_m,
        scene.workspace_m,
    )
