"""Bodies are solid: the disc passes through nothing, wherever it is pressed."""

import msgspec
import numpy as np

from beacon_mj.fidelity.law import Law
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import World

FAMILIES = ("cluttered", "collision-required", "collision-shortcut")
ROOMS = 3  #: Rooms of each family.
SEED = 4000
STEPS = 150
GIVES_M = 0.006  #: What the soft contact may give at the first blow [m].


def corners() -> list[Law]:
    """Drive at the goal, at full force, through rooms whose obstacles are all fixed.

    The robot is pressed into faces, corners, and gaps narrower than itself.
    """
    depth = max(sunk_m(family, i) for family in FAMILIES for i in range(ROOMS))
    law = f"depth of the disc in fixed obstacles, {ROOMS * len(FAMILIES)} rooms: none"
    return [Law(check="corner", law=law, expected=0.0, tolerance=1e3 * GIVES_M,
                unit="mm", measured=1e3 * depth)]  # fmt: skip


def sunk_m(family: str, index: int) -> float:
    """Return how deep the bumper was at most in any footprint of one room [m]."""
    scene = generate_scene(family, index, seed=SEED)
    fixed = tuple(
        msgspec.structs.replace(o, interaction="safe", fixed=True, break_force_n=None)
        for o in scene.obstacles
    )
    world = World(msgspec.structs.replace(scene, obstacles=fixed))
    goal, sunk = np.array(scene.goal_m), 0.0
    for _ in range(STEPS):
        towards = goal - world.position_m
        world.step(0.5 * towards / max(0.5, np.hypot(*towards)))
        bumper = world.position_m + world.data.qpos[2:4]
        gap = float(world.footprints.distance(bumper).min()) - scene.robot.radius_m
        sunk = max(sunk, -gap)
    return sunk
