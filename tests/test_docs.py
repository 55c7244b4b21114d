"""Documentation that must not drift from the code."""

import re
from pathlib import Path

import pytest

from beacon_mj.errors import PlannerError
from beacon_mj.eval.runs.overrides import convert, flat
from beacon_mj.planners.registry import load_planner, planner_names
from tests.repository import REPOSITORY

DOCS = REPOSITORY / "docs"


@pytest.mark.parametrize("name", sorted(planner_names()))
def test_every_parameter_stands_in_the_docs(name: str) -> None:
    section = (DOCS / "planners.md").read_text().split(f"### `{name}`\n")[1]
    rows = dict(
        re.findall(r"^\| `([\w.]+)` \| `([^`]*)` \| \S", section.split("###")[0], re.M)
    )
    default = load_planner(name)[1].Config()
    assert [*rows] == [*flat(default)]
    # What stands in the docs is what --set takes.
    assert convert(type(default), rows, name, PlannerError) == default


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda p: p.name)
def test_links_between_pages_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
        if not link.startswith("http"):
            assert (page.parent / link).exists(), link
