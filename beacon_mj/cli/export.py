"""`beacon-mj plot` and `beacon-mj export`."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def plot(
    log: Path,
    /,
    *,
    out: Annotated[
        Path | None,
        Parameter(help="SVG file to write; by default the log's name with .svg, here."),
    ] = None,
) -> None:
    """Draw an episode in one 2-D picture: footprints, way, contacts, pushes.

    Parameters
    ----------
    log
        An MCAP file, finished or not.
    """
    from beacon_mj.rendering import plot_panel

    stem = log.name.removesuffix(".part").removesuffix(".mcap")
    print(plot_panel(log, out or Path(f"{stem}.svg")), file=sys.stderr)


def export(
    log: Path,
    /,
    *,
    ros2: Annotated[
        Path, Parameter(help="Folder of the rosbag2 to write; it must not exist.")
    ],
) -> None:
    """Write an episode for other tools: as a ROS 2 bag.

    Parameters
    ----------
    log
        An MCAP file, finished or not.
    """
    from beacon_mj.errors import BeaconError

    try:
        from beacon_mj.recording.ros2 import export_ros2
    except ModuleNotFoundError as error:
        raise BeaconError(
            f"Expected package {error.name!r} but it is not installed: "
            "pip install 'beacon-mj[ros2]'."
        ) from error
    count = export_ros2(log, ros2)
    print(f"{ros2}: {count} messages", file=sys.stderr)
