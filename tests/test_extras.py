"""What is said where a package of an extra is missing: a command that installs it."""

import re
import subprocess
import sys
import tomllib
from importlib.metadata import metadata
from pathlib import Path

import pytest

from beacon_mj.extras import missing, packages
from tests.repository import REPOSITORY

#: Which module is missing, and a call that needs it.
NEEDED = {
    "video": ("av", "beacon_mj.render_video('x.mcap', 'x.mp4')"),
    "web": ("viser", "beacon_mj.render_page('x.mcap', 'x.html')"),
    "ros2": ("rosbags", "beacon_mj.export_ros2('x.mcap', 'bag')"),
}


def extras() -> dict[str, list[str]]:
    """Return the extras of the checkout, without the one that tests need."""
    text = (REPOSITORY / "pyproject.toml").read_text()
    project = tomllib.loads(text)["project"]
    return {
        name: requirements
        for name, requirements in project["optional-dependencies"].items()
        if name != "test"
    }


def installed() -> list[str]:
    """Return the extras of beacon-mj as it was installed, which may be long ago."""
    return metadata("beacon-mj").get_all("Provides-Extra") or []


def package(requirement: str) -> str:
    return re.split("[<>=;]", requirement)[0]


@pytest.mark.parametrize("extra", extras())
def test_the_command_names_every_package_of_the_extra(extra: str) -> None:
    if extra not in installed():
        pytest.skip("the installation is older than the extra")
    said = missing(ModuleNotFoundError(name="x"), extra)
    named = re.findall("'([^']+)'", said.split("pip install ")[1].split(" (")[0])
    assert {package(line) for line in extras()[extra]} <= {*map(package, named)}


def test_a_package_of_no_known_extra_names_itself() -> None:
    assert [*packages("nothing")] == []
    said = missing(ModuleNotFoundError(name="thing"), "nothing")
    assert "pip install 'thing' " in said


@pytest.mark.parametrize("extra", NEEDED)
def test_without_the_package_one_line_says_what_to_install(
    extra: str, tmp_path: Path
) -> None:
    module, call = NEEDED[extra]
    code = (
        f"import sys; sys.modules[{module!r}] = None\n"
        f"import beacon_mj\ntry:\n    {call}\n"
        "except beacon_mj.BeaconError as error:\n    print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.stderr == ""
    assert f"expected package '{module}" in done.stdout
    assert f"'{module}" in done.stdout.split("pip install ")[1]
