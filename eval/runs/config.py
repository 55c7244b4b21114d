"""What an evaluation runs: everything that is needed to repeat it."""

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import UNSET, Meta

from beacon_mj.constants import SCHEMA
from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import RunError, TemplateError, unknown
from beacon_mj.eval.runs.missions import (
    check_stored_days,
    check_whole,
    days_of,
    share_missions,
)
from beacon_mj.eval.runs.scene_cache import cached_scene, released_scene_suite
from beacon_mj.eval.runs.shards import Shard, share
from beacon_mj.eval.runs.whole_numbers import SceneCount, Seed, check_episodes
from beacon_mj.files import files_below
from beacon_mj.planners.program import is_program
from beacon_mj.scene import Profile, Scene
from beacon_mj.scene.files import load_scene
from beacon_mj.scene_gen.family import family_sha256, load_family
from beacon_mj.scene_gen.learning.rounds import (
    SCENES,
    cut_round,
    default_scenes,
    round_scenes,
)
from beacon_mj.scene_gen.own_layouts import check_layout
from beacon_mj.scene_gen.perception import perceive
from beacon_mj.scene_gen.suites import chosen_families, released_suite

Logging = Literal["all", "failures", "none"]


class PlannerEntry(msgspec.Struct, frozen=True, kw_only=True):
    """One planner of a run.

    Attributes:
        name: Its name in results.
        spec: What it is loaded by: a name, `path/to/file.py:ClassName`, or
            `exec:COMMAND`.
        settings: Values given with `--set`, as text.
        config: All values of its configuration, defaults included.
        protocol: How its episodes are run, where that differs from the run's.
        varied: Values by `planner.field` or `protocol.field` in which it differs from
            its variants: the columns `set.planner.field` of the rows.
        isolated: Whether it runs in a process of its own.
        oracle: Whether it is told the truth about each world: a reference planner,
            whatever its name, and marked as one in every row and table.
        bit_reproducible: Whether its rows are the same each time and everywhere, as its
            class says; tables have a note of those that are not.
        code: SHA-256 of its file and of the local modules that it imports, by path
            below the file's folder; of a program, of the files that its command names;
            and of the files that its settings name.
        home: Whole path of the file that it is loaded from, or a program's command with
            whole paths; no option, for a run may go on where the file lies elsewhere.
    """

    name: str
    spec: str
    settings: dict[str, str]
    config: dict[str, Any]
    protocol: Protocol | None = None
    varied: dict[str, str] = {}
    isolated: bool = False
    oracle: bool = False
    bit_reproducible: bool = True
    code: dict[str, str] = {}
    home: str = ""

    @property
    def loaded_from(self) -> str:
        """What it is loaded by, in every folder."""
        if is_program(self.spec):
            return self.home or self.spec
        member = self.spec.rpartition(":")[2]
        return f"{self.home}:{member}" if self.home else self.spec

    @property
    def base(self) -> str:
        """The planner's name without what is varied in it."""
        return self.name.partition("[")[0] if self.varied else self.name


class FamilyScenes(msgspec.Struct, frozen=True, kw_only=True):
    """What a run has of a family.

    Attributes:
        suite: The released suite whose scenes these are; None for others, and of
            stored scenes, of which each row says it.
        count: Number of scenes, of all shards together.
        round: Scenes of a whole round of its latent worlds; 1 where nothing is dealt in
            rounds.
    """

    suite: str | None
    count: SceneCount
    round: SceneCount = 1


class RunConfig(msgspec.Struct, frozen=True, kw_only=True):
    """An evaluation. Two runs with equal configurations have equal results.

    Attributes:
        schema: Version of the run folder and its rows; see `beacon_mj.constants`.
        planners: Who runs, each through every scene.
        families: SHA-256 of each family's files, by name; of stored scenes, of all
            their hashes.
        scenes: Suite, number of scenes and length of a round of each family, by name.
        scenes_per_family: Scenes per family, as asked for; None for the whole rounds
            nearest to 100, or for all that are stored.
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

    schema: Annotated[int, Meta(ge=1, le=10**6)] = SCHEMA
    planners: tuple[PlannerEntry, ...]
    families: dict[str, str]
    scenes: dict[str, FamilyScenes] = {}
    scenes_per_family: SceneCount | None
    seed: Seed
    perception: Profile | None
    scene_dir: str | None
    templates: str | None
    protocol: Protocol
    log: Logging
    versions: dict[str, str]
    shard: Shard | None = None
    machines: tuple[dict[str, str], ...] = ()

    @property
    def inexact(self) -> list[str]:
        """Planners that say that their rows need not repeat."""
        return [e.name for e in self.planners if not e.bit_reproducible]

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
    families: Sequence[str],
    scenes_per_family: int | None,
    templates: Path | None,
    suites: Sequence[str] = (),
    about: int = SCENES,
) -> tuple[dict[str, str], list[SceneRef]]:
    """Return the hash of each family's files, and the scenes to generate.

    Args:
        families: Names of families.
        scenes_per_family: Scenes of each; None for the whole rounds nearest to `about`.
        templates: Folder of the user's own templates.
        suites: Suites, in place of `families`.
        about: See `scenes_per_family`.

    Raises:
        TemplateError: If a family does not exist or its template is no good.
        RunError: If the scenes are no whole missions.
    """
    counts = {}
    for name in chosen_families(families, suites, templates):
        family = load_family(name, templates)
        check_layout(family)
        counts[name] = scenes_per_family or default_scenes(family, about)
        check_whole(name, counts[name], days_of(family) or 1)
    return _hashed_scenes(counts, templates)


def _hashed_scenes(
    counts: Mapping[str, int], templates: Path | None
) -> tuple[dict[str, str], list[SceneRef]]:
    """Return the same of families that are there, without running any layout's code."""
    check_episodes(sum(counts.values()))
    hashes = {name: family_sha256(name, templates) for name in counts}
    refs = list[SceneRef]()
    for name, count in counts.items():
        days = days_of(load_family(name, templates))
        refs += [
            SceneRef(name, i, mission=None if days is None else i // days)
            for i in range(count)
        ]
    return hashes, refs


def family_scenes(
    hashes: Mapping[str, str],
    refs: Sequence[SceneRef],
    templates: Path | None,
    *,
    stored: bool = False,
) -> dict[str, FamilyScenes]:
    """Return what a run has of each family.

    Args:
        hashes: SHA-256 of each family's files.
        refs: All scenes of the run.
        templates: Folder of the user's own templates.
        stored: Whether the scenes are read; of these nothing but the number is known.
    """
    counts = Counter(ref.family for ref in refs)
    if stored:
        return {n: FamilyScenes(suite=None, count=counts[n]) for n in hashes}
    return {
        name: FamilyScenes(
            suite=released_suite(name, sha256),
            count=counts[name],
            round=round_scenes(load_family(name, templates)),
        )
        for name, sha256 in hashes.items()
    }


def cut_rounds(scenes: Mapping[str, FamilyScenes]) -> list[str]:
    """Return a line for each family of which a run cuts a round."""
    lines = (cut_round(n, each.count, each.round) for n, each in scenes.items())
    return [line for line in lines if line is not None]


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
    for path in files_below(folder, ".json"):
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
    """Return the scenes of a configured run, or its shard.

    Where the run's own templates are not there, days of a mission are scenes of their
    own: their number is known all the same.

    Raises:
        BeaconError: If stored scenes are not there, or are no valid ones.
    """
    try:
        return scene_refs(config)[1]
    except TemplateError:
        counts = _counts(config).items()
        refs = [SceneRef(name, i) for name, count in counts for i in range(count)]
        return share(refs, config.shard)


def scene_refs(config: RunConfig) -> tuple[dict[str, str], list[SceneRef]]:
    """Return the families' hashes and the scenes of a configured run, or its shard."""
    if config.scene_dir is not None:
        names, count = [*config.families], config.scenes_per_family
        hashes, refs = stored_scenes(Path(config.scene_dir), names, count)
    else:
        templates = None if config.templates is None else Path(config.templates)
        hashes, refs = _hashed_scenes(_counts(config), templates)
    return hashes, share_missions(refs, config.shard)


def _counts(config: RunConfig) -> dict[str, int]:
    """Return the number of generated scenes by family. Raises RunError if too many."""
    counts = dict.fromkeys(config.families, config.scenes_per_family or 0)
    counts |= {name: each.count for name, each in config.scenes.items()}
    check_episodes(sum(counts.values()), len(config.planners))
    return counts


def suite_of_ref(config: RunConfig, ref: SceneRef, scene: Scene) -> str | None:
    """Return the released suite that a scene of a run is of, or None.

    A stored scene is of a suite if it is the one that the shipped family gives.
    """
    if ref.path is not None:
        return released_scene_suite(scene)
    own = config.scenes.get(ref.family)
    return None if own is None else own.suite


def with_count(config: RunConfig, scenes_per_family: int) -> RunConfig:
    """Return a run with another number of scenes of each family."""
    replace = msgspec.structs.replace
    counted = {
        name: replace(each, count=scenes_per_family)
        for name, each in config.scenes.items()
    }
    return replace(config, scenes=counted, scenes_per_family=scenes_per_family)


def load_ref(config: RunConfig, ref: SceneRef) -> Scene:
    """Return the scene, generated or read."""
    if ref.path is None:
        templates = None if config.templates is None else Path(config.templates)
        profile = config.perception or "noisy"
        files = config.families[ref.family]
        return cached_scene(
            ref.family, ref.index, config.seed, profile, templates, files
        )
    scene = load_scene(ref.path)
    if config.perception in (None, scene.perception):
        return scene
    return perceive(scene, config.perception, config.seed)
