"""Repeatability: the same commands give the same bits, whichever way they are run."""

import hashlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import mujoco
import numpy as np

from beacon_mj.fidelity.benches import bench, block, obstacle
from beacon_mj.fidelity.law import Law
from beacon_mj.scene.shapes import Sphere
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import SimulationError, World

STEPS = 120


def wander(world: World) -> str:
    """Drive toward the goal with a fixed wobble; return a digest of all states."""
    rng = np.random.default_rng(0)
    goal = np.array(world.scene.goal_m)
    digest = hashlib.sha256()
    for _ in range(STEPS):
        ahead = goal - world.position_m
        world.step(0.4 * ahead / np.hypot(*ahead) + rng.normal(0.0, 0.2, 2))
        digest.update(world.data.qpos.tobytes() + world.data.qvel.tobytes())
    return digest.hexdigest()


def digest() -> str:
    """Return the digest of a fixed run in a fresh world."""
    return wander(World(generate_scene("cluttered", 0)))


def provoke() -> str:
    """Make MuJoCo warn; return the error that this became, or nothing."""
    world = World(bench(block()))
    world.data.qvel[4] = np.nan
    try:
        world.step(np.zeros(2))
    except SimulationError as error:
        return str(error)
    return ""


def bitwise() -> list[Law]:
    """Two worlds, a world that was reset, and another process end in the same bits."""
    first = digest()
    world = World(generate_scene("cluttered", 0))
    second = wander(world)
    world.reset()
    third = wander(world)
    other, _ = _elsewhere("digest")
    return [
        _same("states of two worlds under the same commands", first == second),
        _same("states of a world that was reset", first == third),
        _same("states in another process", first == other),
    ]


def quiet() -> list[Law]:
    """Taking the steps of a quiet control period in one call changes no bit."""
    scene = generate_scene("cluttered", 0)
    stepwise = wander(World(scene, watch=lambda: None))
    law = "states with quiet periods in one call, and step by step"
    return [_same(law, wander(World(scene)) == stepwise, "quiet")]


def jacobian() -> list[Law]:
    """Dense and sparse Jacobians give the same push.

    Of a ball, which the bumper touches in one point. On a flat face any point of the
    line of contact will do, and rounding decides which one MuJoCo takes.
    """
    ball = obstacle("ball", Sphere(radius_m=0.1), (1.3, 3.0), mass_kg=2.0)
    ends = []
    for kind in (mujoco.mjtJacobian.mjJAC_DENSE, mujoco.mjtJacobian.mjJAC_SPARSE):
        world = World(bench(ball))
        world.model.opt.jacobian = kind
        for _ in range(10):
            world.step(np.array([0.3, 0.0]))
        ends.append(np.array(world.data.qpos))
    law = "ball after a push of 1 s, dense against sparse Jacobian"
    return [Law(check="jacobian", law=law, expected=0.0, tolerance=1e-3, unit="mm",
                measured=1e3 * float(np.abs(ends[0] - ends[1]).max()))]  # fmt: skip


def log_file() -> list[Law]:
    """A diverging world is an error, and leaves no MUJOCO_LOG.TXT behind."""
    message, files = _elsewhere("provoke")
    law = "files left in the user's folder by a diverging world"
    return [
        _same("a diverging world is reported as an error", bool(message), "log"),
        Law(check="log", law=law, expected=0.0, measured=float(files), tolerance=0.0),
    ]


def _same(law: str, same: bool, check: str = "repeat") -> Law:
    return Law(check=check, law=law, expected=1.0, measured=float(same), tolerance=0.0)


def _elsewhere(function: str) -> tuple[str, int]:
    """Call a function of this module in a new process and an empty folder.

    Returns its answer and how many files it left.
    """
    code = f"from beacon_mj.fidelity import repeat; print(repeat.{function}())"
    path = os.pathsep.join(os.path.abspath(p) for p in sys.path)
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | {"PYTHONPATH": path},
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        return done.stdout.strip(), len(list(Path(folder).iterdir()))
