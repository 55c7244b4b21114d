"""Where the log of an episode is."""

from pathlib import Path

from beacon_mj.files import file_name

LOGS = "logs"  #: Folder of a run's logs.


def log_file(run: Path, planner: str, scene: str) -> Path:
    """Return the path of an episode's log.

    No name leads out of the run folder, whoever chose it; see `file_name`.

    Args:
        run: The run folder.
        planner: The planner's name.
        scene: The scene's name, such as `cluttered_0007`.
    """
    return run / LOGS / file_name(planner) / f"{file_name(scene)}.mcap"
