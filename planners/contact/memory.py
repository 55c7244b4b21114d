"""What the loop and its policy remember: for a moment, for a day, for a mission."""

from typing import Any

from beacon_mj.interface import Observation, Task
from beacon_mj.planners.contact.attempts import Attempts
from beacon_mj.planners.contact.policy import PushPolicy


class Memory:
    """Failed pushes, and the policy's beliefs, from one day to the next.

    `belief.overnight` says what is kept. Nobody tells whether a room changes overnight:
    once something behaves otherwise than on an earlier day, or nothing is left to try,
    all that earlier days have shown is forgotten, and nothing is kept any more.

    Attributes:
        attempts: Failed pushes, and what was pushed a moment ago.
    """

    def __init__(self, policy: PushPolicy[Any]) -> None:
        """Remember for the loop, and through `policy`."""
        self._policy = policy
        self._room_changes = False
        self.attempts = Attempts()

    def reset(self, task: Task) -> None:
        """Forget everything."""
        self._policy.reset(task)
        self._room_changes = False
        self.attempts = Attempts(self._policy.belief_settings.failures_last_s)

    def next_day(self, task: Task) -> None:
        """Keep what `belief.overnight` says, while rooms stay as they are."""
        settings, changes = self._policy.belief_settings, self._room_changes
        if changes or not settings.failures_overnight:
            self.reset(task)
            self._room_changes = changes
        else:
            self._policy.next_day(task)
            self.attempts = self.attempts.overnight()

    def learn(self, observation: Observation) -> bool:
        """Take in what is seen and felt; return whether plans are stale."""
        stale = False
        self._policy.observe(observation)
        self.attempts.forget(observation.time_s)
        for evidence in observation.evidence:
            if self._policy.contradicts(evidence):
                stale |= self.doubt(observation)
            stale |= self._policy.learn(evidence)
            self.attempts.learn(evidence)
        return stale

    def doubt(self, observation: Observation) -> bool:
        """Forget what earlier days have shown; return whether that was anything."""
        failures = self.attempts.doubt()
        beliefs = self._policy.doubt(observation)
        self._room_changes |= failures or beliefs
        return failures or beliefs
