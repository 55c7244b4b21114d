"""`beacon-mj export`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


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
    import beacon_mj
    from beacon_mj.cli.views.console import remark

    count = beacon_mj.export_ros2(log, ros2)
    remark(f"{ros2}: {count} messages")
