"""Commands as planners: their words, names and files."""

from pathlib import Path

import pytest

from beacon_mj.errors import PlannerError
from beacon_mj.planners.program import program_files, program_name, whole_program
from beacon_mj.planners.registry import file_planner, load_planner, whole_spec


@pytest.mark.parametrize(
    ("spec", "name"),
    [
        ("exec:./build/go_round --fast", "go_round"),
        ("exec:/usr/bin/python3 -u 'my folder/mine.py' x.json", "mine"),
        ("exec:java -jar target/planner.jar", "planner"),
        ("exec:./planner conf.toml", "planner"),
    ],
)
def test_a_program_is_called_by_its_stem(spec: str, name: str) -> None:
    assert program_name(spec) == name
    assert file_planner(spec) is None


def test_a_command_means_the_same_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a b.py").write_text("1")
    (tmp_path / "link.py").symlink_to("a b.py")
    whole = whole_program("exec:python3 -u 'a b.py' --n 3 link.py")
    assert whole == f"exec:python3 -u '{tmp_path}/a b.py' --n 3 {tmp_path}/link.py"
    assert whole_spec(whole) == whole
    assert [*program_files(whole)] == ["a b.py", "link.py"]


def test_a_program_without_files_is_itself() -> None:
    [(name, path)] = program_files("exec:cat -u").items()
    assert (name, path.name, path.is_file()) == ("cat", "cat", True)
    with pytest.raises(PlannerError, match="there is no 'no-such-thing'"):
        program_files("exec:no-such-thing")


def test_files_of_one_name_are_told_apart(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "x").write_text(folder)
    found = program_files(f"exec:cat {tmp_path}/a/x {tmp_path}/b/x")
    assert [path.read_text() for path in found.values()] == ["a", "b"]


def test_a_program_has_no_class() -> None:
    with pytest.raises(PlannerError, match="this is a program"):
        load_planner("exec:python3 mine.py:Mine")
