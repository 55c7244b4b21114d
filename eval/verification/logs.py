"""Level `logs`: each log proves its row, and was recorded as the run says."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import RunConfig
from beacon_mj.eval.runs.jobs import planner_seed
from beacon_mj.eval.runs.log_files import log_file
from beacon_mj.eval.verification.checks import Check
from beacon_mj.recording.provenance import to_json
from beacon_mj.recording.tolerance import ROW_RELATIVE
from beacon_mj.recording.verify import Verification

#: Outcomes of episodes that may have ended before there was a log: all are failures.
_LOST = ("planner_error", "simulation_error")


def check_logs(
    run: Path, config: RunConfig, rows: Sequence[Row], found: Sequence[Verification]
) -> Check:
    """Compare what logs say of themselves with their run, and name those missing.

    Args:
        run: The run folder.
        config: Its configuration.
        rows: Its rows.
        found: What came of each of its logs; their own problems are not repeated.
    """
    problems = [line for log in found if log.ok for line in _strange(config, log)]
    problems += _missing(run, config, rows)
    near = sum(log.tolerance_m > 0.0 for log in found)
    note = f"{len(found)} logs simulated again"
    if near:
        tolerance_m = max(log.tolerance_m for log in found)
        note += (
            f"; {near} of another kind of machine: positions within {tolerance_m:g} m, "
            f"rows within {100.0 * ROW_RELATIVE:g} %, outcomes exactly"
        )
    elif found:
        note += ", every message bit for bit"
    if without := len(rows) - len(found):
        note += f"; {without} episodes have no log, so that --rerun is their only proof"
    return Check(level="logs", problems=tuple(problems), note=note)


def _strange(config: RunConfig, log: Verification) -> Iterator[str]:
    """Yield in what a sound log is not one of this run."""
    said = log.config
    name = said.get("planner", "")
    entry = next((e for e in config.planners if e.name == name), None)
    if entry is None:
        yield f"{log.path}: {name!r} is no planner of the run"
        return
    wanted = {
        "planner_config": _plain(to_json(entry.config)),
        "protocol": _plain(to_json(config.protocol_of(name))),
        "planner_seed": _seed(config, said),
        "oracle": entry.oracle or None,
    }
    if config.scene_dir is None:
        wanted["scene_seed"] = config.seed
    if config.perception is not None:
        wanted["perception"] = config.perception
    for key, value in wanted.items():
        there = _plain(said.get(key, "null"))
        if there != value:
            yield f"{log.path}: its {key} is not that of the run{_where(there, value)}"
            return
    for package, version in log.versions.items():
        ours = config.versions.get(package, version)
        if package != "machine" and ours != version:
            yield f"{log.path}: recorded with {package} {version}, not {ours}"
            return


def _where(there: Any, value: Any) -> str:
    if not (isinstance(there, Mapping) and isinstance(value, Mapping)):
        return f": {there!r}, not {value!r}"
    keys = [k for k in dict.fromkeys([*value, *there]) if there.get(k) != value.get(k)]
    return f" in {', '.join(map(str, keys))}"


def _plain(text: str) -> Any:
    """Return the value of a text of JSON; the text itself where it is none."""
    try:
        return msgspec.json.decode(text)
    except msgspec.DecodeError:
        return text


def _seed(config: RunConfig, said: Mapping[str, str]) -> int | None:
    index = said.get("index", "")
    if not index.isdecimal():
        return None
    return planner_seed(config.seed, said.get("family", ""), int(index))


def _missing(run: Path, config: RunConfig, rows: Sequence[Row]) -> list[str]:
    """Return a line if episodes have no log although the run kept them."""
    if config.log == "none":
        return []
    lacking = [
        row
        for row in rows
        if row.outcome not in _LOST
        and not (config.log == "failures" and row.clean_success)
        and not log_file(run, row.planner, row.scene_name).is_file()
    ]
    if not lacking:
        return []
    first = lacking[0]
    return [
        f"{run}: {len(lacking)} episodes have no log, though the run kept the logs of "
        f"{config.log}, such as {first.planner} in {first.scene_name}"
    ]
