"""Who moved whom: causes of displacements, through the contact graph."""

from collections import deque
from collections.abc import Iterable

from beacon_mj.world.outcome import ROBOT, PairForce

LINK_N = 0.5  #: Filtered force above which a contact passes motion on [N].


class Attribution:
    """Remembers the chain robot -> i -> j through which each obstacle was reached."""

    def __init__(self) -> None:
        """Start with no causes."""
        self.chains: dict[str, tuple[str, ...]] = {}
        self._linked: set[str] = set()

    def update(self, contacts: Iterable[PairForce]) -> None:
        """Extend the chains by breadth-first search over one step's contacts.

        The shortest chain wins: an obstacle that the robot touches is a direct push.
        Obstacles not reached in this step keep their last chain, for they may coast.
        """
        neighbours: dict[str, list[str]] = {}
        self._linked = set()
        for contact in contacts:
            if contact.filtered_peak_n > LINK_N:
                neighbours.setdefault(contact.obstacle, []).append(contact.counterpart)
                neighbours.setdefault(contact.counterpart, []).append(contact.obstacle)
        if not neighbours:
            return
        reached: dict[str, tuple[str, ...]] = {ROBOT: ()}
        queue = deque([ROBOT])
        while queue:
            body = queue.popleft()
            for other in neighbours.get(body, ()):
                if other not in reached and other != "wall":
                    reached[other] = (*reached[body], other)
                    queue.append(other)
        del reached[ROBOT]
        self.chains |= reached
        self._linked = set(neighbours)
        self._pass_on(neighbours)

    def forget_resting(self, moving: set[str]) -> None:
        """Drop the chains of obstacles that neither touch anything nor move.

        What moves them later has a cause of its own.
        """
        if not self.chains:
            return
        self.chains = {
            name: chain
            for name, chain in self.chains.items()
            if name in moving or name in self._linked
        }

    def _pass_on(self, neighbours: dict[str, list[str]]) -> None:
        """Pass chains on from coasting obstacles to those they hit."""
        queue = deque(b for b in neighbours if b in self.chains)
        while queue:
            body = queue.popleft()
            for other in neighbours[body]:
                if other in (ROBOT, "wall") or other in self.chains:
                    continue
                self.chains[other] = (*self.chains[body], other)
                queue.append(other)
