"""What one obstacle's push tells about the force that all others need.

Beyond the paper, where each force is perceived on its own (II.D).
"""

import math

_FLOOR = 1e-6  #: Least likelihood, so that no surprise ends in 0 / 0.
_POINTS = 177  #: Points of the grid over the logarithm of the scale; odd, so one is 0.
_REACH = 3.2  #: Half width of that grid in standard deviations of the prior.
#: Force that an obstacle is felt to move at, over the one it needs: the bumper's
#: filter and the drive's ramp let it overshoot by so much.
OVERSHOOT = (1.05, 1.9)


class ScaleBelief:
    """One factor s between all perceived forces and the true ones.

        F_i = s F_i^perceived e_i,  ln s ~ N(0, sigma),  ln e_i ~ N(0, sigma_i),

    on a grid of ln s. An obstacle that moved at force f needed between f / 1.9 and
    f / 1.05; one that did not needs more, if its class lets it move at all.
    """

    def __init__(self, scale_error: float, own_error: float) -> None:
        """Start from the sensor's data sheet.

        Args:
            scale_error: sigma, >= 0; with 0 the scale is known to be one.
            own_error: sigma_i, > 0.
        """
        self._own = own_error * math.sqrt(2.0)
        count = _POINTS if scale_error > 0.0 else 1
        reach = _REACH * scale_error
        self._logs = [
            reach * (2.0 * k / (count - 1) - 1.0) if count > 1 else 0.0
            for k in range(count)
        ]
        density = [
            math.exp(-0.5 * (g / scale_error) * (g / scale_error)) if g else 1.0
            for g in self._logs
        ]
        total = math.fsum(density)
        self.weights = [d / total for d in density]

    @property
    def factor(self) -> float:
        """The geometric mean of s."""
        pairs = zip(self.weights, self._logs, strict=True)
        return math.exp(math.fsum(w * g for w, g in pairs))

    def probability_below(self, perceived_n: float, limit_n: float) -> float:
        """Return P(F_i < limit) of an obstacle that was not pushed.

        Args:
            perceived_n: F_i^perceived [N].
            limit_n: The limit [N].
        """
        return math.fsum(
            w * p
            for w, p in zip(
                self.weights, self._below(perceived_n, limit_n), strict=True
            )
        )

    def learn(
        self, perceived_n: float, evidence: str, force_n: float, gives_way: float
    ) -> None:
        """Take in how one push attempt ended.

        Args:
            perceived_n: The obstacle's perceived force [N].
            evidence: `moved`, `not_moved` or `broken`; the last says nothing here.
            force_n: The force that it moved at, or that it withstood [N].
            gives_way: Probability, before this push, that its class moves at all.
        """
        if evidence == "broken":
            return
        if evidence == "moved":
            high = self._below(perceived_n, force_n / OVERSHOOT[0])
            low = self._below(perceived_n, force_n / OVERSHOOT[1])
            likelihood = [a - b for a, b in zip(high, low, strict=True)]
        else:
            moves = self._below(perceived_n, force_n)
            likelihood = [1.0 - gives_way * p for p in moves]
        joint = [
            w * max(p, _FLOOR) for w, p in zip(self.weights, likelihood, strict=True)
        ]
        total = math.fsum(joint)
        self.weights = [w / total for w in joint]

    def _below(self, perceived_n: float, limit_n: float) -> list[float]:
        """Return P(F_i < limit) at each point of the grid."""
        spare = math.log(limit_n / max(perceived_n, 1e-6))
        return [0.5 * math.erfc(-(spare - g) / self._own) for g in self._logs]
