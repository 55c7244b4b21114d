"""Every command and every program of the documentation runs, page by page."""

from pathlib import Path

import pytest

from tests.pages import Block, follow, in_small, parts, reader
from tests.repository import REPOSITORY

PAGES = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").glob("*.md"))]
#: What blocks are in that are neither run nor saved.
NOT_CODE = {"text", "toml", "yaml", "xml", "json"}


def runs(block: Block) -> bool:
    return block.language in ("bash", "python") and block.not_run is None


RUN = [p for p in PAGES if any(runs(block) for block in parts(p.read_text()))]


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN, ids=lambda p: p.name)
def test_every_command_and_program_of_a_page_runs(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BEACON_MJ_CACHE", str(tmp_path / "cache"))
    assert [*follow(page.read_text(), reader(tmp_path))]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_block_says_what_it_is(page: Path) -> None:
    for block in parts(page.read_text()):
        assert block.language in {"bash", "python"} | NOT_CODE, block.text
        if block.not_run is not None:
            assert len(block.not_run) > 10
    fences = page.read_text().count("```")
    assert fences == 2 * len(parts(page.read_text()))


def test_pages_that_run_are_most_pages_with_code() -> None:
    assert len(RUN) >= 15


def test_what_fails_is_noticed(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match="beacon-mj nonsense"):
        [*follow("```bash\nbeacon-mj nonsense\n```", tmp_path)]
    with pytest.raises(AssertionError, match="ZeroDivisionError"):
        [*follow("```python\n1 / 0\n```", tmp_path)]
    assert not [*follow("<!-- not run: it fails -->\n```bash\nfalse\n```", tmp_path)]


def test_a_titled_block_is_a_file(tmp_path: Path) -> None:
    page = '```python title="a/b.py"\nx = 1\n```\n```bash\ntest -f a/b.py  # there\n```'
    assert [*follow(page, tmp_path)] == ["test -f a/b.py"]


@pytest.mark.parametrize(
    ("command", "small"),
    [
        ("beacon-mj eval --planner all", "beacon-mj eval --planner all -n 1"),
        ("beacon-mj eval --planner x -n 100", "beacon-mj eval --planner x -n 1"),
        ("beacon-mj eval --planner x -n 8", "beacon-mj eval --planner x -n 8"),
        ("beacon-mj sweep --trials 50", "beacon-mj sweep --trials 2 -n 1"),
        ("beacon-mj eval --scene-dir x", "beacon-mj eval --scene-dir x"),
        ("beacon-mj verify runs/x", "beacon-mj verify runs/x"),
    ],
)
def test_studies_run_in_small(command: str, small: str) -> None:
    assert in_small(command) == small
