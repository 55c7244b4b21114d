"""From a family and a seed to a certified scene."""

from pathlib import Path

import msgspec
import numpy as np

from beacon_mj.errors import (
    GenerationError,
    MalformedSceneError,
    SceneError,
    unknown,
)
from beacon_mj.scene import Certificate, Obstacle, Profile, Scene
from beacon_mj.scene.certificates import certify
from beacon_mj.scene.checks import check_scene
from beacon_mj.scene_gen.family import Family, load_family
from beacon_mj.scene_gen.layouts import Layout, NoRoomError
from beacon_mj.scene_gen.learning.generate import generate_learning_scene
from beacon_mj.scene_gen.learning.layouts import LEARNING_LAYOUTS
from beacon_mj.scene_gen.own_layouts import find_layout
from beacon_mj.scene_gen.perception import perceive
from beacon_mj.scene_gen.rooms import (
    robot_model_of,
    robot_of,
    sensing_of,
    start_and_goal,
    workspace_m,
)
from beacon_mj.scene_gen.sampling import NoMaterialError, Sampler
from beacon_mj.streams import stream

MARGIN_M = 0.02  #: Clearance beyond the disc at which certified ways still exist.
PROPOSALS = 100  #: Proposals per scene before giving up.
CROWDED = 10  #: The same if the obstacles never even fit, or none can be made.
_NO_ROOM = "no room for that many obstacles"
_NO_MATERIAL = "no material that fits a shape"


def generate_scene(
    family: str | Family,
    index: int,
    seed: int = 0,
    perception: Profile = "noisy",
    templates: Path | None = None,
) -> Scene:
    """Generate one certified scene; the same arguments give the same bytes.

    Args:
        family: Name of a family, or one that was read already.
        index: Which scene of the family, >= 0.
        seed: Scene and perception seed.
        perception: Profile of the perceived values.
        templates: Folder of the user's own templates, if any.

    Raises:
        TemplateError: If the family is unknown or invalid.
        GenerationError: If no proposal could be certified.
    """
    if isinstance(family, str):
        family = load_family(family, templates)
    if family.layout in LEARNING_LAYOUTS:
        return generate_learning_scene(family, index, seed, perception)
    layout = find_layout(family)
    rng = stream("scene", seed, family.name, index)
    reasons: dict[str, int] = {}
    for _ in range(PROPOSALS):
        try:
            proposal = _propose(family, layout, index, seed, rng)
            check_scene(proposal)
        except NoRoomError:
            _count(reasons, _NO_ROOM)
            if reasons == {_NO_ROOM: CROWDED}:
                break
            continue
        except NoMaterialError:
            _count(reasons, _NO_MATERIAL)
            if reasons == {_NO_MATERIAL: CROWDED}:
                raise
            continue
        except MalformedSceneError as error:
            _count(reasons, str(error).rstrip("."))
            continue
        except SceneError:
            _count(reasons, "overlap")
            continue
        certificate = certify(proposal, MARGIN_M)
        missing = _missing(family, certificate)
        if certificate is not None and missing is None:
            scene = msgspec.structs.replace(proposal, certificate=certificate)
            scene = perceive(scene, perception, seed)
            check_scene(scene)
            return scene
        _count(reasons, missing or "inconclusive")
    worst = max(reasons, key=lambda r: reasons[r])
    raise GenerationError(
        f"{family.source}: no certified scene in {sum(reasons.values())} proposals "
        f"for index {index}, seed {seed}; most often: {worst}."
    )


def _count(reasons: dict[str, int], reason: str) -> None:
    reasons[reason] = reasons.get(reason, 0) + 1


def _propose(
    family: Family, layout: Layout, index: int, seed: int, rng: np.random.Generator
) -> Scene:
    robot, room = robot_of(family), workspace_m(family)
    start, goal = start_and_goal(rng, room)
    sampler = Sampler(family=family, robot=robot, rng=rng)
    placed = layout(sampler, start, goal)
    order = rng.permutation(len(placed))
    obstacles = tuple(
        msgspec.structs.replace(placed[k], id=f"obstacle_{i:02d}")
        for i, k in enumerate(order)
    )
    return Scene(
        family=family.name,
        index=index,
        seed=seed,
        perception="truth",
        workspace_m=room,
        start_m=start,
        goal_m=goal,
        robot=robot,
        surfaces=family.surfaces,
        obstacles=obstacles,
        certificate=Certificate(
            collision_free_length_m=None,
            reference_length_m=1.0,
            straight_line_m=1.0,
            door_ids=(),
            margin_m=0.0,
        ),
        robot_model=robot_model_of(family),
        sensing=sensing_of(family),
    )


def _missing(family: Family, certificate: Certificate | None) -> str | None:
    """Return what the family promises and the certificate does not show, or None."""
    if certificate is None:
        return "inconclusive"
    free = certificate.collision_free_length_m
    if family.layout == "barrier":
        if free is not None:
            return "a collision-free path exists"
        return None if certificate.door_ids else "no door opens a way"
    if free is None:
        return "no collision-free path exists"
    if family.layout == "gated" and not certificate.door_ids:
        return "no door shortens the way"
    if family.layout in ("gated", "warehouse"):
        if free < family.value("shortcut_ratio") * certificate.reference_length_m:
            return "the way round is too short"
        return None
    if "detour_limit" in family.numerics:
        if free > family.value("detour_limit") * certificate.straight_line_m:
            return "the collision-free path is too long"
    return None


def obstacle_of(scene: Scene, obstacle_id: str) -> Obstacle:
    """Return one obstacle of a scene by its id."""
    for o in scene.obstacles:
        if o.id == obstacle_id:
            return o
    raise SceneError(unknown("obstacle", obstacle_id, (o.id for o in scene.obstacles)))
