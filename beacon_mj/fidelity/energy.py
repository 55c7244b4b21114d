"""Energy: what the drives put in is what friction, bumper and contacts take out."""

from dataclasses import dataclass

import mujoco
import numpy as np
from msgspec import UNSET, UnsetType

from beacon_mj.fidelity.law import Law
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.robots import RobotFile
from beacon_mj.world import World


@dataclass(slots=True)
class Ledger:
    """Energies of one run [J].

    Attributes:
        floor: Lost in sliding and rolling on the floor.
        contact: Lost in contacts between robot, obstacles, and walls.
        bumper: Lost in the bumper's dampers, and those of wheels' slides.
    """

    floor: float = 0.0
    contact: float = 0.0
    bumper: float = 0.0

    @property
    def lost(self) -> float:
        """All of it [J]."""
        return self.floor + self.contact + self.bumper


def audit() -> list[Law]:
    """The drives' work in an episode is all losses plus what is stored at its end."""
    worlds = (("cluttered", 0), ("collision-required", 1))
    return [audit_row(family, index) for family, index in worlds]


def audit_row(
    family: str,
    index: int,
    check: str = "energy",
    robot: RobotFile | UnsetType = UNSET,
) -> Law:
    """Return the row of one scene, in which the robot pushes straight to the goal."""
    scene = generate_scene(family, index)
    run = Audit(scene, robot)
    before, work = run.stored(), 0.0
    for _ in range(200):
        ahead = np.array(scene.goal_m) - run.world.position_m
        velocity = 0.4 * ahead / max(0.4, float(np.hypot(*ahead)))
        work += run.world.step(velocity).actuator_work_j
    found = run.ledger.lost + run.stored() - before
    law = (
        f"work of the drives in {scene.name}, pushing straight to the goal: "
        f"floor {run.ledger.floor:.1f} J + bumper {run.ledger.bumper:.1f} J "
        f"+ contacts {run.ledger.contact:.1f} J + kinetic"
    )
    return Law(check=check, law=law, expected=found, measured=work,
               tolerance=1e-3 * abs(found), unit="J")  # fmt: skip


class Audit:
    """Adds up, at every physics step, where a world's energy goes."""

    def __init__(self, scene: Scene, robot: RobotFile | UnsetType = UNSET) -> None:
        """Prepare a world of `scene` that is audited while it runs."""
        self.ledger = Ledger()
        self.world = World(scene, watch=self._watch, robot=robot)
        self._velocity = np.array(self.world.data.qvel)
        self._floor = self.world.model.geom("floor").id
        self._timestep_s = float(self.world.model.opt.timestep)

    def stored(self) -> float:
        """Return kinetic energy, energy in springs, and height above the floor [J]."""
        model, data = self.world.model, self.world.data
        mujoco.mj_energyPos(model, data)
        mujoco.mj_energyVel(model, data)
        return float(data.energy.sum())

    def _watch(self) -> None:
        """Book one physics step, with the mean of its first and last velocity."""
        model, data, dt = self.world.model, self.world.data, self._timestep_s
        mean = 0.5 * (self._velocity + data.qvel)
        floor = self._floor_force()
        lost_floor = -float(floor @ mean) * dt
        self.ledger.floor += lost_floor
        self.ledger.contact -= float(data.qfrc_constraint @ mean) * dt + lost_floor
        # The integrator applies the damper at the end of the step.
        self.ledger.bumper += float(model.dof_damping @ (data.qvel * mean)) * dt
        self._velocity = np.array(data.qvel)

    def _floor_force(self) -> np.ndarray:
        """Return the generalised force of the floor's contacts, shape (nv,)."""
        data = self.world.data
        rows = np.zeros(data.nefc)
        for k in range(data.ncon):
            contact = data.contact[k]
            if self._floor in contact.geom and contact.efc_address >= 0:
                at = slice(contact.efc_address, contact.efc_address + contact.dim)
                rows[at] = data.efc_force[at]
        force = np.zeros(self.world.model.nv)
        if data.nefc:
            mujoco.mj_mulJacTVec(self.world.model, data, force, rows)
        return force
