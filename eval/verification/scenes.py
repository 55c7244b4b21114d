"""Level `scenes`: every scene is what its family, index and seed give."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec

from beacon_mj.errors import BeaconError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import RunConfig, SceneRef, load_ref
from beacon_mj.eval.runs.worker_process import in_parallel
from beacon_mj.eval.statistics.grouping import NO_SUITE
from beacon_mj.eval.verification.checks import Check
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.family import family_paths, family_sha256
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.perception import perceive
from beacon_mj.scene_gen.suites import released_suite, suite_of


class Found(NamedTuple):
    """A scene that was made again.

    Attributes:
        sha256: Its hash; empty if it could not be made.
        problem: Why not, or how the stored one differs from it.
        generated: Whether it came from the generator, and not from a file alone.
        suite: The released suite that it is of, if any.
    """

    sha256: str
    problem: str
    generated: bool
    suite: str | None = None


def check_scenes(
    run: Path,
    config: RunConfig,
    refs: Sequence[SceneRef],
    rows: Sequence[Row],
    workers: int,
) -> Check:
    """Make each scene again and compare its hash with those of its rows.

    Scenes that are stored are read, their certificates proved again, and those of a
    shipped family generated too. Nothing comes from the cache of scenes.

    Args:
        run: The run folder, for messages.
        config: Its configuration.
        refs: Its scenes.
        rows: Its rows.
        workers: Processes.
    """
    problems = list(family_problems(run, config))
    hashes = {(row.family, row.scene_index): row.scene_sha256 for row in rows}
    claims = {(row.family, row.scene_index): row.suite for row in rows}
    wanted = [ref for ref in refs if (ref.family, ref.index) in hashes]
    generated = 0
    for ref, found in in_parallel(_made, [(config, ref) for ref in wanted], workers):
        stored = hashes[ref.family, ref.index]
        generated += found.generated
        if found.problem:
            problems.append(f"{run}: {found.problem}")
        elif found.sha256 != stored:
            problems.append(
                f"{run}: {ref.family}_{ref.index:04d} is not what its family, index "
                f"and seed give: {stored[:12]} in the rows, {found.sha256[:12]} made "
                "again"
            )
        elif (claim := claims[ref.family, ref.index]) != found.suite:
            problems.append(
                f"{run}: {ref.family}_{ref.index:04d} is of "
                f"{claim or NO_SUITE} in the rows, but of {found.suite or NO_SUITE}"
            )
    note = f"{generated} scenes generated again"
    if kept := len(wanted) - generated:
        note += (
            f"; {kept} stored ones of other families: only their certificates proved"
        )
    return Check(level="scenes", problems=tuple(sorted(problems)), note=note)


def regenerated(scene: Scene) -> Scene | None:
    """Return what the generator gives for a scene of a shipped family, else None."""
    if scene.family not in family_paths():
        return None
    try:
        return generate_scene(scene.family, scene.index, scene.seed, scene.perception)
    except BeaconError:
        return None


def family_problems(run: Path | str, config: RunConfig) -> Mapping[str, None]:
    """Return a line for each family whose files are others now."""
    if config.scene_dir is not None:
        return {}
    for name, each in config.scenes.items():
        suite = released_suite(name, config.families.get(name, ""))
        if each.suite != suite:
            return {
                f"{run}: family {name} is of {each.suite or NO_SUITE} in its "
                f"configuration, but of {suite or NO_SUITE}": None
            }
    templates = None if config.templates is None else Path(config.templates)
    lines: dict[str, None] = {}
    for name, digest in config.families.items():
        try:
            same = family_sha256(name, templates) == digest
        except BeaconError as error:
            lines[f"{run}: {error}"] = None
            continue
        if not same:
            lines[f"{run}: the files of family {name} are not those of the run"] = None
    return lines


def _made(config: RunConfig, ref: SceneRef) -> tuple[SceneRef, Found]:
    """Make one scene of a run anew."""
    try:
        if ref.path is None:
            suite = released_suite(ref.family, config.families[ref.family])
            return ref, Found(_generated(config, ref).sha256, "", True, suite)
        return ref, _stored(config, ref)
    except BeaconError as error:
        return ref, Found("", str(error), False)


def _generated(config: RunConfig, ref: SceneRef) -> Scene:
    templates = None if config.templates is None else Path(config.templates)
    profile = config.perception or "noisy"
    return generate_scene(ref.family, ref.index, config.seed, profile, templates)


def _stored(config: RunConfig, ref: SceneRef) -> Found:
    """Read a stored scene as the run did; generate it too, if its family is shipped."""
    scene = load_ref(config, ref)
    if ref.family not in family_paths():
        return Found(scene.sha256, "", False)
    plain = load_ref(_as_stored(config), ref)
    ours = generate_scene(ref.family, ref.index, plain.seed, plain.perception)
    if config.perception not in (None, plain.perception):
        ours = perceive(ours, config.perception, config.seed)
    if ours.sha256 == scene.sha256:
        return Found(scene.sha256, "", True, suite_of(ref.family))
    return Found(
        scene.sha256,
        f"{ref.path}: is not what family {ref.family} gives for index {ref.index} and "
        f"seed {plain.seed}: a scene that was edited needs a family name of its own",
        True,
    )


def _as_stored(config: RunConfig) -> RunConfig:
    return msgspec.structs.replace(config, perception=None)
