"""Planners that are programs of their own, in any language: `exec:COMMAND`.

The command is split as a shell does, and run by no shell.
"""

import os
import shlex
import shutil
from pathlib import Path

from beacon_mj.errors import PlannerError

PREFIX = "exec:"
#: How the names of scripts and archives end that another program runs.
SCRIPTS = frozenset(
    {".jar", ".jl", ".js", ".lua", ".m", ".pl", ".py", ".r", ".R", ".rb"}
)


def is_program(spec: str) -> bool:
    """Whether a planner is given as a command."""
    return spec.startswith(PREFIX)


def program_words(spec: str) -> list[str]:
    """Return the program and its arguments.

    Raises:
        PlannerError: If there is none.
    """
    try:
        words = shlex.split(spec.removeprefix(PREFIX))
    except ValueError as error:
        raise PlannerError(f"{spec}: expected a command: {error}.") from error
    if not words:
        raise PlannerError(f"Expected {PREFIX}COMMAND but there is no command.")
    return words


def program_name(spec: str) -> str:
    """Return what results call it: the stem of the program, or of its script.

    A script is the first argument that ends as scripts do, as in
    `exec:python3 my_planner.py`.
    """
    first, *rest = program_words(spec)
    scripts = (word for word in rest if Path(word).suffix in SCRIPTS)
    return Path(next(scripts, first)).stem


def whole_program(spec: str) -> str:
    """Return a spec that means the same program and files in every folder.

    Links are not followed: what a program is called by may decide what it does.
    """
    words = [
        os.path.abspath(word) if Path(word).is_file() else word
        for word in program_words(spec)
    ]
    return PREFIX + shlex.join(words)


def program_files(spec: str) -> dict[str, Path]:
    """Return the files that a command names, by name; of none, the program itself.

    Raises:
        PlannerError: If there is no such program.
    """
    words = program_words(spec)
    program = found_program(spec)
    named = [Path(word) for word in words if Path(word).is_file()]
    found = dict[str, Path]()
    for k, path in enumerate(named or [program]):
        found[path.name if path.name not in found else f"{k}-{path.name}"] = path
    return found


def found_program(spec: str) -> Path:
    """Return the program of a command.

    Raises:
        PlannerError: If there is none that may be run.
    """
    word = program_words(spec)[0]
    found = shutil.which(word)
    if found is None:
        raise PlannerError(
            f"{spec}: expected a program that can be run but there is no {word!r}."
        )
    return Path(found)
