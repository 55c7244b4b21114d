"""Proof in the simulator: which stored scenes the clairvoyant solves without damage."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec

from beacon_mj.errors import SceneError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import (
    RunConfig,
    SceneRef,
    stored_scenes,
)
from beacon_mj.eval.runs.lineup import planner_entries
from beacon_mj.eval.runs.runner import plan, run_jobs
from beacon_mj.eval.runs.versions import versions
from beacon_mj.files import replacing
from beacon_mj.scene.files import load_scene

ORACLE = "clairvoyant"  #: Who proves what can be done.
CLEAN = "clean"  #: The verdict on a scene that was solved without damage.


def certification(
    folder: Path, settings: Sequence[str] = ()
) -> tuple[RunConfig, list[SceneRef]]:
    """Return the run that certifies all scenes stored below `folder`, and the scenes.

    Args:
        folder: Where the scenes are.
        settings: `clairvoyant.field=value` or `protocol.field=value`.

    Raises:
        BeaconError: If there is no scene, one is not valid, or a setting is no good.
    """
    entries, protocol = planner_entries([ORACLE], settings)
    hashes, refs = stored_scenes(folder, (), None)
    config = RunConfig(
        planners=entries,
        families=hashes,
        scenes_per_family=None,
        seed=0,
        perception=None,
        scene_dir=str(folder.resolve()),
        templates=None,
        protocol=protocol,
        log="none",
        versions=versions(),
    )
    return config, refs


def certify_scenes(
    config: RunConfig, refs: Sequence[SceneRef], workers: int = 1
) -> Iterator[Row]:
    """Solve each scene, store the verdict in its file, and yield the row.

    A file is replaced whole or not at all, and only where its verdict changes.
    """
    paths = {(ref.family, ref.index): ref.path for ref in refs}
    for rows in run_jobs(config, plan(config, refs), None, workers):
        for row in rows:
            store(Path(str(paths[row.family, row.scene_index])), verdict(row))
            yield row


def verdict(row: Row) -> str:
    """Return `clean`, `damage`, or the outcome of an episode that missed the goal."""
    if not row.success:
        return row.outcome
    return CLEAN if row.clean_success else "damage"


def store(path: Path, simulated: str) -> None:
    """Store a verdict in a scene file; the scene keeps its identity."""
    scene = load_scene(path)
    if scene.certificate.simulated == simulated:
        return
    certificate = msgspec.structs.replace(scene.certificate, simulated=simulated)
    with replacing(path, SceneError) as part:
        part.write_bytes(
            msgspec.structs.replace(scene, certificate=certificate).to_json()
        )
