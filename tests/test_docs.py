"""Documentation that must not drift from the code."""

import dataclasses
import re
from pathlib import Path

import pytest

from beacon_mj.planners.registry import load_planner, planner_names
from tests.repository import REPOSITORY

DOCS = REPOSITORY / "docs"


@pytest.mark.parametrize("name", sorted(planner_names()))
def test_every_parameter_stands_in_the_docs(name: str) -> None:
    section = (DOCS / "planners.md").read_text().split(f"### `{name}`\n")[1]
    rows = dict(
        re.findall(r"^\| `(\w+)` \| `([^`]*)` \| \S", section.split("###")[0], re.M)
    )
    config = load_planner(name)[1].Config
    assert rows == {f.name: str(f.default) for f in dataclasses.fields(config)}


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda p: p.name)
def test_links_between_pages_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
        if not link.startswith("http"):
            assert (page.parent / link).exists(), link
