"""What an evaluation runs: everything that is needed to repeat it."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import msgspec

from beacon_mj.constants import SCHEMA
from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import RunError, unknown
from beacon_mj.eval.runs.isolation.host import describe_isolated
from beacon_mj.eval.runs.overrides import Settings, configure, convert, parse_settings
from beacon_mj.eval.runs.scene_cache import cached_scene
from beacon_mj.eval.runs.shards import Shard, share
from beacon_mj.planners.registry import ALIASES, PAPER, file_planner, load_planner
from beacon_mj.scene import Profile, Scene
from beacon_mj.scene.files import load_scene
from beacon_mj.scene_gen.family import family_paths, family_sha256, load_family
from beacon_mj.scene_gen.perception import perceive

Logging = Literal["all", "failures", "none"]


class PlannerEntry(msgspec.Struct, frozen=True, kw_only=True):
    """One planner of a run.

    Attributes:
        name: Its name in results.
        spec: What it is loaded by: a name or `path/to/file.py:ClassName`.
        settings: Values given with `--set`, as text.
        config: All values of its configuration, defaults included.
        isolated: Whether it runs in a process of its own.
    """

    name: str
    spec: str
    settings: dict[str, str]
    config: dict[str, Any]
    isolated: bool = False


class RunConfig(msgspec.Struct, frozen=True, kw_only=True):
    """An evaluation. Two runs with equal configurations have equal results.

    Attributes:
        schema: Version of the run folder and its rows; see `beacon_mj.constants`.
        planners: Who runs, each through every scene.
        families: SHA-256 of each family's files, by name; of stored scenes, of all
            their hashes.
        episodes: Scenes per family; None for all that are stored.
        seed: Seed of scenes, perception and planners.
        perception: Profile; None leaves stored scenes as they are.
        scenes: Folder of stored scenes, or None to generate them.
        templates: Folder of the user's own templates.
        protocol: How episodes are run.
        log: Which episodes leave a log.
        versions: Of everything that may change a number.
        shard: Which part of the scenes runs; None for all.
    """

    schema: int = SCHEMA
    planners: tuple[PlannerEntry, ...]
    families: dict[str, str]
    episodes: int | None
    seed: int
    perception: Profile | None
    scenes: str | None
    templates: str | None
    protocol: Protocol
    log: Logging
    versions: dict[str, str]
    shard: Shard | None = None


@dataclass(frozen=True, slots=True)
class SceneRef:
    """Where a scene comes from: generated, or read from `path`."""

    family: str
    index: int
    path: str | None = None


def planner_entries(
    specs: Sequence[str], settings: Sequence[str], isolate: bool | None = None
) -> tuple[tuple[PlannerEntry, ...], Protocol]:
    """Return the planners and the protocol that the user asked for.

    Args:
        specs: Names, `all`, or `file.py:Class`.
        settings: `planner.field=value` or `protocol.field=value`.
        isolate: Whether planners run in processes of their own; if None, those from
            files do.

    Raises:
        PlannerError: If a planner, a field or a value is no good, or an oracle is to be
            isolated.
        RunError: If two planners have one name, or a setting names none of them.
    """
    wanted = [s for spec in specs for s in (PAPER if spec == "all" else [spec])]
    loaded: dict[str, tuple[str, bool]] = {}
    for spec in dict.fromkeys(ALIASES.get(s, s) for s in wanted):
        member = file_planner(spec)
        isolated = member is not None if isolate is None else isolate
        name = member if isolated and member else load_planner(spec)[0]
        if name in loaded or name == "protocol":
            raise RunError(
                f"Expected planners to have names of their own but {name!r} repeats."
            )
        loaded[name] = spec, isolated
    parsed = parse_settings([_canonical(s) for s in settings], ["protocol", *loaded])
    protocol = _protocol(parsed)
    entries = []
    for name, (spec, isolated) in loaded.items():
        own = dict(parsed.get(name, {}))
        config = configuration(spec, own, name, protocol if isolated else None)
        entries.append(
            PlannerEntry(
                name=name, spec=spec, settings=own, config=config, isolated=isolated
            )
        )
    return tuple(entries), protocol


def configuration(
    spec: str, settings: dict[str, str], name: str, isolated: Protocol | None
) -> dict[str, Any]:
    """Return all values of a planner's configuration, as plain data.

    Args:
        spec: What the planner is loaded by.
        settings: Values given as text.
        name: Its name in messages.
        isolated: The protocol whose limits hold if the planner is only to be imported
            in a process of its own; None to import it here.

    Raises:
        PlannerError: If the planner, a field or a value is no good.
    """
    if isolated is None:
        config: dict[str, Any] = msgspec.to_builtins(
            configure(load_planner(spec)[1], settings, name)
        )
        return config
    limits = isolated.decision_limit_s, isolated.memory_limit_mib
    return describe_isolated(spec, settings, name, *limits)


def _canonical(setting: str) -> str:
    target, dot, rest = setting.partition(".")
    return ALIASES.get(target, target) + dot + rest


def _protocol(parsed: Settings) -> Protocol:
    return convert(Protocol, parsed.get("protocol", {}), "protocol", RunError)


def generated_scenes(
    families: Sequence[str], episodes: int, templates: Path | None
) -> tuple[dict[str, str], list[SceneRef]]:
    """Return the hash of each family's files, and the scenes to generate.

    Raises:
        TemplateError: If a family does not exist or its template is no good.
    """
    names = dict.fromkeys(families or family_paths(templates))
    for name in names:
        load_family(name, templates)
    hashes = {name: family_sha256(name, templates) for name in names}
    return hashes, [SceneRef(n, i) for n in names for i in range(episodes)]


def stored_scenes(
    folder: Path, families: Sequence[str], episodes: int | None
) -> tuple[dict[str, str], list[SceneRef]]:
    """Return the families, and the scenes, that are stored below `folder`.

    Raises:
        RunError: If there is none, or two are the same episode.
        SceneError: If a file is no valid scene.
    """
    found: dict[tuple[str, int], SceneRef] = {}
    for path in sorted(folder.rglob("*.json")):
        scene = load_scene(path)
        key = scene.family, scene.index
        if key in found:
            raise RunError(
                f"{path}: expected another family and index than {found[key].path} "
                f"but both are {scene.name}."
            )
        found[key] = SceneRef(*key, str(path.resolve()))
    if not found:
        raise RunError(f"{folder}: expected a folder of scenes (*.json).")
    known = dict.fromkeys(family for family, _ in sorted(found))
    for name in families:
        if name not in known:
            raise RunError(f"{folder}: {unknown('family', name, known)}")
    refs, digests = [], {}
    for name in dict.fromkeys(families or known):
        own = [found[key] for key in sorted(found) if key[0] == name][:episodes]
        hashes = "".join(load_scene(ref.path).sha256 for ref in own if ref.path)
        digests[name] = hashlib.sha256(hashes.encode()).hexdigest()
        refs += own
    return digests, refs


def scene_refs(config: RunConfig) -> tuple[dict[str, str], list[SceneRef]]:
    """Return the families' hashes and the scenes of a configured run, or its shard."""
    names, episodes = [*config.families], config.episodes
    if config.scenes is not None:
        hashes, refs = stored_scenes(Path(config.scenes), names, episodes)
    else:
        templates = None if config.templates is None else Path(config.templates)
        hashes, refs = generated_scenes(names, episodes or 0, templates)
    return hashes, share(refs, config.shard)


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
