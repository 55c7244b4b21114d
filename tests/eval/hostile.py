"""Planners that misbehave, loaded by path as a user's own would be."""

import os
import signal
import sys
import time
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.base import Planner


@dataclass(frozen=True, kw_only=True, slots=True)
class HarmConfig:
    """When the planner does harm."""

    #: Decision at which it happens.
    at: int = 3
    #: Scene in which it happens; -1 for all.
    seed: int = -1


class Harmless(Planner):
    Config: ClassVar[type[HarmConfig]] = HarmConfig
    config: HarmConfig

    def reset(self, task: Task) -> None:
        self._decisions = 0

    def act(self, observation: Observation) -> Command:
        self._decisions += 1
        if self._decisions == self.config.at:
            self.harm()
        return Command(velocity_mps=np.array([0.1, 0.0]))

    def harm(self) -> None:
        pass


class Raises(Harmless):
    def harm(self) -> None:
        raise ZeroDivisionError("by hand")


class ReturnsNan(Harmless):
    def act(self, observation: Observation) -> Command:
        return Command(velocity_mps=np.array([np.nan, 0.0]))


class Exits(Harmless):
    def harm(self) -> None:
        sys.exit(0)


class Hangs(Harmless):
    def harm(self) -> None:
        while True:
            try:
                time.sleep(60.0)
            except Exception:
                continue


class Dies(Harmless):
    def harm(self) -> None:
        os.kill(os.getpid(), signal.SIGKILL)


class FailsToBuild(Harmless):
    def __init__(self, config: HarmConfig | None = None) -> None:
        raise OSError("no licence")


class Unfinished(Planner):
    """Has no act()."""

    def reset(self, task: Task) -> None:
        pass
