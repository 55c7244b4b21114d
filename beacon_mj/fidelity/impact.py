"""Impacts: the bumper's spring, momentum, and damage under half the time step."""

import math

import mujoco
import numpy as np

from beacon_mj.constants import GRAVITY
from beacon_mj.fidelity.benches import bench, block
from beacon_mj.fidelity.law import Law
from beacon_mj.scene import Robot
from beacon_mj.scene_gen.mjcf import BUMPER_MASS_SHARE
from beacon_mj.world import World

MASSES_KG = (0.5, 1.6, 5.0, 16.0, 50.0)  #: Two decades.
SPEED_MPS = 0.4
SLIPPERY = 0.01  #: Friction of the struck boxes.


def spring() -> list[Law]:
    """The spring's peak force is that of its equations of motion.

    Base M and ring m_r, joined by spring k and damper c = 2 sqrt(k m_r), meet a box m
    through MuJoCo's soft contact. Undamped and rigid that is v sqrt(k m_eff) with
    1/m_eff = 1/(M + m_r) + 1/m, an upper bound. Coasting (the drive off) and driven
    (the servo adds its force, up to F_max, while it holds the speed).
    """
    rows = []
    for driven in (False, True):
        for mass in MASSES_KG:
            expected = reference_peak_n(mass, SPEED_MPS, driven)
            law = (
                f"bumper peak on {mass:g} kg at {SPEED_MPS} m/s, "
                f"{'driven' if driven else 'coasting'}: equations of motion"
            )
            rows.append(Law(check="impact", law=law, expected=expected, unit="N",
                            measured=measured_peak_n(mass, SPEED_MPS, driven),
                            tolerance=0.12 * expected))  # fmt: skip
    return rows


def measured_peak_n(
    mass_kg: float, speed_mps: float, driven: bool, timestep_s: float = 0.002
) -> float:
    """Return the largest force in the bumper's spring when it strikes a box [N]."""
    peak = [0.0]

    def watch() -> None:
        peak[0] = max(peak[0], -float(world.bumper_force_n[0]))

    scene = bench(block(gap_m=0.1, mass_kg=mass_kg, friction=SLIPPERY))
    world = World(scene, timestep_s, watch)
    world.data.qvel[0] = speed_mps
    if not driven:
        world.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    for _ in range(math.ceil(1.0 / speed_mps) + 3):
        world.step(np.array([speed_mps, 0.0]))
    return peak[0]


def reference_peak_n(mass_kg: float, speed_mps: float, driven: bool) -> float:
    """Integrate base, ring and box with steps of 0.1 ms; return the spring's peak [N].

    The contact is MuJoCo's: relative acceleration (1 - d) a0 - d (b v + k y), with
    time constant 0.02 s, damping ratio 1, and impedance d from 0.9 to 0.95 over 1 mm.
    """
    robot, dt = Robot(), 1e-4
    ring = BUMPER_MASS_SHARE * robot.mass_kg
    base, stiffness = robot.mass_kg - ring, robot.bumper_stiffness_npm
    damping, drag = 2.0 * math.sqrt(stiffness * ring), SLIPPERY * mass_kg * GRAVITY
    x, v, peak = np.zeros(3), np.array([speed_mps, speed_mps, 0.0]), 0.0
    for _ in range(2500):
        spring_n = stiffness * (x[0] - x[1]) + damping * (v[0] - v[1])
        touch = _contact_n(x[1] - x[2], v[1] - v[2], spring_n / ring + drag / mass_kg,
                           1.0 / ring, 1.0 / mass_kg)  # fmt: skip
        limit = robot.force_max_n if driven else 0.0
        servo = 200.0 * robot.mass_kg * (speed_mps - v[0])
        drive = min(limit, max(-limit, servo))
        sliding = v[2] > 0.0 or touch > drag
        v += dt * np.array(
            [
                (drive - spring_n) / base,
                (spring_n - touch) / ring,
                (touch - drag) / mass_kg if sliding else 0.0,
            ]
        )
        x += dt * v
        peak = max(peak, stiffness * (x[0] - x[1]))
    return float(peak)


def _contact_n(
    depth: float, closing: float, free: float, ring: float, box: float
) -> float:
    """Return the force of a soft contact, from inverse masses [N]."""
    if depth < 0.0:
        return 0.0
    share = min(1.0, depth / 1e-3)
    blend = 2.0 * share**2 if share < 0.5 else 1.0 - 2.0 * (1.0 - share) ** 2
    impedance = 0.9 + 0.05 * blend
    damping, stiffness = 2.0 / (0.95 * 0.02), impedance / (0.95 * 0.02) ** 2
    # MuJoCo takes the mean inverse mass over three axes; the ring has two.
    softness = (1.0 - impedance) / impedance * (2.0 / 3.0 * ring + box)
    return max(
        0.0,
        (free + damping * closing + stiffness * depth) / (ring + box + softness),
    )


def momentum() -> list[Law]:
    """The contact's impulse is the change of the box's momentum, plus friction."""
    rows = []
    for mass in (1.0, 4.0, 16.0):
        world = World(bench(block(gap_m=0.05, mass_kg=mass, friction=SLIPPERY)))
        impulse, moving_s = 0.0, 0.0
        for _ in range(8):
            outcome = world.step(np.array([SPEED_MPS, 0.0]))
            impulse += sum(c.impulse_ns for c in outcome.contacts)
            moving_s += 0.1 * bool(outcome.displacements)
        drag = SLIPPERY * mass * GRAVITY * moving_s
        expected = mass * float(world.data.qvel[4]) + drag
        law = f"impulse on {mass:g} kg: m dv + mu m g t"
        rows.append(Law(check="momentum", law=law, expected=expected, unit="N s",
                        measured=impulse, tolerance=0.02 * expected))  # fmt: skip
    return rows


def damage() -> list[Law]:
    """Half the time step changes no verdict of 64 blows.

    Blows whose filtered peak is within 5 % of the limit are left out: there the
    verdict hangs on the step, as it would on a per cent of mass.
    """
    differ = counted = 0
    for mass in (0.8, 2.5):
        for speed in (0.1, 0.2, 0.3, 0.4):
            coarse, fine = (_filtered_peak_n(mass, speed, dt) for dt in (0.002, 0.001))
            for limit in (4.0, 6.0, 9.0, 13.0, 19.0, 27.0, 35.0, 50.0):
                if abs(coarse / limit - 1.0) > 0.05:
                    counted += 1
                    differ += (coarse > limit) != (fine > limit)
    law = f"verdicts of {counted} blows that change when the time step is halved"
    return [Law(check="damage", law=law, expected=0.0, measured=float(differ),
                tolerance=0.0)]  # fmt: skip


def _filtered_peak_n(mass_kg: float, speed_mps: float, timestep_s: float) -> float:
    """Return the largest force that can break a struck box [N]."""
    world = World(bench(block(gap_m=0.08, mass_kg=mass_kg)), timestep_s)
    peak = 0.0
    for _ in range(math.ceil(0.8 / speed_mps) + 5):
        outcome = world.step(np.array([speed_mps, 0.0]))
        peak = max([peak, *(c.filtered_peak_n for c in outcome.contacts)])
    return peak
