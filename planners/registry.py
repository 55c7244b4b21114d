"""Planners by name. A built-in one is imported when it is asked for, not before."""

from importlib.metadata import entry_points
from pathlib import Path

from beacon_mj.errors import PlannerError, unknown
from beacon_mj.planners.base import Planner
from beacon_mj.planners.loading import from_file, from_module

GROUP = "beacon_mj.planners"  #: Entry-point group through which third parties join.
#: The planners of the paper's Table II: what `all` stands for.
COMPETITORS = {
    "bug1": "beacon_mj.planners.bug1:Bug1",
    "bug2": "beacon_mj.planners.bug2:Bug2",
    "dstar-lite": "beacon_mj.planners.dstar_lite:DStarLitePlanner",
    "semantic": "beacon_mj.planners.semantic:Semantic",
    "beacon": "beacon_mj.planners.beacon:Beacon",
}
#: Planners of our own; `beacon` stays the paper's.
OURS = {"beacon-voi": "beacon_mj.planners.beacon_voi:BeaconVoi"}
#: Yardsticks: beside the table, never in it. `clairvoyant` is told the truth.
ANCHORS = {
    "impact": "beacon_mj.planners.impact:Impact",
    "push-through": "beacon_mj.planners.push_through:PushThrough",
    "clairvoyant": "beacon_mj.planners.clairvoyant:Clairvoyant",
}
ALIASES = {"bug": "bug1"}


def planner_names() -> dict[str, str]:
    """Return `module:Class` of every planner by name.

    A third party's planner cannot take the name of a built-in one.
    """
    third = {e.name: e.value for e in entry_points(group=GROUP)}
    return third | COMPETITORS | OURS | ANCHORS


def load_planner(spec: str) -> tuple[str, type[Planner]]:
    """Return name and class of the planner that `spec` stands for.

    Args:
        spec: A name, an alias, or `path/to/file.py:ClassName`, whose name is the
            class's.

    Raises:
        PlannerError: If there is no such planner, or it is no complete `Planner`.
    """
    path, _, member = spec.rpartition(":")
    if path.endswith(".py"):
        return member, from_file(spec, Path(path), member)
    name, known = ALIASES.get(spec, spec), planner_names()
    if name not in known:
        raise PlannerError(unknown("planner", spec, [*known, *ALIASES]))
    return name, from_module(spec, known[name])
