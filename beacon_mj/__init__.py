"""beacon-mj: contact-revealed navigation in MuJoCo.

Names are imported when they are first used, so that `import beacon_mj` is cheap.
"""

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0.dev0"

if TYPE_CHECKING:
    from beacon_mj.episode.conformance import check_planner as check_planner
    from beacon_mj.episode.protocol import Protocol as Protocol
    from beacon_mj.episode.run import run_episode as run_episode
    from beacon_mj.episode.trace import Trace as Trace
    from beacon_mj.errors import BeaconError as BeaconError
    from beacon_mj.eval.metrics.measure import measure as measure
    from beacon_mj.interface import Command as Command
    from beacon_mj.interface import Observation as Observation
    from beacon_mj.interface import PlannerInfo as PlannerInfo
    from beacon_mj.interface import SensedObstacle as SensedObstacle
    from beacon_mj.interface import Task as Task
    from beacon_mj.planners.base import Planner as Planner
    from beacon_mj.planners.contact.candidates import PushPlan as PushPlan
    from beacon_mj.planners.contact.decision import Decision as Decision
    from beacon_mj.planners.contact.limits import PushLimits as PushLimits
    from beacon_mj.planners.contact.loop import ContactPlanner as ContactPlanner
    from beacon_mj.planners.contact.policy import PushPolicy as PushPolicy
    from beacon_mj.planners.registry import load_planner as load_planner
    from beacon_mj.planners.registry import planner_names as planner_names
    from beacon_mj.scene import Scene as Scene
    from beacon_mj.scene.checks import check_scene as check_scene
    from beacon_mj.scene.files import load_scene as load_scene
    from beacon_mj.scene_gen.generate import generate_scene as generate_scene
    from beacon_mj.scene_gen.pymjcf_export import save_obstacle as save_obstacle
    from beacon_mj.world import World as World

_HOME = {
    "BeaconError": "beacon_mj.errors",
    "Command": "beacon_mj.interface",
    "ContactPlanner": "beacon_mj.planners.contact.loop",
    "Decision": "beacon_mj.planners.contact.decision",
    "Observation": "beacon_mj.interface",
    "Planner": "beacon_mj.planners.base",
    "Protocol": "beacon_mj.episode.protocol",
    "PlannerInfo": "beacon_mj.interface",
    "PushLimits": "beacon_mj.planners.contact.limits",
    "PushPlan": "beacon_mj.planners.contact.candidates",
    "PushPolicy": "beacon_mj.planners.contact.policy",
    "Scene": "beacon_mj.scene",
    "SensedObstacle": "beacon_mj.interface",
    "Task": "beacon_mj.interface",
    "Trace": "beacon_mj.episode.trace",
    "World": "beacon_mj.world",
    "check_planner": "beacon_mj.episode.conformance",
    "check_scene": "beacon_mj.scene.checks",
    "generate_scene": "beacon_mj.scene_gen.generate",
    "load_planner": "beacon_mj.planners.registry",
    "load_scene": "beacon_mj.scene.files",
    "measure": "beacon_mj.eval.metrics.measure",
    "planner_names": "beacon_mj.planners.registry",
    "run_episode": "beacon_mj.episode.run",
    "save_obstacle": "beacon_mj.scene_gen.pymjcf_export",
}
__all__ = ["__version__", *_HOME]


def __getattr__(name: str) -> Any:
    """Import a public name from its home (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'beacon_mj' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names, imported or not."""
    return sorted(__all__)
