"""Telling a planner the route graph of a scene: what its certificate is about."""

from msgspec import UNSET

from beacon_mj.planners.routes.graph import RouteGraph, StageRef
from beacon_mj.scene import Scene, door_problem


def route_graph(scene: Scene) -> RouteGraph | None:
    """Return the route graph of a scene; None if it has no certificate of learning."""
    learning = scene.certificate.learning
    if learning is UNSET:
        return None
    return RouteGraph(
        problem=door_problem(learning.parts, learning.fail_s, learning.pass_s),
        doors=tuple(part.doors for part in learning.parts),
        today=stages_of_day(scene),
    )


def stages_of_day(scene: Scene) -> tuple[StageRef, ...]:
    """Return the stages between a scene's start and goal; of a mission, the day's."""
    learning = scene.certificate.learning
    if learning is UNSET:
        return ()
    refs = [
        StageRef(p, s)
        for p, part in enumerate(learning.parts)
        for s in range(len(part.stages))
    ]
    if scene.days is UNSET or scene.day is UNSET:
        return tuple(refs)
    each = len(refs) // scene.days  # What is left over, no scene has.
    return tuple(refs[each * scene.day : each * (scene.day + 1)])
