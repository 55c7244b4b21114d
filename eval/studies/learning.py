"""What learning saved, against what it would have saved the optimum in the same worlds.

Two planners cross the same scenes, one that learns from its pushes and one that does
not. In scene k, with T the simulated times,

    realised_k = T_without,k - T_learner,k
    actual_k   = T_memoryless,k - T_updating,k,

the second of the two optimal policies of the scene's certificate, driven on the route
graph through the scene's actual world (`beacon_mj.learning.saving`). The actual world
is known to an evaluation only: nothing of this is stored in a scene, or promised.

Units are scenes; of a mission, all its days together. Only units that both planners
solved count: the time of an episode that failed says nothing.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from msgspec import UNSET

from beacon_mj.episode.routes import stages_of_day
from beacon_mj.errors import RunError, unknown
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import RunConfig, SceneRef, load_ref, scene_refs
from beacon_mj.eval.statistics.intervals import (
    Interval,
    correlation_interval,
    mean_interval,
)
from beacon_mj.eval.statistics.results import Results
from beacon_mj.learning import ActualSaving, actual_saving
from beacon_mj.scene import LearningCertificate, Scene, door_problem


class Saving(NamedTuple):
    """One scene, or one mission.

    Attributes:
        family: Its family.
        number: Index of the scene, or number of the mission.
        certified_s: Value of learning, in expectation over the prior [s].
        optimum: Times of the optimal policies in the actual world.
        without_s: Simulated time of the planner that does not learn [s].
        learner_s: That of the one that does [s].
        solved: Whether both reached every goal.
    """

    family: str
    number: int
    certified_s: float
    optimum: ActualSaving
    without_s: float
    learner_s: float
    solved: bool

    @property
    def realised_s(self) -> float:
        """What learning saved [s]."""
        return self.without_s - self.learner_s


class FamilySavings(NamedTuple):
    """All scenes, or missions, of a family; means with 95 % intervals [s].

    Attributes:
        family: The family.
        solved: Scenes that both planners solved, which are the ones that count.
        of: All scenes.
        certified_s: Mean value of learning.
        least_s: The least one.
        actual_s: What learning saves the optimum in the actual worlds.
        realised_s: What it saved.
        correlation: Pearson's r of the last two.
        optimum_s: Time of the updating optimum in the actual worlds.
        learner_s: Time of the planner that learns.
        times_correlation: Pearson's r of the last two.
    """

    family: str
    solved: int
    of: int
    certified_s: float
    least_s: float
    actual_s: Interval
    realised_s: Interval
    correlation: Interval
    optimum_s: Interval
    learner_s: Interval
    times_correlation: Interval


def savings(run: Results, without: str, learner: str) -> list[Saving]:
    """Return the savings of every scene, or mission, that both planners crossed.

    Args:
        run: The run.
        without: The planner that does not learn.
        learner: The one that does.

    Raises:
        RunError: If there is no such planner, no scene has a certificate of learning,
            or the scenes of the run cannot be made again.
    """
    arms = [_rows(run, name) for name in (without, learner)]
    found = []
    for days in _units(run.config, arms[0].keys() & arms[1].keys()):
        keys = [(scene.family, scene.index) for scene in days]
        _check_scenes(run, days, [arms[0][key] for key in keys])
        found.append(_saving(days, *([arm[key] for key in keys] for arm in arms)))
    if not found:
        raise RunError(
            f"{run.folder}: expected whole scenes, or missions, with a certificate of "
            f"learning that {without} and {learner} crossed but there is none; those "
            "of lookalike-doors have one."
        )
    return found


def by_family(found: Sequence[Saving]) -> list[FamilySavings]:
    """Return the savings by family, in order."""
    names = dict.fromkeys(each.family for each in found)
    return [_family([s for s in found if s.family == name]) for name in names]


def actual_outcomes(days: Sequence[Scene]) -> list[list[bool]]:
    """Return whether each door truly opens, by part and number.

    Args:
        days: The scene; of a mission, the scenes of all its days in order.
    """
    certificate = _certificate(days[0])
    truth = [_opens(scene) for scene in days]
    first = dict[int, dict[str, bool]]()
    for scene, opens in zip(days, truth, strict=True):
        for ref in stages_of_day(scene):
            first.setdefault(ref.part, opens)
    return [
        [first[p][door] for door in part.doors]
        for p, part in enumerate(certificate.parts)
    ]


def _rows(run: Results, name: str) -> dict[tuple[str, int], Row]:
    if name not in run.planners:
        raise RunError(f"{run.folder}: {unknown('planner', name, run.planners)}")
    return {(row.family, row.scene_index): row for row in run.planners[name]}


def _units(
    config: RunConfig, keys: Iterable[tuple[str, int]]
) -> Iterator[tuple[Scene, ...]]:
    """Yield the scenes, and whole missions, of some families and indices."""
    keys, missions = {*keys}, dict[tuple[str, int], list[Scene]]()
    for ref in scene_refs(config)[1]:
        scene = (
            _learning_scene(config, ref) if (ref.family, ref.index) in keys else None
        )
        if scene is None:
            continue
        if scene.days is UNSET or scene.mission is UNSET:
            yield (scene,)
            continue
        days = missions.setdefault((scene.family, scene.mission), [])
        days.append(scene)
        if len(days) == scene.days:
            yield tuple(days)


def _learning_scene(config: RunConfig, ref: SceneRef) -> Scene | None:
    scene = load_ref(config, ref)
    return None if scene.certificate.learning is UNSET else scene


def _check_scenes(run: Results, days: Sequence[Scene], rows: Sequence[Row]) -> None:
    for scene, row in zip(days, rows, strict=True):
        if scene.sha256 != row.scene_sha256:
            raise RunError(
                f"{run.folder}: expected {scene.name} as it was run but it is another "
                "scene now; its family or the generator has changed."
            )


def _saving(
    days: Sequence[Scene], without: Sequence[Row], learner: Sequence[Row]
) -> Saving:
    scene, certificate = days[0], _certificate(days[0])
    problem = door_problem(certificate.parts, certificate.fail_s, certificate.pass_s)
    return Saving(
        family=scene.family,
        number=scene.index if scene.mission is UNSET else scene.mission,
        certified_s=certificate.value_s,
        optimum=actual_saving(problem, actual_outcomes(days)),
        without_s=sum(row.sim_time_s for row in without),
        learner_s=sum(row.sim_time_s for row in learner),
        solved=all(row.success for row in (*without, *learner)),
    )


def _certificate(scene: Scene) -> LearningCertificate:
    learning = scene.certificate.learning
    if learning is UNSET:
        raise RunError(f"{scene.name}: expected a certificate of learning.")
    return learning


def _opens(scene: Scene) -> dict[str, bool]:
    """Return whether the robot can truly move each obstacle."""
    return {o.id: o.pushable(scene.robot.force_max_n) for o in scene.obstacles}


def _family(own: Sequence[Saving]) -> FamilySavings:
    solved = [s for s in own if s.solved]
    actual = [s.optimum.saving_s for s in solved]
    realised = [s.realised_s for s in solved]
    optimum = [s.optimum.updating_s for s in solved]
    learner = [s.learner_s for s in solved]
    certified = [s.certified_s for s in own]
    return FamilySavings(
        family=own[0].family,
        solved=len(solved),
        of=len(own),
        certified_s=float(np.mean(certified)),
        least_s=min(certified),
        actual_s=mean_interval(actual),
        realised_s=mean_interval(realised),
        correlation=correlation_interval(actual, realised),
        optimum_s=mean_interval(optimum),
        learner_s=mean_interval(learner),
        times_correlation=correlation_interval(optimum, learner),
    )
