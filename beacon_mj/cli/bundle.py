"""`beacon-mj bundle`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def bundle(
    run: Path,
    /,
    *,
    out: Annotated[Path, Parameter(help="The file, such as run.zip.")],
) -> None:
    """Write a finished run as one file that `verify` takes.

    It holds rows, tables, logs, the planners' source and the templates, with a
    manifest of hashes. The same run gives the same bytes.

    Parameters
    ----------
    run
        The run folder.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import remark

    remark(f"bundle: {beacon_mj.bundle(run, out)}")
