"""`beacon-mj merge`."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def merge(
    out: Annotated[Path, Parameter(help="The new run folder.")],
    /,
    *shards: Annotated[Path, Parameter(help="Run folders of `eval --shard I/N`.")],
) -> None:
    """Put the shards of one run together: the same tables as an uninterrupted run.

    Refuses shards of different options, a shard that is there twice, missing or
    unfinished. The shards stay as they are.
    """
    from beacon_mj.cli.tables import show
    from beacon_mj.eval.statistics.summary import summarize
    from beacon_mj.eval.studies.merge import merge as put_together

    rows = put_together(out, shards)
    show(summarize(rows))
    print(f"results: {out}", file=sys.stderr)
