"""Print an interpreter of each supported Python on this machine but the one that runs.

One that does not start, such as a shim of a version manager, is left out, and so is one
that cannot make environments.

Usage: python .ci/other_pythons.py
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

PROJECT = Path(__file__).parent.parent / "pyproject.toml"
_PROBE = "import ensurepip, sys, venv; print('%d.%d' % sys.version_info[:2])"


def supported() -> list[str]:
    """Return the Pythons of the classifiers, such as `3.12`."""
    return re.findall(r"Python :: (3\.\d+)\"", PROJECT.read_text())


def candidates(version: str, path: Sequence[str]) -> Iterator[Path]:
    """Yield what may be that Python: on the path, and of pyenv, if it is there."""
    for folder in path:
        yield Path(folder) / f"python{version}"
    pyenv = shutil.which("pyenv", path=os.pathsep.join(path))
    if pyenv is not None:
        root = subprocess.run([pyenv, "root"], capture_output=True, text=True)
        found = Path(root.stdout.strip() or ".").glob(
            f"versions/{version}.*/bin/python"
        )
        yield from sorted(found)


def works(python: Path, version: str) -> bool:
    """Whether a file starts, is that version, and can make environments."""
    try:
        done = subprocess.run(
            [python, "-c", _PROBE], capture_output=True, text=True, timeout=60
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0 and done.stdout.strip() == version


def find(version: str, path: Sequence[str]) -> Path | None:
    """Return the first interpreter of a version that works."""
    return next((p for p in candidates(version, path) if works(p, version)), None)


if __name__ == "__main__":
    own = "{}.{}".format(*sys.version_info[:2])
    for version in supported():
        found = find(version, os.environ["PATH"].split(os.pathsep))
        if version != own and found is not None:
            print(found)
