"""Every command of CONTRIBUTING runs here, or is one that .ci/run runs."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest

from tests.pages import commands, run
from tests.repository import REPOSITORY

PAGE = (REPOSITORY / "CONTRIBUTING.md").read_text()
COMMANDS = commands(PAGE)
#: What is added so that an evaluation takes seconds.
IN_SMALL = " --scenes-per-family 1 --family sparse"
JUSTFILE = (REPOSITORY / "justfile").read_text()


def ci(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", REPOSITORY / ".ci" / "run", *arguments], capture_output=True, text=True
    )


def recipes() -> list[str]:
    return re.findall(r"^([a-z]+)(?: [A-Z*]+)*:", JUSTFILE, re.M)


def steps() -> list[str]:
    return ci("--list").stdout.split()


def known(command: str) -> bool:
    """Return whether a command is run here, or names what exists and CI runs."""
    first, *rest = shlex.split(command)
    if first == "just":
        return rest[0] in recipes() and all((REPOSITORY / p).exists() for p in rest[1:])
    if command.startswith("bash .ci/run"):
        return set(rest[1:]) <= set(steps())
    return first == "beacon-mj" or command in SET_UP


readme_test = commands((REPOSITORY / "README.md").read_text())[1]
install = readme_test.rpartition(" && ")[0].replace(".venv-test", ".venv")
#: The README's own installation, which .ci/run does, and what needs a git checkout.
SET_UP = {
    install,
    ". .venv/bin/activate",
    "pip install pre-commit rust-just && pre-commit install",
}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_known(command: str) -> None:
    assert known(command)


def test_commands_that_do_not_exist_are_not_known() -> None:
    for wrong in (
        "just nonsense",
        "bash .ci/run nonsense",
        "just test tests/none",
        "x",
    ):
        assert not known(wrong)


def test_steps_that_the_page_names_in_a_sentence_exist() -> None:
    assert ci("nonsense").returncode == 2
    assert "Expected a step to be one of lint" in ci("nonsense").stderr
    assert {"lint", "types", "contracts", "slow", "coverage"} <= set(steps())


def test_recipes_do_what_the_steps_do() -> None:
    """The justfile names steps that exist, and repeats none of their commands."""
    named = re.findall(r'\(step "(\w+)"\)', JUSTFILE)
    assert set(named) == {"lint", "types", "contracts", "docs", "coverage"}
    assert set(named) <= set(steps())
    for tool in ("ruff", "mypy", "lint-imports", "--cov"):
        assert tool not in re.sub(r"^#.*$", "", JUSTFILE, flags=re.M)


def test_hooks_call_the_tools_of_the_steps() -> None:
    hooks = (REPOSITORY / ".pre-commit-config.yaml").read_text()
    script = (REPOSITORY / ".ci" / "run").read_text()
    entries = re.findall(r"^ +entry: (.*)$", hooks, re.M)
    assert len(entries) == 4
    for entry in entries:
        assert entry.removesuffix(" --force-exclude") in script
    assert len(re.findall(r"language: system", hooks)) == len(entries)


def test_hosted_checks_run_the_script_on_every_python() -> None:
    text = (REPOSITORY / ".github" / "workflows" / "ci.yml").read_text()
    assert 'python: ["3.11", "3.12", "3.13", "3.14"]' in text
    assert "run: bash .ci/run\n" in text
    assert "secrets" not in text


@pytest.mark.slow
def test_the_commands_of_the_program_run(tmp_path: Path) -> None:
    ours = [c for c in COMMANDS if c.startswith("beacon-mj ")]
    assert len(ours) > 6
    for command in ours:
        small = IN_SMALL if command.startswith("beacon-mj eval ") else ""
        done = run(command + small, tmp_path)
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"


@pytest.mark.parametrize("path", sorted(set(re.findall(r"`([\w.-]+/[\w./-]+)`", PAGE))))
def test_paths_that_the_page_names_exist(path: str) -> None:
    """All but those of the files that a contributor is to write."""
    if not re.search(r"my[_-]", path):
        assert (REPOSITORY / path).exists()
