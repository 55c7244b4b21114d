"""Where in a log a viewer stands: playing, paused, or moved by keys."""

SPACE, RIGHT, LEFT, DOWN, UP = 32, 262, 263, 264, 265  #: GLFW's codes of keys.
HOME, END = 268, 269
JUMP_S = 1.0  #: How far the up and down arrows go [s].
HELP = "space: pause   left, right: one step   up, down: one second   home, end"


class Scrubber:
    """Goes through the steps of a log in real time, and wherever keys say.

    Attributes:
        paused: Whether time stands still.
    """

    def __init__(self, steps: int, period_s: float) -> None:
        """Start to play at the beginning.

        Args:
            steps: Number of control steps.
            period_s: Time of a step [s].
        """
        self._end_s, self._period_s = steps * period_s, period_s
        self._steps, self._time_s = steps, 0.0
        self.paused = False

    @property
    def step(self) -> int:
        """The step to show, 0 to the number of steps."""
        return min(self._steps, int(self._time_s / self._period_s + 1e-6))

    def advance(self, elapsed_s: float) -> None:
        """Play on for a while; the end stays."""
        if not self.paused:
            self._time_s = min(self._end_s, self._time_s + elapsed_s)

    def press(self, key: int) -> None:
        """Act on a key; those that move also pause, other keys do nothing."""
        if key == SPACE:
            self._toggle()
            return
        jump = round(JUMP_S / self._period_s)
        moves = {RIGHT: 1, LEFT: -1, UP: jump, DOWN: -jump}
        moves |= {HOME: -self._steps, END: self._steps}
        if key in moves:
            self.paused = True
            step = max(0, min(self._steps, self.step + moves[key]))
            self._time_s = step * self._period_s

    def _toggle(self) -> None:
        """Pause or play; playing on at the end starts again."""
        self.paused = not self.paused
        if not self.paused and self.step == self._steps:
            self._time_s = 0.0
