"""`beacon-mj merge`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import options


def merge(
    out: Annotated[Path, Parameter(help="The new run folder.")],
    /,
    *shards: Annotated[Path, Parameter(help="Run folders of `eval --shard I/N`.")],
    report: options.Report = True,
) -> None:
    """Put the shards of one run together: the same tables as an uninterrupted run.

    Refuses shards of different options, a shard that is there twice, missing or
    unfinished. The shards stay as they are.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import remark, show, show_page

    results = beacon_mj.merge(out, shards, report=False)
    show(results.table())
    remark(f"results: {results.folder}")
    if report:
        show_page(results)
