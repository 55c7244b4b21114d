"""Records of published tables: what is needed to run any of their episodes again.

A record is two files of this package: `NAME.json` with the configuration of the run and
the SHA-256 of its rows, and `NAME.parquet` with how each episode ended and the SHA-256
of its row. `publish.py` writes them.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row, row_sha256
from beacon_mj.eval.runs.config import RunConfig
from beacon_mj.eval.runs.frame import typed_frame
from beacon_mj.eval.runs.run_folder import read_table
from beacon_mj.files import replacing

RECORDS = Path(__file__).parent / "records"  #: Where those of this version are.
Key = tuple[str, str, int]


class Episode(msgspec.Struct, frozen=True, kw_only=True):
    """How a published episode ended.

    Attributes:
        planner: Its planner.
        family: The scene's family.
        scene_index: The scene's number in the family.
        outcome: See `Row`.
        steps: Control steps.
        path_length_m: Length of the robot's path [m].
        sha256: The first 16 digits of `row_sha256`.
    """

    planner: str
    family: str
    scene_index: int
    outcome: str
    steps: int
    path_length_m: float
    sha256: str

    @property
    def key(self) -> Key:
        """Planner, family and index."""
        return self.planner, self.family, self.scene_index


class Table(msgspec.Struct, frozen=True, kw_only=True):
    """What a record says of its table.

    Attributes:
        rows: Number of episodes.
        rows_sha256: Of all rows; see `beacon_mj.eval.metrics.row`.
        config: How they were run, with which versions, and on which machines.
    """

    rows: int
    rows_sha256: str
    config: RunConfig


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """A published table.

    Attributes:
        name: Its name, such as `paper-v1-seed-0`.
        table: The whole.
        episodes: Its parts, by planner, family and index.
    """

    name: str
    table: Table
    episodes: Mapping[Key, Episode]


def episode_of(row: Row) -> Episode:
    """Return what a record keeps of a row."""
    return Episode(
        planner=row.planner,
        family=row.family,
        scene_index=row.scene_index,
        outcome=row.outcome,
        steps=row.steps,
        path_length_m=row.path_length_m,
        sha256=row_sha256(row)[:16],
    )


def read_records(folder: Path = RECORDS) -> list[Record]:
    """Return the published tables of this version, by name.

    Args:
        folder: Where they are.

    Raises:
        RunError: If there is none, or one cannot be read.
    """
    found = [_read(path) for path in sorted(folder.glob("*.json"))]
    if not found:
        raise RunError(f"{folder}: expected published tables but there is none.")
    return found


def _read(path: Path) -> Record:
    try:
        table = msgspec.json.decode(path.read_bytes(), type=Table)
        frame = read_table(path.with_suffix(".parquet"))
        episodes = msgspec.convert(frame.to_dicts(), list[Episode])
    except (OSError, msgspec.MsgspecError) as error:
        raise RunError(
            f"{path}: not a record of a published table: {error}."
        ) from error
    if len(episodes) != table.rows:
        raise RunError(
            f"{path}: expected {table.rows} episodes but there are {len(episodes)}."
        )
    return Record(
        name=path.stem, table=table, episodes={each.key: each for each in episodes}
    )


def write_record(
    name: str, table: Table, rows: Sequence[Row], folder: Path = RECORDS
) -> Path:
    """Write a record; return the path of its JSON file.

    Args:
        name: Its name.
        table: The whole.
        rows: The table's rows, in canonical order.
        folder: Where records are.
    """
    path = folder / f"{name}.json"
    text = msgspec.json.format(msgspec.json.encode(table), indent=1) + b"\n"
    frame = typed_frame([episode_of(row) for row in rows], Episode)
    with replacing(path.with_suffix(".parquet")) as part, part.open("wb") as file:
        frame.write_parquet(file, compression="zstd", compression_level=19)
    with replacing(path) as part:
        part.write_bytes(text)
    return path
