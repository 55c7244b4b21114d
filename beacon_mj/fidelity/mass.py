"""Mass: density times volume, in the compiled model."""

import numpy as np

from beacon_mj.fidelity.law import Law
from beacon_mj.scene import shapes
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import World


def compiled() -> list[Law]:
    """Every body of a generated scene has the mass density times volume."""
    worst: dict[str, float] = {}
    for family in ("cluttered", "collision-required"):
        scene = generate_scene(family, 0)
        model = World(scene).model
        for o in scene.obstacles:
            ratio = float(model.body(o.id).mass[0]) / o.mass_kg
            kind = shapes.name_of(o.shape)
            worst[kind] = max(worst.get(kind, 1.0), ratio, key=lambda r: abs(r - 1.0))
    return [
        Law(check="mass", law=f"compiled mass of every {kind} over rho V",
            expected=1.0, measured=ratio, tolerance=1e-6)
        for kind, ratio in sorted(worst.items())
    ]  # fmt: skip


def robot() -> list[Law]:
    """The moving bodies of the robot weigh what the scene says."""
    scene = generate_scene("sparse", 0)
    model = World(scene).model
    parts = [model.body(name).mass[0] for name in ("base", "bumper")]
    return [Law(check="mass", law="compiled mass of the robot over its mass",
                expected=1.0, measured=float(np.sum(parts)) / scene.robot.mass_kg,
                tolerance=1e-6)]  # fmt: skip
