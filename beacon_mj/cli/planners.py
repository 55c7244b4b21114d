"""`beacon-mj planners` and `beacon-mj check-planner`."""

from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from beacon_mj.cli import options


def planners(name: str | None = None, /) -> None:
    """List the planners, or the fields that --set can change in one of them.

    Parameters
    ----------
    name
        A planner's name, or path/to/file.py:Class.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import show

    if name is None:
        show(beacon_mj.list_planners())
    else:
        show(beacon_mj.describe_planner(name))


def check_planner(
    planner: str,
    /,
    *,
    steps: Annotated[
        int,
        Parameter(
            converter=options.whole,
            validator=Number(gte=1, lte=10_000),
            help="Control steps to drive, twice.",
        ),
    ] = 40,
) -> None:
    """Check that a planner keeps the contract; status 2 with one line if not.

    It is driven through a scene twice: the same commands, inputs untouched, and sound
    answers.

    Parameters
    ----------
    planner
        A name, path/to/file.py:Class, or exec:COMMAND for a program.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import say

    beacon_mj.check_planner(planner, steps=steps)
    say(f"{planner} keeps the contract: driven twice, up to {steps} steps each.")
