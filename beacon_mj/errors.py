"""The errors that beacon-mj raises on bad input, all under one root.

The command line prints any of them in one line and exits with status 2.
"""

import difflib
from collections.abc import Iterable


class BeaconError(Exception):
    """Root of every error that a user of beacon-mj can cause or meet."""


class SceneError(BeaconError):
    """A scene that is not valid, or not the scene that was asked for."""


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
