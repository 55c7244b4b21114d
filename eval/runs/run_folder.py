"""The run folder: configuration, rows as they come, and the tables at the end.

While a run lasts there is only `config.json` and `episodes.jsonl`, which grows by
whole lines. `episodes.parquet` and `summary.json` say that it is complete.
"""

import contextlib
import os
from collections.abc import Iterable, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from beacon_mj.constants import SCHEMA
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import PlannerEntry, RunConfig
from beacon_mj.eval.runs.frame import frame
from beacon_mj.eval.runs.run_lock import LockedFile
from beacon_mj.eval.runs.whole_numbers import MAX_EPISODES
from beacon_mj.files import file_name, replacing
from beacon_mj.regular_files import read_regular
from beacon_mj.source_files import first_change

CONFIG, LINES, TABLE, SUMMARY, REPORT = (
    "config.json",
    "episodes.jsonl",
    "episodes.parquet",
    "summary.json",
    "report.html",
)

if TYPE_CHECKING:
    import polars as pl

#: Of a file of a run; the rows of a million episodes have as much.
MAX_BYTES = 2_000_000_000
#: What reading JSON that anybody may have written raises.
BAD_JSON = (msgspec.MsgspecError, UnicodeDecodeError, RecursionError)
Machines = tuple[dict[str, str], ...]


class RunFolder:
    """One folder on disk that holds one run.

    From `create` or `resume` to `finish` or `close` no other process can open it.
    """

    def __init__(self, path: Path) -> None:
        """Stand for the run folder at `path`; `create` or `resume` opens it."""
        self.path = path
        self._machines: Machines = ()
        self._lines: LockedFile | None = None

    def create(self, config: RunConfig) -> None:
        """Make the folder and write the configuration.

        Raises:
            RunError: If the folder holds anything already, another process writes to
                it, or it cannot be written.
        """
        self._check_unborn()
        self._machines = config.machines or (_here(),)
        noted = msgspec.structs.replace(config, machines=self._machines)
        try:
            text = _pretty(noted)
        except UnicodeEncodeError as error:
            raise RunError(
                f"Expected options that {CONFIG} can hold, as UTF-8, but one was "
                f"{error.object!r}."
            ) from error
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._lock()
            self._check_unborn()  # Another process may have come between.
            self._write(CONFIG, text)
        except OSError as error:
            raise RunError(f"{self.path}: cannot be written: {_why(error)}.") from error

    def is_unborn(self) -> bool:
        """Whether there is no run yet, or one that was killed before it had begun."""
        found = [*self.path.iterdir()] if self.path.is_dir() else []
        return all(
            path.name == f"{CONFIG}.part"
            or (path.name == LINES and path.stat().st_size == 0)
            for path in found
        )

    def resume(self, config: RunConfig) -> list[Row]:
        """Return the rows of the run so far, ready to go on with it.

        A last line that was cut off is removed.

        Raises:
            RunError: If there is no run, it was started with other options or code, or
                another process writes to it.
        """
        before = load_config(self.path)
        if found := difference(before, config):
            raise RunError(
                f"{self.path}: expected the options that the run was started with but "
                f"{found}."
            )
        try:
            self._lock()
            rows, whole = _read_lines(self.path / LINES)
            os.truncate(self.path / LINES, whole)
            self._went_on(before)
        except OSError as error:
            raise RunError(f"{self.path}: cannot be written: {_why(error)}.") from error
        return rows

    def keep(self, kept: list[Row], rows: Sequence[Row]) -> list[Row]:
        """Drop rows of the run so far that will come again; return the others."""
        if len(kept) < len(rows):
            part = self.path / f"{LINES}.part"
            part.unlink(missing_ok=True)
            fresh = LockedFile(part)
            fresh.append(_lines(kept))
            fresh.replace(self.path / LINES)
            self.close()
            self._lines = fresh
        return kept

    def append(self, rows: Iterable[Row]) -> None:
        """Add finished episodes; they are on disk when this returns.

        The page of the run so far, which is out of date by now, goes.

        Raises:
            RunError: If the folder was moved or deleted since it was opened; the
                episodes are then in the folder that was moved.
        """
        self._opened().append(_lines(rows))
        with contextlib.suppress(IsADirectoryError):  # Which is no page of ours.
            (self.path / REPORT).unlink(missing_ok=True)

    def check_in_place(self) -> None:
        """Raise RunError if the folder was moved or deleted since it was opened."""
        if self._lines is not None:
            self._lines.check_in_place()

    def close(self) -> None:
        """Let others open the folder."""
        if self._lines is not None:
            self._lines.close()
            self._lines = None

    def discard(self) -> None:
        """Take back what `create` wrote, for a run that could not even begin."""
        if self._lines is None or not self._lines.in_place():
            return self.close()
        for name in (CONFIG, LINES):
            (self.path / name).unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # The folder was the user's, and is in use.
            self.path.rmdir()
        self.close()

    def finish(self, config: RunConfig, rows: Sequence[Row], summary: Any) -> None:
        """Write the table, the summary, and the scenes' hashes; close the folder.

        Raises:
            RunError: If the folder was moved or deleted since it was opened.
        """
        self.check_in_place()
        ordered = sorted(rows, key=lambda row: row.key)
        scenes = {r.scene_name: r.scene_sha256 for r in ordered}
        config = msgspec.structs.replace(config, machines=self._machines)
        whole = msgspec.to_builtins(config) | {"scene_sha256": scenes}
        self._write(CONFIG, _pretty(whole))
        self._write(SUMMARY, _pretty(summary))
        write_table(rows, self.path / TABLE, config)
        self.close()

    def _check_unborn(self) -> None:
        if not self.is_unborn():
            raise RunError(
                f"{self.path}: expected a new or empty folder but it holds files. "
                "Use --resume to go on with its run, or another --out."
            )

    def _lock(self) -> None:
        """Open the rows for this process alone, if they are not open yet."""
        if self._lines is None:
            self._lines = LockedFile(self.path / LINES)

    def _opened(self) -> LockedFile:
        self._lock()
        assert self._lines is not None
        return self._lines

    def _went_on(self, before: RunConfig) -> None:
        """Note this machine in the configuration, if it is another one."""
        self._machines = distinct_machines((*before.machines, _here()))
        if self._machines != before.machines:
            noted = msgspec.structs.replace(before, machines=self._machines)
            self._write(CONFIG, _pretty(noted))

    def _write(self, name: str, data: bytes) -> None:
        """Write a file so that it is there whole or not at all."""
        with replacing(self.path / name, RunError) as part:
            part.write_bytes(data)


def load_config(path: Path) -> RunConfig:
    """Return the configuration of a run. Raises RunError if there is none."""
    try:
        data = read_regular(path / CONFIG, MAX_BYTES)
        _check_schema(path, msgspec.json.decode(data, type=_Written))
        return msgspec.json.decode(data, type=RunConfig)
    except OSError as error:
        raise RunError(f"{path}: expected a run folder: {_why(error)}.") from error
    except BAD_JSON as error:
        raise RunError(
            f"{path / CONFIG}: not a valid configuration: {error}."
        ) from error


class _Written(msgspec.Struct):
    """What a configuration of any version says about who wrote it."""

    schema: int = 1
    versions: dict[str, str] = {}


def _check_schema(path: Path, written: _Written) -> None:
    """Refuse a run whose columns or options had other names."""
    if written.schema != SCHEMA:
        writer = written.versions.get("beacon-mj", "an unknown version")
        raise RunError(
            f"{path}: expected a run of schema {SCHEMA} but it is of schema "
            f"{written.schema}: evaluate again, or read it with the beacon-mj that "
            f"wrote it, {writer}."
        )


def load_rows(path: Path) -> list[Row]:
    """Return the rows of a run folder in canonical order, finished or not.

    Raises:
        RunError: If there are none, or a line is damaged.
    """
    if (path / CONFIG).is_file():
        load_config(path)
    return sorted(_read_lines(path / LINES)[0], key=lambda row: row.key)


def write_table(
    rows: Sequence[Row], path: Path, config: RunConfig | None = None
) -> None:
    """Write rows as Parquet, in canonical order and with typed columns; see `frame`."""
    # As a file: polars takes no path that is not UTF-8.
    with replacing(path, RunError) as part, part.open("wb") as file:
        frame(rows, config).write_parquet(file)


def read_table(path: Path) -> "pl.DataFrame":
    """Return a table of rows. Raises RunError if it cannot be read."""
    import polars as pl

    try:
        data = read_regular(path, MAX_BYTES)
        rows = pl.scan_parquet(BytesIO(data)).select(pl.len()).collect().item()
        if rows > MAX_EPISODES:
            raise RunError(
                f"{path}: expected at most {MAX_EPISODES} rows but there are {rows}."
            )
        return pl.read_parquet(BytesIO(data))
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError) as error:
        why = " ".join(str(error).split())
        raise RunError(f"{path}: cannot be read as Parquet: {why}.") from error


def free_name(stem: str) -> Path:
    """Make and return the first of `runs/stem`, `runs/stem-2`, ... that is not there.

    It is made at once, so that two runs that start together get a folder each.

    Raises:
        RunError: If it cannot be made.
    """
    stem = file_name(stem)
    path, number = Path("runs") / stem, 1
    while True:
        try:
            path.mkdir(parents=True)
            return path
        except FileExistsError:
            number += 1
            path = Path("runs") / f"{stem}-{number}"
        except OSError as error:
            raise RunError(f"{path}: cannot be written: {_why(error)}.") from error


def _read_lines(path: Path) -> tuple[list[Row], int]:
    """Return the rows of whole lines, and where the last of them ends [bytes]."""
    try:
        data = read_regular(path, MAX_BYTES)
    except OSError as error:
        raise RunError(f"{path}: cannot be read: {_why(error)}.") from error
    whole = data.rfind(b"\n") + 1
    decoder = msgspec.json.Decoder(Row)
    rows: dict[tuple[str, str, int], Row] = {}
    for number, line in enumerate(data[:whole].splitlines(), start=1):
        try:
            row = decoder.decode(line)
        except BAD_JSON as error:
            raise RunError(f"{path}:{number}: not a valid row: {error}.") from error
        if not _fits(row):
            raise RunError(
                f"{path}:{number}: not a valid row: expected whole numbers from 0 to "
                "2^53."
            )
        rows.setdefault(row.key, row)
    return list(rows.values()), whole


def _fits(row: Row) -> bool:
    """Whether a table can hold the row's whole numbers, which JSON does not bound."""
    whole = [value for value in row.as_dict().values() if type(value) is int]
    return all(0 <= value <= 2**53 for value in whole)


def difference(before: RunConfig, now: RunConfig) -> str | None:
    """Say which option differs first, or return None.

    A run may change its logging, go on with another machine, and find its planners'
    files in another folder.
    """
    for name in RunConfig.__struct_fields__:
        ours, theirs = _option(before, name), _option(now, name)
        if name not in ("log", "machines") and _text(ours) != _text(theirs):
            return f"{name} differs{_detail(ours, theirs)}"
    return None


def _option(config: RunConfig, name: str) -> Any:
    if name != "planners":
        return getattr(config, name)
    return tuple(msgspec.structs.replace(e, home="") for e in config.planners)


def _text(value: Any) -> bytes:
    """Return an option as it is stored, where a tuple and a list are the same."""
    return msgspec.json.encode(value, order="deterministic")


def _detail(before: Any, now: Any) -> str:
    """Say what differs in an option that holds others, such as a planner's file."""
    if isinstance(before, dict) and isinstance(now, dict):
        keys = dict.fromkeys([*before, *now])
        names = [str(k) for k in keys if before.get(k) != now.get(k)]
        return f": {', '.join(names)}"
    if isinstance(before, tuple) and len(before) == len(now):
        for ours, theirs in zip(before, now, strict=True):
            if ours != theirs and isinstance(ours, PlannerEntry):
                if ours.name != theirs.name:
                    return f": {ours.name} or {theirs.name}"
                change = first_change(ours.code, theirs.code)
                return f": {ours.name}" + (f", where {change}" if change else "")
    return ""


def _lines(rows: Iterable[Row]) -> bytes:
    return b"".join(msgspec.json.encode(row) + b"\n" for row in rows)


def _pretty(value: Any) -> bytes:
    return msgspec.json.format(msgspec.json.encode(value), indent=1) + b"\n"


def _why(error: OSError) -> str:
    return error.strerror or str(error)


def distinct_machines(machines: Iterable[dict[str, str]]) -> Machines:
    """Return each machine once, in order."""
    return tuple({tuple(found.items()): found for found in machines}.values())


def _here() -> dict[str, str]:
    from beacon_mj.recording.machine import machine  # Not paid for by `--help`.

    return machine()
