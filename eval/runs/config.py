"""What an evaluation runs: everything that is needed to repeat it."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import msgspec
from msgspec import UNSET

from beacon_mj.constants import SCHEMA
from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import RunError, unknown
from beacon_mj.eval.runs.missions import (
    check_stored_days,
    check_whole,
    days_of,
    share_missions,
)
from beacon_mj.eval.runs.scene_cache import cached_scene
from beacon_mj.eval.runs.shards import Shard, share
from beacon_mj.scene import Profile, Scene
from beacon_mj.scene.files import load_scene
from beacon_mj.scene_gen.family import (
    default_families,
    family_sha256,
    load_family,
)
from beacon_mj.scene_gen.own_layouts import check_layout
from beacon_mj.scene_gen.perception import perceive

Logging = Literal["all", "failures", "none"]


class PlannerEntry(msgspec.Struct, frozen=True, kw_only=True):
    """One planner of a run.

    Attributes:
        name: Its name in results.
        spec: What it is loaded by: a name or `path/to/file.py:ClassName`.
        settings: Values given with `--set`, as text.
        config: All values of its configuration, defaults included.
        protocol: How its episodes are run, where that differs from the run's.
        varied: Values by `planner.field` or `protocol.field` in which it differs from
            its variants: the columns `set.planner.field` of the rows.
        isolated: Whether it runs in a process of its own.
        code: SHA-256 of its file and of the local modules that it imports, by path
            below the file's folder; empty for a built-in planner.
        home: Whole path of the file that it is loaded from; no option, for a run may
            go on where the file lies elsewhere.
    """

    name: str
    spec: str
    settings: dict[str, str]
    config: dict[str, Any]
    protocol: Protocol | None = None
    varied: dict[str, str] = {}
    isolated: bool = False
    code: dict[str, str] = {}
    home: str = ""

    @property
    def loaded_from(self) -> str:
        """What it is loaded by, in every folder."""
        member = self.spec.rpartition(":")[2]
        return f"{self.home}:{member}" if self.home else self.spec

    @property
    def base(self) -> str:
        """The planner's name without what is varied in it."""
        return self.name.partition("[")[0] if self.varied else self.name


class RunConfig(msgspec.Struct, frozen=True, kw_only=True):
    """An evaluation. Two runs with equal configurations have equal results.

    Attributes:
        schema: Version of the run folder and its rows; see `beacon_mj.constants`.
        planners: Who runs, each through every scene.
        families: SHA-256 of each family's files, by name; of stored scenes, of all
            their hashes.
        scenes_per_family: Scenes per family; None for all that are stored.
        seed: Seed of scenes, perception and planners.
        perception: Profile; None leaves stored scenes as they are.
        scene_dir: Folder of stored scenes, or None to generate them.
        templates: Folder of the user's own templates.
        protocol: How episodes are run.
        log: Which episodes leave a log.
        versions: Of everything that may change a number.
        shard: Which part of the scenes runs; None for all.
        machines: What machines ran it; no option, for rows do not depend on it.
    """

    schema: int = SCHEMA
    planners: tuple[PlannerEntry, ...]
    families: dict[str, str]
    scenes_per_family: int | None
    seed: int
    perception: Profile | None
    scene_dir: str | None
    templates: str | None
    protocol: Protocol
    log: Logging
    versions: dict[str, str]
    shard: Shard | None = None
    machines: tuple[dict[str, str], ...] = ()

    def protocol_of(self, planner: str) -> Protocol:
        """Return how the episodes of a planner are run."""
        own = next((e.protocol for e in self.planners if e.name == planner), None)
        return self.protocol if own is None else own


@dataclass(frozen=True, slots=True)
class SceneRef:
    """Where a scene comes from: generated, or read from `path`.

    Attributes:
        family: Its family.
        index: Its number in the family.
        path: Its file; None if it is generated.
        mission: The mission that it is a day of; None for a scene of its own.
    """

    family: str
    index: int
    path: str | None = None
    mission: int | None = None


def generated_scenes(
    families: Sequence[str], scenes_per_family: int, templates: Path | None
) -> tuple[dict[str, str], list[SceneRef]]:
    """Return the hash of each family's files, and the scenes to generate.

    Raises:
        TemplateError: If a family does not exist or its template is no good.
        RunError: If the scenes are no whole missions.
    """
    names = dict.fromkeys(families or default_families(templates))
    for name in names:
        family = load_family(name, templates)
        check_layout(family)
        check_whole(name, scenes_per_family, days_of(family) or 1)
    return _hashed_scenes([*names], scenes_per_family, templates)


def _hashed_scenes(
    names: Sequence[str], scenes_per_family: int, templates: Path | None
) -> tuple[dict[str, str], list[SceneRef]]:
    """Return the same of families that are there, without running any layout's code."""
    hashes = {name: family_sha256(name, templates) for name in names}
    refs = list[SceneRef]()
    for name in names:
        days = days_of(load_family(name, templates))
        refs += [
            SceneRef(name, i, mission=None if days is None else i // days)
            for i in range(scenes_per_family)
        ]
    return hashes, refs


def stored_scenes(
    folder: Path, families: Sequence[str], scenes_per_family: int | None
) -> tuple[dict[str, str], list[SceneRef]]:
    """Return the families, and the scenes, that are stored below `folder`.

    Raises:
        RunError: If there is none, two are the same episode, or days of a mission are
            missing.
        SceneError: If a file is no valid scene.
    """
    found: dict[tuple[str, int], SceneRef] = {}
    scene_of: dict[SceneRef, Scene] = {}
    for path in sorted(folder.rglob("*.json")):
        scene = load_scene(path)
        key = scene.family, scene.index
        if key in found:
            raise RunError(
                f"{path}: expected another family and index than {found[key].path} "
                f"but both are {scene.name}."
            )
        found[key] = SceneRef(*key, str(path.resolve()))
        scene_of[found[key]] = scene
    if not found:
        raise RunError(f"{folder}: expected a folder of scenes (*.json).")
    known = dict.fromkeys(family for family, _ in sorted(found))
    for name in families:
        if name not in known:
            raise RunError(f"{folder}: {unknown('family', name, known)}")
    refs, digests = [], {}
    for name in dict.fromkeys(families or known):
        own = [found[key] for key in sorted(found) if key[0] == name]
        own = own[:scenes_per_family]
        scenes = [scene_of[ref] for ref in own]
        check_stored_days(folder, scenes)
        all_hashes = "".join(scene.sha256 for scene in scenes)
        digests[name] = hashlib.sha256(all_hashes.encode()).hexdigest()
        refs += [
            replace(ref, mission=None if scene.mission is UNSET else scene.mission)
            for ref, scene in zip(own, scenes, strict=True)
        ]
    return digests, refs


def planned_scenes(config: RunConfig) -> list[SceneRef]:
    """Return the scenes of a configured run, or its shard, reading no template.

    Raises:
        BeaconError: If stored scenes are not there, or are no valid ones.
    """
    names, count = [*config.families], config.scenes_per_family
    if config.scene_dir is not None:
        _, refs = stored_scenes(Path(config.scene_dir), names, count)
    else:
        refs = [SceneRef(n, i) for n in names for i in range(count or 0)]
    return share(refs, config.shard)


def scene_refs(config: RunConfig) -> tuple[dict[str, str], list[SceneRef]]:
    """Return the families' hashes and the scenes of a configured run, or its shard."""
    names, count = [*config.families], config.scenes_per_family
    if config.scene_dir is not None:
        hashes, refs = stored_scenes(Path(config.scene_dir), names, count)
    else:
        templates = None if config.templates is None else Path(config.templates)
        hashes, refs = _hashed_scenes(names, count or 0, templates)
    return hashes, share_missions(refs, config.shard)


def load_ref(config: RunConfig, ref: SceneRef) -> Scene:
    """Return the scene, generated or read."""
    if ref.path is None:
        templates = None if config.templates is None else Path(config.templates)
        profile = config.perception or "noisy"
        return cached_scene(ref.family, ref.index, config.seed, profile, templates)
    scene = load_scene(ref.path)
    if config.perception in (None, scene.perception):
        return scene
    return perceive(scene, config.perception, config.seed)
