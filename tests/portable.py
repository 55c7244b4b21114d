"""Run a few episodes; print, as JSON, all that must be equal on every machine.

Usage: python -m tests.portable planner/family/index[/steps] ...

Run in processes of their own by `tests/test_same_rows.py`, each with another CPU's
libraries or another Python; on another machine, by hand.
"""

import hashlib
import sys
import tempfile
from pathlib import Path
from typing import Any

import msgspec
from mcap.records import Attachment, Message, Metadata

from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.trace import Trace
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.planners.registry import load_planner
from beacon_mj.recording import Recorder
from beacon_mj.recording.container import Container
from beacon_mj.recording.machine import machine
from beacon_mj.scene_gen.generate import generate_scene

PATIENCE_S = 3600.0  #: Nothing here is slow because its planner is.


def episode(planner: str, family: str, index: int, steps: int | None) -> dict[str, Any]:
    """Return a scene's and a log's SHA-256, and the row without its wall clock."""
    scene = generate_scene(family, index, seed=0)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "episode.mcap"
        trace = run_episode(
            scene,
            load_planner(planner)[1](),
            name=planner,
            protocol=Protocol(max_steps=steps, decision_limit_s=PATIENCE_S),
            listeners=[Recorder(log, row=_row)],
        )
        return {
            "scene": hashlib.sha256(scene.to_json()).hexdigest(),
            "row": _stable(_row(trace)),
            "log": _content(log),
        }


def _row(trace: Trace) -> dict[str, Any]:
    return measure(trace).as_dict()


def _stable(row: dict[str, Any]) -> dict[str, Any]:
    return {k: v for k, v in row.items() if k not in WALL_CLOCK_COLUMNS}


def _content(log: Path) -> str:
    """Return the SHA-256 of a log but for its records of versions and machine."""
    digest = hashlib.sha256()
    for record in Container(log).records():
        match record:
            case Message():
                content: Any = [record.channel_id, record.log_time, record.data.hex()]
            case Attachment():
                content = [record.name, record.data.hex()]
            case Metadata(name="versions" | "machine"):
                continue
            case Metadata():
                content = [record.name, sorted(record.metadata.items())]
            case _:
                continue
        digest.update(msgspec.json.encode(content))
    return digest.hexdigest()


def main(names: list[str]) -> None:
    found = {}
    for name in names:
        planner, family, index, *steps = name.split("/")
        limit = int(steps[0]) if steps else None
        found[name] = episode(planner, family, int(index), limit)
    result = {"machine": machine(), "episodes": found}
    sys.stdout.buffer.write(msgspec.json.encode(result) + b"\n")


if __name__ == "__main__":
    main(sys.argv[1:])
