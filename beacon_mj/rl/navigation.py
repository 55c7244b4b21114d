"""One episode after another, for whoever decides by arrays."""

import math
import time
from pathlib import Path
from typing import Any, NamedTuple

from beacon_mj.episode.episode import Episode, Listener
from beacon_mj.episode.trace import Outcome, Trace
from beacon_mj.errors import PlannerError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.jobs import planner_seed
from beacon_mj.eval.runs.scene_cache import cached_scene
from beacon_mj.interface import Command
from beacon_mj.recording import Recorder
from beacon_mj.rl.observer import Observer
from beacon_mj.rl.options import Options
from beacon_mj.rl.order import SceneOrder
from beacon_mj.rl.parts import Values
from beacon_mj.rl.rewards import checked_weights, reward_terms
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.suites import suite_of
from beacon_mj.world import BaseWorld

#: Outcomes that belong to the task. The others cut an episode off: limits of the
#: protocol that no state shows, and physics that diverged.
TERMINAL: frozenset[Outcome] = frozenset({"reached", "battery_empty"})


class Step(NamedTuple):
    """What came of one action.

    Attributes:
        observation: The observation after it.
        terms: Weighted reward terms.
        outcome: How the episode ended with it; None if it goes on.
    """

    observation: dict[str, Values]
    terms: dict[str, float]
    outcome: Outcome | None

    @property
    def reward(self) -> float:
        """The sum of the terms."""
        return math.fsum(self.terms.values())

    @property
    def terminated(self) -> bool:
        """Whether the episode ended as the task has it."""
        return self.outcome in TERMINAL

    @property
    def truncated(self) -> bool:
        """Whether the episode was cut off."""
        return self.outcome is not None and not self.terminated


class Navigation:
    """Episodes in the scenes of one family.

    Attributes:
        observer: What makes observations.
        order: Which scene comes next.
        episode: The episode that goes on; None before the first one.
    """

    episode: Episode | None = None

    def __init__(self, options: Options) -> None:
        """Prepare; no scene is made yet.

        Raises:
            BeaconError: If a value is no good.
        """
        self._options = options
        self._suite = suite_of(options.family, options.folder)
        self._weights = checked_weights(options.weights)
        self._world: BaseWorld | None = None
        self.order = SceneOrder(options.indices, options.seed)
        self.observer = Observer(options.nearest, options.rules.lidar_beams or 0)

    def begin(self, index: int | None = None) -> dict[str, Values]:
        """Start an episode; return its first observation.

        Args:
            index: The scene; None for the next one in the order.
        """
        scene = self._scene(self.order.next() if index is None else index)
        seed = planner_seed(self.order.seed, scene.family, scene.index)
        self._row: Row | None = None
        self.episode = Episode(
            scene,
            self._options.rules,
            self._options.name,
            seed=seed,
            listeners=self._listeners(scene, seed),
            world=self._kept(scene),
            suite=self._suite,
        )
        self._world = self.episode.world
        self.observer.reset(self.episode.task)
        return self._observed(self.episode)

    def step(self, action: Any) -> Step:
        """Do an action for one control period.

        Args:
            action: Share of the robot's speed along east and north, shape (2,); above a
                length of one it is scaled down.

        Raises:
            PlannerError: If it is no such action, or no episode goes on.
        """
        decision_s = time.perf_counter() - self._told_s if self.episode else 0.0
        episode = self.running()
        command = Command(velocity_mps=self.observer.velocity_mps(action))
        before_m, count = episode.world.position_m, len(episode.trace.steps)
        episode.step(command, decision_s)
        outcome, terms = episode.trace.outcome, dict.fromkeys(self._weights, 0.0)
        if len(episode.trace.steps) > count:
            record, goal_m = episode.trace.steps[-1], episode.task.goal_m
            terms = reward_terms(self._weights, before_m, record, outcome, goal_m)
        if outcome is not None:
            episode.close()
        return Step(self._observed(episode), terms, outcome)

    def running(self) -> Episode:
        """Return the episode that goes on. Raises PlannerError if there is none."""
        if self.episode is None or self.episode.trace.outcome is not None:
            raise PlannerError("Expected reset() before step() but no episode goes on.")
        return self.episode

    def row(self) -> Row:
        """Return the row of the episode that ended: the one of an evaluation."""
        assert self.episode is not None
        if self._row is None:
            self._row = measure(self.episode.trace)
        return self._row

    def _observed(self, episode: Episode) -> dict[str, Values]:
        found = self.observer.arrays(episode.observation)
        self._told_s = time.perf_counter()
        return found

    def _scene(self, index: int) -> Scene:
        own, seed = self._options, self.order.seed
        return cached_scene(own.family, index, seed, own.perception, own.folder)

    def _kept(self, scene: Scene) -> BaseWorld | None:
        """Return the last world if it is of this scene: compiling takes time."""
        same = self._world is not None and self._world.scene == scene
        return self._world if same else None

    def _listeners(self, scene: Scene, seed: int) -> list[Listener]:
        if self._options.log_dir is None:
            return []

        def row(trace: Trace) -> dict[str, Any]:
            return self.row().as_dict()

        path = Path(self._options.log_dir) / f"{scene.name}.mcap"
        return [Recorder(path, planner_config={}, seed=seed, row=row)]
