"""Does a planner keep the contract? A public check, run over everything registered."""

import math
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.rollout import truth_about
from beacon_mj.episode.run import make_task, run_episode
from beacon_mj.episode.sensor import Sensor
from beacon_mj.errors import PlannerError
from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.oracle.truth import Oracle
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import World

STEPS = 40  #: Control steps for which a planner is watched.


def check_planner(
    planner: type[Planner] | Planner, scene: Scene | None = None, steps: int = STEPS
) -> None:
    """Check that a planner keeps its contract (see `Planner`).

    It is built from its defaults, driven through a scene twice, and must be a
    deterministic function of what it observes, leave the observation as it was, and
    return commands with a finite velocity and sound reasons.

    Args:
        planner: A planner's class, or one that was built.
        scene: Where to drive; a scene of family `collision-required` if None.
        steps: Control steps to drive.

    Raises:
        PlannerError: Naming the planner, what was expected, and what it did.
    """
    cls = planner if isinstance(planner, type) else type(planner)
    build: Callable[[], Planner] = (
        planner if isinstance(planner, type) else lambda: planner
    )
    if missing := cls.missing():
        raise PlannerError(
            f"{cls.__name__}: expected a complete planner but it lacks "
            f"{', '.join(missing)}."
        )
    _check_config(cls)
    scene = generate_scene("collision-required", 0) if scene is None else scene
    first = _drive(build(), cls.__name__, scene, steps)
    again = _drive(build(), cls.__name__, scene, steps)
    if first != again:
        step = next(
            k for k, (a, b) in enumerate(zip(first, again, strict=False)) if a != b
        )
        raise PlannerError(
            f"{cls.__name__}: expected the same commands after the same task and "
            f"observations but they differ in step {step}."
        )


def _check_config(cls: type[Planner]) -> None:
    config = getattr(cls, "Config", None)
    if not (isinstance(config, type) and is_dataclass(config)):
        raise PlannerError(
            f"{cls.__name__}: expected Config to be a dataclass but it was {config!r}."
        )
    if not config.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        raise PlannerError(f"{cls.__name__}: expected Config to be frozen.")
    try:
        config()
    except TypeError as error:
        raise PlannerError(
            f"{cls.__name__}: expected a default for every field of Config: {error}."
        ) from error


def _drive(
    planner: Planner, name: str, scene: Scene, steps: int
) -> list[tuple[float, ...]]:
    """Return what the planner commands over some steps, checking each."""
    protocol = Protocol()
    world = World(scene)
    sensor = Sensor(world, protocol)
    task = make_task(scene, protocol, seed=1)
    if isinstance(planner, Oracle):
        planner.set_truth(truth_about(scene, protocol, run_episode))
    _guarded(name, "reset", planner.reset, task)
    observation = sensor.observe(None, 1.0)
    commands = []
    for _ in range(steps):
        before = _frozen(observation)
        command = _guarded(name, "act", planner.act, observation)
        if not _same(before, _frozen(observation)):
            raise PlannerError(
                f"{name}: expected act() to leave the observation alone."
            )
        velocity = _check_command(name, command, task, observation)
        commands.append((*velocity.tolist(), float(command.give_up)))
        if command.give_up:
            break
        observation = sensor.observe(world.step(velocity), 1.0)
    return commands


def _guarded(name: str, method: str, call: Callable[[Any], Any], argument: Any) -> Any:
    try:
        return call(argument)
    except Exception as error:
        raise PlannerError(
            f"{name}: expected {method}() not to raise but it raised "
            f"{type(error).__name__}: {error}."
        ) from error


def _check_command(
    name: str, command: object, task: Task, observation: Observation
) -> np.ndarray:
    if not isinstance(command, Command):
        raise PlannerError(
            f"{name}: expected act() to return a Command but it was "
            f"{type(command).__name__}."
        )
    velocity = np.asarray(command.velocity_mps, dtype=float)
    if velocity.shape != (2,) or not np.isfinite(velocity).all():
        raise PlannerError(
            f"{name}: expected a finite velocity of shape (2,) but it was {velocity}."
        )
    _check_info(name, command.info, observation)
    return velocity


def _check_info(name: str, info: PlannerInfo, observation: Observation) -> None:
    known = {o.id for o in observation.obstacles}
    for obstacle, p in info.beliefs.items():
        if obstacle not in known:
            raise PlannerError(
                f"{name}: expected beliefs about sensed obstacles but {obstacle!r} "
                "was not sensed."
            )
        if len(p) != 3 or min(p) < 0.0 or not math.isclose(sum(p), 1.0, abs_tol=1e-6):
            raise PlannerError(
                f"{name}: expected a belief to be three probabilities that sum to 1 "
                f"but that about {obstacle!r} was {p}."
            )
    shape = (0, 2) if info.path_m is None else np.shape(info.path_m)
    if len(shape) != 2 or shape[1] != 2:
        raise PlannerError(
            f"{name}: expected path_m of shape (m, 2) but it was {shape}."
        )


def _frozen(observation: Observation) -> list[np.ndarray]:
    """Return copies of every array that an observation holds."""
    values = [getattr(observation, field.name) for field in fields(observation)]
    arrays = [value for value in values if isinstance(value, np.ndarray)]
    arrays += [observation.footprints.vertices, observation.footprints.radius]
    for obstacle in observation.obstacles:
        arrays += [obstacle.footprint.vertices, obstacle.centroid_m]
    arrays += [contact.normal for contact in observation.contacts]
    return [array.copy() for array in arrays]


def _same(first: list[np.ndarray], second: list[np.ndarray]) -> bool:
    return len(first) == len(second) and all(
        np.array_equal(a, b) for a, b in zip(first, second, strict=True)
    )
