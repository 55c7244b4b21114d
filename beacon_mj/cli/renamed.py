"""Options that had other names before version 0.2: each is refused by its new one."""

from collections.abc import Mapping, Sequence

from beacon_mj.errors import RunError

#: New names, by command (empty for every command) and old name.
RENAMED: Mapping[tuple[str, str], str] = {
    ("", "--episodes"): "--scenes-per-family (-n)",
    ("eval", "--scenes"): "--scene-dir",
    ("replay", "--verify"): "beacon-mj verify PATH",
}


def check_names(arguments: Sequence[str]) -> None:
    """Raise RunError if an argument is an option that has another name now."""
    command = next((word for word in arguments if not word.startswith("-")), "")
    for word in arguments:
        check_name(command, word.partition("=")[0])


def check_name(command: str, option: str) -> None:
    """Raise RunError if an option of a command has another name now."""
    for scope in (command, ""):
        if new := RENAMED.get((scope, option)):
            raise RunError(f"{option} was renamed: use {new}.")
