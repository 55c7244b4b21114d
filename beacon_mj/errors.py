"""The errors that beacon-mj raises on bad input, all under one root.

The command line prints any of them in one line and exits with status 2.
"""

import difflib
from collections.abc import Iterable

#: Longest text about an error that goes into a row or onto the terminal.
DETAIL_CHARS = 1000


class BeaconError(Exception):
    """Root of every error that a user of beacon-mj can cause or meet."""


class SceneError(BeaconError):
    """A scene that is not valid, or not the scene that was asked for."""


class MalformedSceneError(SceneError):
    """A scene made in Python that no scene file could hold."""


class TemplateError(BeaconError):
    """A family or obstacle template that cannot be read or used."""


class GenerationError(BeaconError):
    """A family whose scenes could not be generated with a proved certificate."""


class PlannerError(BeaconError):
    """A planner that is unknown, misconfigured, or broke its contract."""


class LogError(BeaconError):
    """A log that cannot be read, or does not prove what it claims."""


class RunError(BeaconError):
    """A run folder or an evaluation option that cannot be used."""


def unknown(kind: str, name: str, known: Iterable[str]) -> str:
    """Return a message for a failed look-up: the nearest name, then all names."""
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=1) or _ends_alike(name, names)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    return f"Unknown {kind} {name!r}.{hint} Available: {', '.join(names) or 'none'}."


def _ends_alike(name: str, names: list[str]) -> list[str]:
    """Return dotted names whose last part is nearest to that of `name`."""
    ends = {other.rpartition(".")[2]: other for other in names}
    near = difflib.get_close_matches(name.rpartition(".")[2], ends, n=1)
    return [ends[end] for end in near]


def one_line(text: str, limit: int = DETAIL_CHARS) -> str:
    """Return a text as one line that every file and terminal can show.

    Spaces are joined; control characters, lone surrogates and whatever else cannot be
    printed are escaped, and what is too long is cut. Of its own result it returns the
    same again.
    """
    head = _escaped(" ".join(text[: 2 * limit].split()))
    return head if len(head) <= limit else head[: limit - 3] + "..."


def printable(text: str) -> str:
    """Return a text as lines that every file and terminal can show.

    What cannot be printed is escaped, but for line ends: no name, reason or path sends
    control characters to a terminal, or hides a part of itself. Of its own result it
    returns the same again.
    """
    return "\n".join(_escaped(line) for line in text.expandtabs().split("\n"))


def _escaped(line: str) -> str:
    if line.isprintable():
        return line
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)


def describe(error: BaseException) -> str:
    """Return an exception as one line, even if its own text cannot be had."""
    name = one_line(str(type.__dict__["__name__"].__get__(type(error))))
    try:
        text = one_line(str.__str__(str(error)))
    except BaseException as second:
        text = f"(no text: {type(second).__name__} in its __str__)"
    return f"{name}: {text}" if text else name
