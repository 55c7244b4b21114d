"""`beacon-mj learning`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import options


def learning(
    run: Path,
    /,
    *,
    without: Annotated[str, Parameter(help="The planner that does not learn.")],
    learner: Annotated[str, Parameter(name="--with", help="The one that does.")],
    plot: Annotated[
        Path | None,
        Parameter(help="SVG, PNG or PDF file for the figure, one point a scene."),
    ] = None,
    json: options.Json = False,
) -> None:
    """Compare what learning saved with what it saves the optimum in the same worlds.

    Parameters
    ----------
    run
        A run folder, on families with a certificate of learning.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import show, show_json

    found = beacon_mj.learning_savings(run, without=without, learner=learner, plot=plot)
    if json:
        show_json(
            {
                "families": [family._asdict() for family in found.families],
                "scenes": [scene._asdict() for scene in found.scenes],
            }
        )
    else:
        show(found)
