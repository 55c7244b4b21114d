"""`beacon-mj planners`."""


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
