"""From a family whose doors hide a latent to a scene with a certificate of learning.

The order is: propose a room; measure what learning is worth in it, from prior and
geometry; throw it away if that is less than promised; only then draw what is true. So
no scene is kept or thrown away for what is true of it, and the prior holds.
"""

import functools
from collections.abc import Mapping

import msgspec
import numpy as np
from msgspec import UNSET

from beacon_mj.errors import GenerationError, SceneError
from beacon_mj.scene import (
    Certificate,
    LearningCertificate,
    LearningPart,
    Obstacle,
    Profile,
    Scene,
)
from beacon_mj.scene.certificates import certify
from beacon_mj.scene.checks import check_scene
from beacon_mj.scene_gen.family import Family
from beacon_mj.scene_gen.learning.certificate import (
    NoWayError,
    certify_parts,
    measured_parts,
)
from beacon_mj.scene_gen.learning.latents import deal, draw_outcomes
from beacon_mj.scene_gen.learning.layouts import LEARNING_LAYOUTS
from beacon_mj.scene_gen.learning.room import Door, Part, Room, door_obstacle
from beacon_mj.scene_gen.perception import ForceErrors, perceive
from beacon_mj.scene_gen.rooms import robot_model_of, robot_of, sensing_of, workspace_m
from beacon_mj.streams import stream

PROPOSALS = 200  #: Proposals per scene before giving up.
#: The same where none of them is worth half of what is promised.
HOPELESS = 20
FAIL_S, PASS_S = 2.0, 0.7  #: What pushes cost where the family does not say [s].
MARGIN_M = 0.02  #: Clearance beyond the disc at which certified ways still exist.


def generate_learning_scene(
    family: Family, index: int, seed: int, perception: Profile
) -> Scene:
    """Generate one scene with a certificate of the value of learning.

    Args:
        family: A family whose layout is among `LEARNING_LAYOUTS`.
        index: Which scene; of missions, the mission times its days plus the day.
        seed: Scene and perception seed.
        perception: Profile of the perceived values, `noisy` (the family's own) or
            `truth`.

    Raises:
        TemplateError: If the family's numbers make no room.
        GenerationError: If no proposal could be certified.
        SceneError: If the profile is `misleading`.
    """
    days = family.whole("day_count") if "day_count" in family.numerics else None
    number, day = (index, 0) if days is None else divmod(index, days)
    room, learning, names = _accepted(family, seed, number)
    doors = _true_doors(family, room, seed, number, day)
    start, goal = room.ways[day]
    scene = Scene(
        family=family.name,
        index=index,
        seed=seed,
        perception="noisy",
        workspace_m=workspace_m(family),
        start_m=start,
        goal_m=goal,
        robot=robot_of(family),
        surfaces=family.surfaces,
        obstacles=_named([*room.walls, *doors], names),
        certificate=_UNPROVED,
        robot_model=robot_model_of(family),
        sensing=sensing_of(family, designed=door_errors(room)),
        mission=UNSET if days is None else number,
        day=UNSET if days is None else day,
        days=UNSET if days is None else days,
    )
    check_scene(scene)
    certificate = certify(scene, MARGIN_M)
    if certificate is None or certificate.collision_free_length_m is not None:
        raise GenerationError(
            f"{family.source}: expected closed doors to leave no way, and open ones "
            f"one, but they did not for index {index}, seed {seed}."
        )
    certificate = msgspec.structs.replace(certificate, learning=learning)
    scene = msgspec.structs.replace(scene, certificate=certificate)
    scene = perceive(scene, perception, seed)
    check_scene(scene)
    return scene


_UNPROVED = Certificate(
    collision_free_length_m=None,
    reference_length_m=1.0,
    straight_line_m=1.0,
    door_ids=(),
    margin_m=0.0,
)


@functools.lru_cache(maxsize=4)
def _accepted(
    family: Family, seed: int, number: int
) -> tuple[Room, LearningCertificate, Mapping[str, str]]:
    """Return a room, its certificate, and the names that its obstacles have.

    The days of a mission share all three: they are worked out for the first of them.
    """
    rng = stream("scene", seed, family.name, "room", number)
    room, learning = _promised(family, rng, f"room {number}, seed {seed}")
    names = _names(room, rng)
    return room, _renamed(learning, names), names


def _promised(
    family: Family, rng: np.random.Generator, which: str
) -> tuple[Room, LearningCertificate]:
    """Return the first proposal in which learning is worth what the family promises."""
    promise = family.value("learning_value", 0.0)
    best: float | None = None
    tried = 0
    while tried < (HOPELESS if 2.0 * (best or 0.0) < promise else PROPOSALS):
        tried += 1
        room = LEARNING_LAYOUTS[family.layout](family, rng)
        try:
            certificate = _certified(family, room)
        except (NoWayError, SceneError):
            continue
        if certificate.value_s >= promise:
            return room, certificate
        best = max(best or 0.0, certificate.value_s)
    if best is None:
        raise GenerationError(
            f"{family.source}: expected rooms that a robot can cross but none of "
            f"{tried} proposals for {which} was one."
        )
    raise GenerationError(
        f"{family.source}: expected learning to be worth {promise:g} s but in "
        f"{tried} proposals for {which} it was at most {best:.2f} s."
    )


def _certified(family: Family, room: Room) -> LearningCertificate:
    """Return the certificate of a proposal, for which no door is anything yet."""
    unsaid = (1.0, 1.0, 1.0)
    doors = {
        d.id: door_obstacle(d, unsaid, d.nominal_n, welded=True) for d in room.doors
    }
    parts = measured_parts(room, robot_of(family), workspace_m(family), doors)
    fail = family.value("push_fail_time", FAIL_S)
    return certify_parts(parts, fail, family.value("push_pass_time", PASS_S))


def door_errors(room: Room) -> ForceErrors:
    """Return how wrong the perceived forces of a room's doors are.

    The control, in which a factor is drawn anew at each stage, has the data sheet of
    the family that it is a control of: no planner can tell the two apart.
    """
    latent = room.parts[0].latent
    return ForceErrors(round(latent.error, 6), round(latent.scale_error, 6))


def _names(room: Room, rng: np.random.Generator) -> dict[str, str]:
    """Return new names that tell nothing of the order in which things were placed."""
    old = [o.id for o in room.walls] + [d.id for d in room.doors]
    return {
        old[k]: f"obstacle_{i:02d}" for i, k in enumerate(rng.permutation(len(old)))
    }


def _named(obstacles: list[Obstacle], names: Mapping[str, str]) -> tuple[Obstacle, ...]:
    named = [msgspec.structs.replace(o, id=names[o.id]) for o in obstacles]
    return tuple(sorted(named, key=lambda o: int(o.id.rpartition("_")[2])))


def _true_doors(
    family: Family, room: Room, seed: int, number: int, day: int
) -> list[Obstacle]:
    """Draw what is true of each door, by the world that is dealt to its part.

    Where the parts are days, only that of the given day counts.
    """
    parts = room.parts
    if len(room.ways) > 1 and len(parts) > 1:
        parts = (parts[day],)
    return [
        obstacle
        for part in parts
        for obstacle in _true_part(family, part, seed, number)
    ]


def _true_part(family: Family, part: Part, seed: int, number: int) -> list[Obstacle]:
    world = deal(part, family.name, seed, number)
    rng = stream("scene", seed, family.name, "doors", part.key, number)
    outcomes = draw_outcomes(part, world, rng)
    doors = dict.fromkeys(d for stage in part.stages for d in stage.doors)
    latent = part.latent
    return [
        door_obstacle(
            door,
            latent.scores or prior_scores(part, door),
            latent.force_n(world, door, outcomes[door.id], rng),
            welded=latent.welded and not outcomes[door.id],
        )
        for door in doors
    ]


def prior_scores(part: Part, door: Door) -> tuple[float, float, float]:
    """Return the scores that are the prior: the probability that the door opens.

    It is that of a door of a stage in which one opens, over all worlds.
    """
    stage = next(s for s in part.stages if door in s.doors)
    total = 0.0
    for world, weight in enumerate(part.latent.weights):
        chances = [part.latent.chance(world, d) for d in stage.doors]
        passable = 1.0 - float(np.prod([1.0 - c for c in chances]))
        total += weight * part.latent.chance(world, door) / passable
    moves = round(total, 6)
    return round(1.0 - moves, 6), moves, 0.0


def _renamed(
    certificate: LearningCertificate, names: Mapping[str, str]
) -> LearningCertificate:
    """Return the certificate with the ids of the scene's obstacles."""
    parts = [
        LearningPart(
            doors=tuple(names[d] for d in part.doors),
            stages=tuple(
                msgspec.structs.replace(s, doors=tuple(names[d] for d in s.doors))
                for s in part.stages
            ),
            weights=part.weights,
            opens=part.opens,
        )
        for part in certificate.parts
    ]
    return msgspec.structs.replace(certificate, parts=tuple(parts))
