"""Counting what searches expand: each vertex once, in the step in which it happens."""

from dataclasses import replace
from typing import Protocol

from beacon_mj.interface import Command


class Search(Protocol):
    """Whatever searches, and counts."""

    @property
    def expansions(self) -> int:
        """Vertices expanded so far; never falls while it is watched."""


class ExpansionCount:
    """Tells of several searches how much they have worked since the last command.

    Searches count for their whole life, so nothing is lost when one of them runs
    twice in a step, or in a step that ends early.
    """

    def __init__(self, *searches: Search) -> None:
        """Watch some searches from now on."""
        self._searches = list(searches)
        self._charged = 0

    def watch(self, search: Search) -> None:
        """Watch another search, from its beginning."""
        self._searches.append(search)

    def charge(self, command: Command) -> Command:
        """Return the command of a step with what was expanded for it in its info."""
        total = sum(search.expansions for search in self._searches)
        new, self._charged = total - self._charged, total
        if new == 0:
            return command
        return replace(command, info=replace(command.info, expansions=new))
