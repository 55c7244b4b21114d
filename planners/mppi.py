"""Contact-aware model-predictive path-integral control in an imagined world.

Weeda, J. J., Bakker, S., Chen, G. and Alonso-Mora, J. "Pushing Through Clutter With
Movability Awareness of Blocking Obstacles", ICRA 2025, arXiv 2502.20106 (SVG-MPPI).
"""

import math
from dataclasses import dataclass

import numpy as np

from beacon_mj.geometry import Array, segment_lengths
from beacon_mj.interface import (
    Command,
    Observation,
    PlannerInfo,
    SensedObstacle,
    Task,
)
from beacon_mj.motion.expansions import ExpansionCount
from beacon_mj.numerics import norms
from beacon_mj.planners.base import Planner
from beacon_mj.planners.checks import expect_between
from beacon_mj.planners.contact.cost_map import ContactMap
from beacon_mj.planners.contact.way_through import way_through
from beacon_mj.planners.imagined import ImaginedWorld, Rollouts
from beacon_mj.planners.recovery import Recovery, give_up
from beacon_mj.streams import stream

_SPACING_M = 0.05  #: Distance of the points of the guide.
_BLOCKED = 100.0  #: Cost of going through what seems not to move, as a last resort.


@dataclass(frozen=True, kw_only=True, slots=True)
class MppiConfig:
    """Parameters of `Mppi`."""

    #: Command sequences that are tried in each control step (K).
    samples: int = 40
    #: Commands in each (H), one for each control period.
    horizon: int = 15
    #: Standard deviation of the noise of a command, along each axis [m/s].
    noise_mps: float = 0.15
    #: Correlation of the noise of one command with that of the next.
    correlation: float = 0.8
    #: Temperature lambda, in metres of way left.
    temperature_m: float = 0.05
    #: Cost of contact: metres of way left for a newton that lasts a second (w_f).
    force_cost: float = 0.01
    #: Cost in the global search of going through what needs all the robot's force, in
    #: metres per metre.
    push_cost: float = 3.0
    #: Obstacles nearest to the robot that the imagined world holds.
    nearest: int = 10

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        expect_between("samples", self.samples, 4, 10_000)
        expect_between("horizon", self.horizon, 2, 100)
        expect_between("noise_mps", self.noise_mps, 0.001, 10.0)
        expect_between("correlation", self.correlation, 0.0, 0.999)
        expect_between("temperature_m", self.temperature_m, 1e-6, 1000.0)
        expect_between("force_cost", self.force_cost, 0.0, 1000.0)
        expect_between("push_cost", self.push_cost, 0.0, 1000.0)
        expect_between("nearest", self.nearest, 0, 100)


class Mppi(Planner[MppiConfig]):
    """Path-integral control along a guide, with contact force as a cost.

    The guide is the cheapest way over a map on which going through an obstacle costs
    by its share of the robot's force. In every control step K command sequences are
    rolled out in a MuJoCo model made of what is perceived (`ImaginedWorld`); half of
    them are the last solution with noise, half the guide at full speed with noise:

        S_k = g(x_H) + 1/H sum_t g(x_t) + w_f sum_t |f_t| T
        w_k = exp(-(S_k - min S) / lambda) / sum_j exp(-(S_j - min S) / lambda)
        u   = sum_k w_k u_k,

    with g the way left along the guide, and beside it, f the normal force on the robot
    and T the control period. The first command of u is given.

    What differs from the paper: its semantic visibility graph is our grid search; what
    is movable is not told but follows from class scores, and from stalls; the proposal
    from the guide is of Trevisan and Alonso-Mora, "Biased-MPPI", RA-L 9(6), 2024.
    """

    Config = MppiConfig

    def reset(self, task: Task) -> None:
        """Forget everything."""
        self._task = task
        self._rng = stream("planner", task.seed, "mppi")
        self._map = ContactMap(task, _SPACING_M, task.radius_m + 0.01)
        self._count = ExpansionCount(self._map)
        self._recovery = Recovery(task)
        self._fixed: set[str] = set()
        self._moved: set[str] = set()
        self._plan = np.zeros((self.config.horizon, 2))
        self._version = -1
        self._guide: Array | None = None

    def act(self, observation: Observation) -> Command:
        """Try commands in the imagined world, and give the first of the best."""
        return self._count.charge(self._decide(observation))

    def _decide(self, observation: Observation) -> Command:
        self._learn(observation)
        recovery = self._recovery.command(observation)
        if recovery is not None:
            self._plan[:] = 0.0
            return recovery
        stale = self._recovery.ended or self._version != observation.map_version
        if stale:
            self._imagine(observation)
        if self._guide is None:
            return give_up("The walls leave no way.")
        guide = _ahead(self._guide, observation.position_m)
        rollouts = self._improve(observation, guide)
        touching = observation.contacts[0].id if observation.contacts else ""
        info = PlannerInfo(
            action="push" if touching else "move",
            reason="The first of the commands that path integrals weigh best.",
            target=touching or None,
            terms={"force_n": float(rollouts.forces_n.mean())},
            path_m=guide,
            replanned=stale,
        )
        return Command(velocity_mps=self._plan[0].copy(), info=info)

    def _learn(self, observation: Observation) -> None:
        """Take what withstood a push, or stopped the robot, for fixed."""
        before = len(self._fixed)
        for evidence in observation.evidence:
            known = self._fixed if evidence.evidence == "not_moved" else self._moved
            known.add(evidence.id)
        if self._recovery.ended:
            self._fixed |= {c.id for c in observation.contacts}
        if len(self._fixed) > before:
            self._version = -1

    def _imagine(self, observation: Observation) -> None:
        """Search the guide, and compile what is near."""
        self._version = observation.map_version
        costs = {i: self._cost(o) for i, o in enumerate(observation.obstacles)}
        movable = {i: cost for i, cost in costs.items() if cost < _BLOCKED}
        radius = self._task.radius_m
        way = way_through(self._map, observation, movable, radius, 0.01)
        if way is None:
            way = way_through(self._map, observation, costs, radius, 0.01)
        self._guide = None if way is None else way.path_m
        gaps = observation.footprints.distance(observation.position_m)
        near = np.argsort(gaps, kind="stable")[: self.config.nearest].tolist()
        fixed = {o.id for i, o in enumerate(observation.obstacles) if i not in movable}
        self._world = ImaginedWorld(observation, self._task, near, fixed)

    def _cost(self, obstacle: SensedObstacle) -> float:
        """Return what going through an obstacle costs in the global search [m/m]."""
        share = obstacle.perceived_force_n / self._task.force_max_n
        safe, movable, fragile = obstacle.scores
        stays = share > 1.0 or safe >= max(movable, fragile)
        if obstacle.id in self._fixed or (stays and obstacle.id not in self._moved):
            return _BLOCKED
        return self.config.push_cost * min(share, 1.0)

    def _improve(self, observation: Observation, guide: Array) -> Rollouts:
        """Replace the plan by the weighted mean of what was tried."""
        self._plan = np.concatenate([self._plan[1:], self._plan[-1:]])
        tried = self._limited(self._proposals(observation, guide))
        rollouts = self._world.roll_out(observation, tried)
        weights = self._weights(self._costs(rollouts, guide))
        self._plan = np.asarray((weights[:, None, None] * tried).sum(axis=0))
        return rollouts

    def _proposals(self, observation: Observation, guide: Array) -> Array:
        """Return the last plan and the guide, each as it is and with noise, (k, h, 2).

        The noise is a first-order process, so that it does not average out.
        """
        cfg, half = self.config, self.config.samples // 2
        keep = cfg.correlation
        noise = self._rng.standard_normal((cfg.samples, cfg.horizon, 2))
        for t in range(1, cfg.horizon):
            fresh = math.sqrt(1.0 - keep * keep) * noise[:, t]
            noise[:, t] = keep * noise[:, t - 1] + fresh
        noise *= cfg.noise_mps
        noise[0] = noise[half] = 0.0
        noise[:half] += self._plan
        noise[half:] += self._along(observation, guide)
        return noise

    def _along(self, observation: Observation, guide: Array) -> Array:
        """Return the commands that follow the guide at full speed, shape (h, 2)."""
        task, h = self._task, self.config.horizon
        arc = np.concatenate([[0.0], np.cumsum(segment_lengths(guide))])
        s = task.speed_mps * task.control_period_s * np.arange(1, h + 1)
        points = np.column_stack([np.interp(s, arc, guide[:, i]) for i in (0, 1)])
        steps = np.diff(np.concatenate([observation.position_m[None], points]), axis=0)
        return np.asarray(steps / task.control_period_s)

    def _limited(self, commands: Array) -> Array:
        """Return commands that are no faster than the robot."""
        speed = np.maximum(norms(commands) / self._task.speed_mps, 1.0)
        return np.asarray(commands / speed[..., None])

    def _costs(self, rollouts: Rollouts, guide: Array) -> Array:
        """Return S of every sequence, shape (k,) [m]."""
        left = _way_left(rollouts.positions_m, guide)
        force_ns = rollouts.forces_n.sum(axis=1) * self._task.control_period_s
        mean = left.sum(axis=1) / left.shape[1]
        return np.asarray(left[:, -1] + mean + self.config.force_cost * force_ns)

    def _weights(self, costs: Array) -> Array:
        """Return the weights of the sequences, which sum to one, shape (k,)."""
        least, scale = float(costs.min()), self.config.temperature_m
        weights = [math.exp(-(cost - least) / scale) for cost in costs.tolist()]
        return np.array(weights) / math.fsum(weights)


def _ahead(path: Array, position: Array) -> Array:
    """Return what is left of a path from the robot on, in short steps, (m, 2) [m]."""
    points = _dense(path)
    nearest = int(np.argmin(norms(points - position)))
    return np.concatenate([position[None], points[nearest + 1 :], path[-1:]])


def _dense(path: Array) -> Array:
    """Return points along a path that are `_SPACING_M` apart at most, (m, 2) [m]."""
    arc = np.concatenate([[0.0], np.cumsum(segment_lengths(path))])
    s = np.linspace(0.0, arc[-1], 2 + int(arc[-1] / _SPACING_M))
    return np.column_stack([np.interp(s, arc, path[:, i]) for i in (0, 1)])


def _way_left(positions: Array, guide: Array) -> Array:
    """Return g: the least of distance to a point of the guide plus the way from there.

    Args:
        positions: Shape (k, h, 2) [m].
        guide: Shape (m, 2) [m].
    """
    steps = segment_lengths(guide)
    rest = np.concatenate([np.cumsum(steps[::-1])[::-1], [0.0]])
    reach = min(len(guide), 2 + int(1.5 / _SPACING_M))
    away = norms(positions[:, :, None] - guide[None, None, :reach])
    return np.asarray((away + rest[:reach]).min(axis=2))
