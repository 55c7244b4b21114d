"""The levels of verification, and what came of each."""

from dataclasses import dataclass
from typing import Literal, get_args

#: What a level proves stands in docs/verification.md.
Level = Literal["tables", "scenes", "logs", "planner", "fresh", "published"]
LEVELS: tuple[Level, ...] = get_args(Level)
MOST = 20  #: Problems of one level that are told one by one.


@dataclass(frozen=True, kw_only=True, slots=True)
class Check:
    """What came of one level.

    Attributes:
        level: Its name.
        problems: What does not hold, a line each, beginning with file or folder.
        note: What was compared, or why nothing was, in one line.
    """

    level: Level
    problems: tuple[str, ...] = ()
    note: str

    @property
    def ok(self) -> bool:
        """Whether everything that was compared holds."""
        return not self.problems

    def lines(self) -> list[str]:
        """Return a line a problem, with the level; the last one counts the rest."""
        told = [_line(self.level, text) for text in self.problems[:MOST]]
        if (more := len(self.problems) - MOST) > 0:
            told.append(_line(self.level, f"and {more} more"))
        return told


def _line(level: str, text: str) -> str:
    return f"{level}: {' '.join(text.split())}"
