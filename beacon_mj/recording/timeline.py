"""What was going on, as states that begin and end: the messages of `/timeline`.

Viewers draw a state as a bar that lasts until another value comes. What is an event, or
absent, would be a bar without an end.
"""

from typing import Any

from beacon_mj.interface import PlannerInfo
from beacon_mj.recording.drawing import NS
from beacon_mj.recording.messages import message
from beacon_mj.world.pushes import AttemptEnd

NOTHING = "none"  #: The state where there is no target, or no new evidence.
EVIDENCE_NS = 1 * NS  #: How long what a push showed is told [ns].


class Timeline:
    """Follows one episode.

    Attributes:
        state: The last message; None before the first.
    """

    def __init__(self) -> None:
        """Begin with nothing."""
        self.state: Any = None
        self._values: tuple[str, str, str] | None = None
        self._evidence, self._until_ns = NOTHING, 0

    def pushed(self, attempt: AttemptEnd, time_ns: int) -> None:
        """Take note of how a push attempt ended; the next state tells it."""
        self._evidence, self._until_ns = attempt.evidence, time_ns + EVIDENCE_NS

    def decided(self, info: PlannerInfo, time_ns: int) -> Any | None:
        """Return the state from now on, None if it is the same as before."""
        push = self._evidence if time_ns < self._until_ns else NOTHING
        target = info.target or NOTHING
        if (info.action, target, push) == self._values:
            return None
        self._values = info.action, target, push
        kind = message("beacon_mj.Timeline")
        self.state = kind(action=info.action, target=target, push=push)
        return self.state
