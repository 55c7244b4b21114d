"""Make a finished run a published table, which `verify --published` runs again.

    python -m beacon_mj.eval.verification.publish RUN [NAME]

For maintainers, in a checkout. The name is of suites and seed, such as
`paper-v1-seed-0`, unless one is given; a record of that name is replaced if it is of
the same planners and families.
"""

import sys
from pathlib import Path

import msgspec

from beacon_mj.errors import BeaconError, RunError
from beacon_mj.eval.metrics.row import rows_sha256
from beacon_mj.eval.runs.config import RunConfig, planned_scenes
from beacon_mj.eval.runs.run_folder import load_config, load_rows
from beacon_mj.eval.runs.variants import checked_name
from beacon_mj.eval.verification.records import RECORDS, Table, write_record
from beacon_mj.eval.verification.scenes import family_problems
from beacon_mj.eval.verification.tables import check_tables
from beacon_mj.planners.registry import is_shipped


def publish(run: Path, name: str | None = None, folder: Path = RECORDS) -> Path:
    """Write the record of a finished run; return its path.

    Args:
        run: The run folder.
        name: The record's name; by default suites and seed.
        folder: Where records are.

    Raises:
        RunError: If the run is unfinished, a shard, or not of shipped planners and
            families, its tables are not of its rows, or a record of that name is of
            other planners or families.
    """
    config, rows = load_config(run), load_rows(run)
    if (problem := _unfit(config)) is not None:
        raise RunError(f"{run}: expected {problem}, to publish it.")
    check = check_tables(run, planned_scenes(config))
    problems = [*check.problems, *family_problems(run, config)]
    if problems:
        raise RunError(problems[0])
    name = checked_name(name or _name(config))
    _check_same_kind(folder / f"{name}.json", config)
    table = Table(rows=len(rows), rows_sha256=rows_sha256(rows), config=config)
    return write_record(name, table, rows, folder)


def _check_same_kind(path: Path, config: RunConfig) -> None:
    """Refuse to replace the record of another table by mistake."""
    if not path.is_file():
        return
    before = msgspec.json.decode(path.read_bytes(), type=Table).config
    if _kind(before) != _kind(config):
        raise RunError(
            f"{path}: is the record of other planners or families: give another NAME, "
            "or delete it."
        )


def _kind(config: RunConfig) -> tuple[list[str], list[str], int]:
    return [e.name for e in config.planners], [*config.families], config.seed


def _unfit(config: RunConfig) -> str | None:
    """Say what a run should be of and is not, or return None."""
    if config.shard is not None:
        return "a whole run, not a shard"
    if config.scene_dir is not None or config.templates is not None:
        return "generated scenes of shipped families"
    for entry in config.planners:
        if not is_shipped(entry.spec):
            return f"shipped planners, not {entry.name},"
    if config.inexact:
        return f"planners whose rows repeat, not {config.inexact[0]},"
    return None


def _name(config: RunConfig) -> str:
    suites = dict.fromkeys(each.suite or "own" for each in config.scenes.values())
    return f"{'-'.join(suites)}-seed-{config.seed}"


def main(arguments: list[str]) -> int:
    """Run the command; return its exit status."""
    if len(arguments) not in (1, 2):
        print(__doc__, file=sys.stderr)
        return 2
    try:
        path = publish(Path(arguments[0]), arguments[1] if arguments[1:] else None)
    except BeaconError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    found = msgspec.json.decode(path.read_bytes(), type=Table)
    print(f"{path}: {found.rows} episodes, SHA-256 of the rows {found.rows_sha256}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
