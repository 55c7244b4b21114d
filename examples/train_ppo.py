"""Train the planner `ppo` with Stable-Baselines3, on a CPU.

Usage: python examples/train_ppo.py [--seeds 0 1 2] [--steps 1.0] [--out runs/ppo]

For each seed it writes `seed-K.npz`, which `--set ppo.weights=FILE` takes, and the
curve `seed-K.csv`. Scenes are those of seed 1000: no seed of a published table.
"""

import argparse
import csv
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from beacon_mj.episode.protocol import Protocol
from beacon_mj.gym import NavigationEnv
from beacon_mj.planners.learned.features import SIZE, Features
from beacon_mj.planners.ppo import HOLD

SCENE_SEED = 1000
SCENES = range(40)  #: Of each family; those from 40 on are for validation.
#: One environment each.
FAMILIES = (
    "sparse",
    "cluttered",
    "collision-required",
    "collision-required",
    "collision-shortcut",
    "lookalike-doors",
    "unweighed-doors",
    "revisited-rooms",
)
#: Worlds one after the other, and decisions in each: first many in the planar world,
#: which costs less, then in MuJoCo, where a blow can break things.
STAGES = (("planar", 60_000), ("mujoco", 40_000))
#: Shorter than in an evaluation, so that fewer steps go into hopeless episodes.
LIMITS = {"max_steps": 500, "stuck_after_s": 10.0}
#: Weights of reward terms in place of the environment's defaults.
REWARD = {"impulse": 0.0}
PARAMETERS: dict[str, Any] = {
    "learning_rate": 5e-4,
    "n_steps": 128,
    "batch_size": 256,
    "n_epochs": 8,
    "gamma": 0.99,
    "gae_lambda": 0.95,
    "clip_range": 0.2,
    "ent_coef": 0.0,
    "max_grad_norm": 0.5,
    "policy_kwargs": {
        "net_arch": [64, 64],
        "activation_fn": torch.nn.ReLU,
        "log_std_init": -0.7,
    },
}


class Decisions(gymnasium.Wrapper):
    """The environment as the planner `ppo` sees it: its features, an action held."""

    def __init__(self, family: str, world: str) -> None:
        """Prepare the environment of one family."""
        protocol = Protocol(world=world, **LIMITS)
        super().__init__(
            NavigationEnv(
                family,
                indices=SCENES,
                seed=SCENE_SEED,
                protocol=protocol,
                weights=REWARD,
                nearest=1,
            )
        )
        self.observation_space = gymnasium.spaces.Box(-2.0, 2.0, (SIZE,), np.float32)
        self._features = Features()

    def reset(self, **_: Any) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin the next scene; the learner's seed does not choose scenes."""
        _, info = self.env.reset()
        self._features.reset(self.env.task)
        self._features.see(self.env.observation)
        return self._vector(), info

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold an action, as the planner does."""
        share, total = self._features.velocity_share(action), 0.0
        for _ in range(HOLD):
            _, reward, terminated, truncated, info = self.env.step(share)
            self._features.see(self.env.observation)
            total += reward
            if terminated or truncated:
                break
        return self._vector(), total, terminated, truncated, info

    def _vector(self) -> np.ndarray:
        return self._features.vector(self.env.observation).astype(np.float32)


class Curve(BaseCallback):
    """Writes after each rollout how the last hundred episodes ended."""

    def __init__(self, path: Path) -> None:
        """Name the file."""
        super().__init__()
        self._path, self._rows = path, deque[Any](maxlen=100)

    def _on_step(self) -> bool:
        self._rows.extend(info["row"] for info in self.locals["infos"] if "row" in info)
        return True

    def _on_rollout_end(self) -> None:
        if not self._rows:
            return
        reached = np.mean([row.outcome == "reached" for row in self._rows])
        clean = np.mean(
            [
                row.outcome == "reached" and not row.obstacles_broken
                for row in self._rows
            ]
        )
        new = not self._path.exists()
        with self._path.open("a", newline="") as file:
            lines = csv.writer(file)
            if new:
                lines.writerow(["decisions", "reached", "clean"])
            lines.writerow([self.num_timesteps, f"{reached:.2f}", f"{clean:.2f}"])


def train(seed: int, share: float, out: Path) -> PPO:
    """Train one seed, write its curve and weights, and return the model.

    Args:
        seed: Of the weights and of the exploration.
        share: Share of the decisions in `STAGES`.
        out: The folder.
    """
    curve = out / f"seed-{seed}.csv"
    curve.unlink(missing_ok=True)
    model = None
    for world, decisions in STAGES:
        makers = [lambda f=f, w=world: Decisions(f, w) for f in FAMILIES]
        envs = VecNormalize(DummyVecEnv(makers), norm_obs=False, gamma=0.99)
        if model is None:
            model = PPO("MlpPolicy", envs, seed=seed, device="cpu", **PARAMETERS)
            with torch.no_grad():  # At first it drives at the goal, more or less.
                model.policy.action_net.bias[0] = 0.8
        else:
            model.set_env(envs)
        model.learn(int(share * decisions), Curve(curve), reset_num_timesteps=False)
        np.savez(out / f"seed-{seed}.npz", **weights(model))
    return model


def weights(model: PPO) -> dict[str, np.ndarray]:
    """Return the layers of the policy's mean, as `load_network` reads them."""

    def layers() -> Iterator[torch.nn.Linear]:
        for module in (model.policy.mlp_extractor.policy_net, model.policy.action_net):
            yield from (m for m in module.modules() if isinstance(m, torch.nn.Linear))

    found = {}
    for k, layer in enumerate(layers()):
        found[f"weight_{k}"] = layer.weight.detach().numpy().astype(np.float32)
        found[f"bias_{k}"] = layer.bias.detach().numpy().astype(np.float32)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--steps", type=float, default=1.0, help="share of STAGES")
    parser.add_argument("--out", type=Path, default=Path("runs/ppo"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)
    for seed in given.seeds:
        train(seed, given.steps, given.out)
