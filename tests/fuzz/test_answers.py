"""Answers of planners: the episode goes on, or ends as `planner_error`."""

import functools
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import numpy as np
import pytest

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.planners.base import Planner
from beacon_mj.recording import Recorder, verify
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.generate import generate_scene
from tests.fuzz.harness import Kind, Tally, limits
from tests.fuzz.mutations import WILD

HUGE = np.broadcast_to(0.0, (2**14, 2**14))  # Two gigabytes, if it were copied.
STRANGE: tuple[Any, ...] = (
    *WILD, object(), 1j, b"x", HUGE, HUGE[:, :2], np.float32(0.1), np.zeros((2, 2)),
    np.array([0.1, 0.0], np.float32), np.array([1, 0]), np.array(["a", "b"]),
    np.array([None, None]), np.array([0.1, np.nan]), np.array([1e9, 0.0]),
    (0.1, 0.0), [0.1, 0.0], range(2), {0.1, 0.2}, [[0.1, 0.0]], [0.0] * 10**6,
    np.ones(2, bool), np.longdouble(1.0), {"obstacle_00": (0.2, 0.3, 0.5)},
    {"obstacle_00": [0.2, 0.3, 0.5]}, {"nobody": (1.0, 0.0, 0.0)}, {1: 2.0},
    {str(k): 1.0 for k in range(200)}, np.zeros((20_000, 2)), np.zeros((3, 2)),
    "push", "wait", np.str_("move"), ValueError("x"), type, print,
)  # fmt: skip
NO_VELOCITIES: tuple[Any, ...] = ([np.nan, 0.0], [0.1], [[0.1, 0.0]], "ab", None, HUGE)
FIELDS = tuple(PlannerInfo.__dataclass_fields__)


class Input(NamedTuple):
    """What `act` returns, step by step, and whether that must be refused."""

    answers: list[Any]
    invalid: bool = False


class Answers(Planner):
    """Gives what it is told to give."""

    Config = type(None)

    def __init__(self, answers: list[Any]) -> None:
        super().__init__()
        self.answers = answers

    def reset(self, task: Task) -> None:
        pass

    def act(self, observation: Observation) -> Command:
        answer: Command = self.answers[observation.step % len(self.answers)]
        return answer


@functools.cache
def scene() -> Scene:
    return generate_scene("sparse", 0)


def make(rng: Random) -> Input:
    if rng.random() < 0.2:
        velocity: Any = rng.choice(NO_VELOCITIES)
        return Input([Command(velocity_mps=velocity)], invalid=True)
    return Input([_answer(rng) for _ in range(3)])


def _answer(rng: Random) -> Any:
    info: Any = PlannerInfo(reason="fuzz", **_sound(rng))
    velocity: Any = np.array([0.1, 0.05])
    match rng.randrange(12):
        case 0:
            return rng.choice(STRANGE)
        case 1:
            velocity = rng.choice(STRANGE)
        case 2 | 3:
            strange = {name: rng.choice(STRANGE) for name in rng.sample(FIELDS, 2)}
            info = PlannerInfo(**strange)
    return Command(velocity_mps=velocity, info=info, give_up=rng.random() < 0.05)


def _sound(rng: Random) -> dict[str, Any]:
    """Return some fields as a careful planner may fill them."""
    fields: dict[str, Any] = {
        "action": rng.choice(["move", np.str_("move")]),
        "terms": {"a": np.float32(1.0), "b": 10**20, "c": -np.inf},
        "path_m": rng.choice([[[0, 0], [1, 1]], np.zeros((0, 2)), ((0.5, 1), (2, 3))]),
        "cost_push": rng.choice([None, np.inf, 7, np.array(0.25)]),
        "replanned": rng.choice([1, np.True_, False]),
        "expansions": rng.choice([2**53, np.int8(5)]),
    }
    return {name: fields[name] for name in rng.sample([*fields], 3)}


def check(given: Input, folder: Path) -> bool:
    """Run the answers; whatever came of them has to be measured and verified."""
    log = folder / "x.mcap"
    recorder = Recorder(log, row=lambda trace: measure(trace).as_dict())
    trace = run_episode(
        scene(),
        Answers(given.answers),
        protocol=Protocol(max_steps=4, decision_limit_s=3600.0),
        listeners=[recorder],
    )
    failed = trace.outcome == "planner_error"
    assert failed or not given.invalid
    assert not failed or trace.detail
    assert trace.detail.isprintable()
    found = verify(log, row=lambda trace: measure(trace).as_dict())
    assert found.ok, found.problem
    return failed


ANSWERS = Kind("planner answers", make, check)
test_answers, test_answers_long = ANSWERS.short(), ANSWERS.long()


@pytest.mark.parametrize("name", ["velocity_mps", "path_m", "beliefs"])
def test_gigabytes_made_of_one_number_are_not_copied(name: str, tmp_path: Path) -> None:
    given: Any = {"obstacle_00": HUGE} if name == "beliefs" else HUGE
    velocity = given if name == "velocity_mps" else np.zeros(2)
    info = PlannerInfo() if name == "velocity_mps" else PlannerInfo(**{name: given})
    with limits(Tally()):
        assert check(Input([Command(velocity_mps=velocity, info=info)]), tmp_path)


def test_long_answers_are_named_in_short(tmp_path: Path) -> None:
    many: Any = [0.0] * 10**6
    with limits(Tally()):
        assert check(Input([Command(velocity_mps=many)], invalid=True), tmp_path)
