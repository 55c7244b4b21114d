"""A policy that learned by trial and error, with proximal policy optimisation."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.checks import expect
from beacon_mj.planners.learned.features import SIZE, Features
from beacon_mj.planners.learned.network import load_network

#: Control steps for which an action holds, in training as well.
HOLD = 3
SHIPPED = Path(__file__).parent / "learned" / "ppo.npz"


@dataclass(frozen=True, kw_only=True, slots=True)
class PpoConfig:
    """Which weights `Ppo` decides by."""

    #: File of weights that `examples/train_ppo.py` wrote; empty for the shipped ones.
    weights: str = ""

    def __post_init__(self) -> None:
        """Check that the file is there.

        Raises:
            PlannerError: If it is not.
        """
        there = not self.weights or Path(self.weights).is_file()
        expect("weights", self.weights, "an existing file, or empty", there)


class Ppo(Planner[PpoConfig]):
    """A neural network decides; proximal policy optimisation made its weights.

        a = W_2 relu(W_1 relu(W_0 x + b_0) + b_1) + b_2

    with x the vector of `Features`, which holds history, and a the share of the speed
    towards the goal and to the left of it, held for 0.3 s. It is the mean of the
    Gaussian policy that was trained.

    Schulman, J. et al. "Proximal Policy Optimization Algorithms", arXiv 1707.06347,
    2017; Raffin, A. et al. "Stable-Baselines3", JMLR 22(268), 2021. Evaluation needs
    neither: it is NumPy's products and sums.
    """

    Config = PpoConfig
    bit_reproducible: ClassVar[bool] = False

    def __init__(self, config: PpoConfig | None = None) -> None:
        """Load the weights.

        Raises:
            PlannerError: If they are no good.
        """
        super().__init__(config)
        self._network = load_network(self.config.weights or SHIPPED, SIZE, 2)
        self._features = Features()

    def reset(self, task: Task) -> None:
        """Forget everything."""
        self._task = task
        self._features.reset(task)
        self._velocity_mps = np.zeros(2)

    def act(self, observation: Observation) -> Command:
        """Decide anew every third control step."""
        self._features.see(observation)
        decides = observation.step % HOLD == 0
        if decides:
            action = self._network(self._features.vector(observation))
            share = self._features.velocity_share(action)
            self._velocity_mps = self._task.speed_mps * share
        info = PlannerInfo(
            reason="What the network says." if decides else "The same for a while.",
            target=observation.contacts[0].id if observation.contacts else None,
            replanned=decides,
        )
        return Command(velocity_mps=self._velocity_mps, info=info)
