"""The part of the verdict that looks for other Pythons."""

import os
import runpy
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.repository import REPOSITORY

VERSION = "{}.{}".format(*sys.version_info[:2])


@pytest.fixture(scope="module")
def script() -> dict[str, Any]:
    return runpy.run_path(str(REPOSITORY / ".ci" / "other_pythons.py"))


def program(folder: Path, text: str) -> str:
    folder.mkdir()
    path = folder / f"python{VERSION}"
    path.write_text(text)
    path.chmod(0o755)
    return str(folder)


@pytest.mark.skipif(os.name == "nt", reason="programs of this test are shell scripts")
def test_interpreters_that_do_not_start_are_left_out(
    script: dict[str, Any], tmp_path: Path
) -> None:
    bad = [
        str(tmp_path / "nowhere"),
        program(tmp_path / "shim", "#!/bin/sh\nexit 127\n"),
        program(tmp_path / "other", "#!/bin/sh\necho 2.7\n"),
        program(tmp_path / "data", "no program"),
    ]
    assert script["find"](VERSION, bad) is None
    good = program(tmp_path / "good", f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    assert script["find"](VERSION, [*bad, good]) == Path(good) / f"python{VERSION}"


def test_supported_pythons_are_those_that_are_tested(script: dict[str, Any]) -> None:
    assert script["supported"]() == ["3.11", "3.12", "3.13", "3.14"]
    assert 'requires-python = ">=3.11"' in (REPOSITORY / "pyproject.toml").read_text()
