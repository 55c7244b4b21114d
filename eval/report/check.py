"""Is a page the page of its rows?"""

import html
import re

from beacon_mj.eval.report.page import page_tables
from beacon_mj.eval.statistics.results import Results

_BASELINE = re.compile(r'<meta name="baseline" content="([^"]*)">')
_TABLE = re.compile(r'<figure class="table(?: wide)?">.*?</figure>', re.S)


def page_problem(page: str, run: Results) -> str | None:
    """Say which table of a page is not that of a run's rows, or return None.

    Pictures are not compared: they depend on the version of matplotlib.

    Raises:
        RunError: If the page names a baseline that the run does not have.
    """
    found = _BASELINE.search(page)
    if found is None:
        return "is not a page of this version: write it again with beacon-mj report"
    ours = page_tables(run, html.unescape(found.group(1)))
    stored = _TABLE.findall(page)
    if len(stored) != len(ours):
        return f"has {len(stored)} tables where the rows give {len(ours)}"
    for number, (there, made) in enumerate(zip(stored, ours, strict=True), start=1):
        if there.strip() != made.strip():
            return f"its table {number} is not that of the rows"
    return None
