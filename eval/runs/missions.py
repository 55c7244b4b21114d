"""Which scenes are the days of one mission, and so belong together."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from beacon_mj.errors import RunError
from beacon_mj.eval.runs.shards import Shard, share
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.family import Family
from beacon_mj.scene_gen.learning.layouts import LEARNING_LAYOUTS

if TYPE_CHECKING:
    from beacon_mj.eval.runs.config import SceneRef


def days_of(family: Family) -> int | None:
    """Return how many days a family's missions have; None if it has no missions."""
    if family.layout not in LEARNING_LAYOUTS or "day_count" not in family.numerics:
        return None
    return family.whole("day_count")


def check_whole(name: str, scenes: int, days: int) -> None:
    """Raise RunError unless so many scenes of a family are whole missions."""
    if scenes % days:
        fewer = scenes - scenes % days
        nearby = f"{fewer} or {fewer + days}" if fewer else str(days)
        raise RunError(
            f"--scenes-per-family {scenes}: expected whole missions of {name}, which "
            f"have {days} days, such as {nearby}."
        )


def check_stored_days(folder: Path, scenes: Sequence[Scene]) -> None:
    """Raise RunError unless the stored scenes of one family are whole missions."""
    missions: dict[int, list[Scene]] = {}
    for scene in scenes:
        if isinstance(scene.mission, int):
            missions.setdefault(scene.mission, []).append(scene)
    for number, own in missions.items():
        days = [scene.day for scene in own]
        if days != [*range(int(own[0].days or 0))]:
            raise RunError(
                f"{folder}: expected all {own[0].days} days of mission {number} of "
                f"{own[0].family}, in the order of their scenes, but it holds "
                f"{len(own)}: {', '.join(scene.name for scene in own)}."
            )


def by_mission(refs: Sequence["SceneRef"]) -> list[tuple["SceneRef", ...]]:
    """Return scenes with those of one mission together, in order."""
    return [
        tuple(own)
        for _, own in groupby(
            refs, lambda r: (r.family, r.index if r.mission is None else -1, r.mission)
        )
    ]


def share_missions(refs: Sequence["SceneRef"], shard: Shard | None) -> list["SceneRef"]:
    """Return a shard of the scenes; no mission is split.

    Raises:
        RunError: If there are fewer scenes and missions than shards.
    """
    return [ref for own in share(by_mission(refs), shard) for ref in own]
