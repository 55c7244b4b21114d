"""Documentation that must not drift from the code."""

import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

import beacon_mj
from beacon_mj.cli.app import COMMANDS, LOG_COMMANDS
from beacon_mj.errors import PlannerError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.overrides import convert, flat
from beacon_mj.planners.registry import OURS, PAPER, REFERENCE, load_planner
from beacon_mj.recording.schemas import BEACON, TOPICS
from tests.repository import REPOSITORY

DOCS = REPOSITORY / "docs"
PAGES = [*sorted(DOCS.rglob("*.md")), *sorted(REPOSITORY.glob("*.md"))]


@pytest.fixture(scope="module")
def made() -> Mapping[Path, str]:
    """The pages that are written from the code, as they should be."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(REPOSITORY / ".ci"))
        script = runpy.run_path(str(REPOSITORY / ".ci" / "reference.py"))
    pages: Mapping[Path, str] = script["pages"]()
    return pages


def test_pages_written_from_the_code_are_up_to_date(made: Mapping[Path, str]) -> None:
    stale = [path.name for path, text in made.items() if path.read_text() != text]
    assert len(made) == 9
    assert not stale, "run: python .ci/reference.py"


def test_the_reference_is_complete() -> None:
    folder = DOCS / "reference"
    parameters = (folder / "parameters.md").read_text()
    assert re.findall(r"^## `(.*)`$", parameters, re.M) == [*PAPER, *OURS, *REFERENCE]
    topics = (folder / "topics.md").read_text()
    assert all(f"| `{topic}` | `{name}` |" in topics for topic, name in TOPICS.items())
    assert all(f"## `beacon_mj.{name}`\n" in topics for name in BEACON)
    columns = (folder / "columns.md").read_text()
    assert re.findall(r"^\| `(\w+)` \| .+ \|$", columns, re.M) == [
        *Row.__struct_fields__
    ]
    commands = (folder / "commands.md").read_text()
    assert all(f"\n## beacon-mj {name}\n" in commands for name in COMMANDS)
    assert all(f"\n### beacon-mj log {name}\n" in commands for name in LOG_COMMANDS)
    api = (folder / "python.md").read_text() + (DOCS / "planner-api.md").read_text()
    named = set(re.findall(r"^### `(\w+)`$", api, re.M))
    assert set(beacon_mj.__all__) - {"__version__"} <= named


@pytest.mark.parametrize("name", [*PAPER, *OURS, *REFERENCE])
def test_every_parameter_is_what_can_be_set(name: str) -> None:
    page = (DOCS / "reference" / "parameters.md").read_text()
    section = page.split(f"## `{name}`\n")[1].split("\n## ")[0]
    rows = dict(re.findall(r"^\| `([\w.]+)` \| `([^`]*)` \| \S", section, re.M))
    default = load_planner(name)[1].Config()
    assert [*rows] == [*flat(default)]
    # What stands in the docs is what --set takes.
    assert convert(type(default), rows, name, PlannerError) == default


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_between_pages_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        path, _, anchor = link.partition("#")
        if link.startswith("http"):
            continue
        target = page.parent / path if path else page
        assert target.exists(), link
        if anchor:
            assert anchor in anchors(target), link


def anchors(page: Path) -> set[str]:
    """Return where links into a page may lead: its headings, as the site names them."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S)
    heads = re.findall(r"^#+ (.*)$", text, re.M)
    words = (re.sub(r"[^\w\s-]", "", head).strip().lower() for head in heads)
    return {re.sub(r"[-\s]+", "-", each) for each in words}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as .ci/run does."""
    pytest.importorskip("zensical", reason="extra docs")
    folder = tmp_path_factory.mktemp("site")
    shutil.copytree(DOCS, folder / "docs")
    shutil.copy(REPOSITORY / "mkdocs.yml", folder)
    done = subprocess.run(
        [sys.executable, "-m", "zensical", "build", "--strict"],
        cwd=folder, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "build" / "site"


def test_the_site_has_every_page_and_loads_nothing_from_elsewhere(site: Path) -> None:
    pages = {p.relative_to(DOCS).with_suffix(".html") for p in DOCS.rglob("*.md")}
    assert len(pages) > 30
    for path in pages:
        text = (site / path).read_text()
        loaded = re.findall(r"<(?:link|script|img|iframe)[^>]*?(?:src|href)=\S+", text)
        assert loaded
        assert not [x for x in loaded if "//" in x and "canonical" not in x], path


def test_every_page_can_be_found_from_the_navigation() -> None:
    listed = re.findall(r"(\S+\.md)$", (REPOSITORY / "mkdocs.yml").read_text(), re.M)
    assert sorted(listed) == sorted(
        str(p.relative_to(DOCS)) for p in DOCS.rglob("*.md")
    )
