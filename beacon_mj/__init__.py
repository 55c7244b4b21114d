"""beacon-mj: contact-revealed navigation in MuJoCo.

Names are imported when they are first used, so that `import beacon_mj` is cheap.
"""

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0.dev0"

if TYPE_CHECKING:
    from beacon_mj.cli.views.progress import show_progress as show_progress
    from beacon_mj.episode.mission import run_mission as run_mission
    from beacon_mj.episode.protocol import Protocol as Protocol
    from beacon_mj.episode.run import run_episode as run_episode
    from beacon_mj.episode.trace import Trace as Trace
    from beacon_mj.errors import BeaconError as BeaconError
    from beacon_mj.eval.api.bench import bench as bench
    from beacon_mj.eval.api.comparison import compare as compare
    from beacon_mj.eval.api.conformance import check_planner as check_planner
    from beacon_mj.eval.api.evaluation import evaluate as evaluate
    from beacon_mj.eval.api.evaluation import merge as merge
    from beacon_mj.eval.api.families import list_families as list_families
    from beacon_mj.eval.api.leaderboard import leaderboard as leaderboard
    from beacon_mj.eval.api.learning import learning_savings as learning_savings
    from beacon_mj.eval.api.logs import export_ros2 as export_ros2
    from beacon_mj.eval.api.logs import log_info as log_info
    from beacon_mj.eval.api.logs import measure_log as measure_log
    from beacon_mj.eval.api.logs import recover_log as recover_log
    from beacon_mj.eval.api.logs import replay as replay
    from beacon_mj.eval.api.machine import doctor as doctor
    from beacon_mj.eval.api.planners import describe_planner as describe_planner
    from beacon_mj.eval.api.planners import list_planners as list_planners
    from beacon_mj.eval.api.published import verify_published as verify_published
    from beacon_mj.eval.api.reports import fill_tables as fill_tables
    from beacon_mj.eval.api.reports import write_report as write_report
    from beacon_mj.eval.api.robots import check_robot as check_robot
    from beacon_mj.eval.api.robots import list_robots as list_robots
    from beacon_mj.eval.api.scenes import generate_scenes as generate_scenes
    from beacon_mj.eval.api.studies import ablate as ablate
    from beacon_mj.eval.api.studies import certify as certify
    from beacon_mj.eval.api.studies import regret as regret
    from beacon_mj.eval.api.studies import sweep as sweep
    from beacon_mj.eval.api.verification import bundle as bundle
    from beacon_mj.eval.api.verification import verify as verify
    from beacon_mj.eval.metrics.measure import measure as measure
    from beacon_mj.eval.statistics.results import Results as Results
    from beacon_mj.eval.statistics.results import load_results as load_results
    from beacon_mj.fidelity import run_fidelity as run_fidelity
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
    from beacon_mj.recording import read_log as read_log
    from beacon_mj.recording import read_trace as read_trace
    from beacon_mj.recording.layouts import write_layouts as write_layouts
    from beacon_mj.rendering import plot_panel as plot_panel
    from beacon_mj.rendering import render_page as render_page
    from beacon_mj.rendering import render_scene as render_scene
    from beacon_mj.rendering import render_strip as render_strip
    from beacon_mj.rendering import render_video as render_video
    from beacon_mj.rendering import view_log as view_log
    from beacon_mj.rendering import view_scene as view_scene
    from beacon_mj.rl.observer import Observer as Observer
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
    "Observer": "beacon_mj.rl.observer",
    "Planner": "beacon_mj.planners.base",
    "PlannerInfo": "beacon_mj.interface",
    "PushLimits": "beacon_mj.planners.contact.limits",
    "PushPlan": "beacon_mj.planners.contact.candidates",
    "PushPolicy": "beacon_mj.planners.contact.policy",
    "Protocol": "beacon_mj.episode.protocol",
    "Results": "beacon_mj.eval.statistics.results",
    "Scene": "beacon_mj.scene",
    "SensedObstacle": "beacon_mj.interface",
    "Task": "beacon_mj.interface",
    "Trace": "beacon_mj.episode.trace",
    "World": "beacon_mj.world",
    "ablate": "beacon_mj.eval.api.studies",
    "bench": "beacon_mj.eval.api.bench",
    "bundle": "beacon_mj.eval.api.verification",
    "certify": "beacon_mj.eval.api.studies",
    "check_planner": "beacon_mj.eval.api.conformance",
    "check_robot": "beacon_mj.eval.api.robots",
    "check_scene": "beacon_mj.scene.checks",
    "compare": "beacon_mj.eval.api.comparison",
    "describe_planner": "beacon_mj.eval.api.planners",
    "doctor": "beacon_mj.eval.api.machine",
    "evaluate": "beacon_mj.eval.api.evaluation",
    "export_ros2": "beacon_mj.eval.api.logs",
    "fill_tables": "beacon_mj.eval.api.reports",
    "generate_scene": "beacon_mj.scene_gen.generate",
    "generate_scenes": "beacon_mj.eval.api.scenes",
    "leaderboard": "beacon_mj.eval.api.leaderboard",
    "learning_savings": "beacon_mj.eval.api.learning",
    "list_families": "beacon_mj.eval.api.families",
    "list_planners": "beacon_mj.eval.api.planners",
    "list_robots": "beacon_mj.eval.api.robots",
    "load_planner": "beacon_mj.planners.registry",
    "load_results": "beacon_mj.eval.statistics.results",
    "load_scene": "beacon_mj.scene.files",
    "log_info": "beacon_mj.eval.api.logs",
    "measure": "beacon_mj.eval.metrics.measure",
    "measure_log": "beacon_mj.eval.api.logs",
    "merge": "beacon_mj.eval.api.evaluation",
    "planner_names": "beacon_mj.planners.registry",
    "plot_panel": "beacon_mj.rendering",
    "read_log": "beacon_mj.recording",
    "read_trace": "beacon_mj.recording",
    "recover_log": "beacon_mj.eval.api.logs",
    "regret": "beacon_mj.eval.api.studies",
    "render_page": "beacon_mj.rendering",
    "render_scene": "beacon_mj.rendering",
    "render_strip": "beacon_mj.rendering",
    "render_video": "beacon_mj.rendering",
    "replay": "beacon_mj.eval.api.logs",
    "run_episode": "beacon_mj.episode.run",
    "save_obstacle": "beacon_mj.scene_gen.pymjcf_export",
    "run_fidelity": "beacon_mj.fidelity",
    "run_mission": "beacon_mj.episode.mission",
    "show_progress": "beacon_mj.cli.views.progress",
    "sweep": "beacon_mj.eval.api.studies",
    "verify": "beacon_mj.eval.api.verification",
    "verify_published": "beacon_mj.eval.api.published",
    "view_log": "beacon_mj.rendering",
    "view_scene": "beacon_mj.rendering",
    "write_layouts": "beacon_mj.recording.layouts",
    "write_report": "beacon_mj.eval.api.reports",
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
