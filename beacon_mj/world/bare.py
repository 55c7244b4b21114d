"""The engine alone, stepped as a world steps it: the least that an episode can cost."""

from collections.abc import Sequence

import mujoco

from beacon_mj.geometry import Array
from beacon_mj.scene import Scene
from beacon_mj.world.outcome import Damage, StepOutcome
from beacon_mj.world.world import World

#: Of one control step: how many physics steps were taken in each call that does not
#: look for contacts; 0 for a single step that does.
Schedule = Sequence[int]


class ScheduledWorld(World):
    """A world that notes how it steps the engine.

    Attributes:
        schedules: One a control step since the world was built.
    """

    def __init__(self, scene: Scene) -> None:
        """Build the world; see `World`."""
        super().__init__(scene)
        self.schedules: list[list[int]] = []

    def step(
        self, velocity_mps: Array, turn_rate_radps: float | None = None
    ) -> StepOutcome:
        """Apply a command for one control period; see `World.step`."""
        self.schedules.append([])
        return super().step(velocity_mps, turn_rate_radps)

    def _step_alone(self, steps: int) -> None:
        self.schedules[-1].append(steps)
        super()._step_alone(steps)

    def _read_contacts(self, command: Array, damages: list[Damage]) -> None:
        self.schedules[-1].append(0)
        super()._read_contacts(command, damages)


class BareWorld(World):
    """A world that applies commands and steps the engine, and looks at nothing."""

    def run(
        self, commands: Sequence[Array], schedules: Sequence[Schedule] | None
    ) -> Array:
        """Apply commands from the start.

        Args:
            commands: Velocities, shape (2,) each [m/s].
            schedules: How a world stepped the engine for each of them; None to look for
                contacts in every physics step.

        Returns:
            The last state, shape (nq,): the bits are those of the world's.
        """
        self.reset()
        plain = [[0] * self._substeps] * len(commands)
        for command, schedule in zip(commands, schedules or plain, strict=True):
            self._drive.command(self._drive.limited(command))
            for steps in schedule:
                if steps:
                    self._step_alone(steps)
                else:
                    mujoco.mj_step(self.model, self.data)
        return self.data.qpos.copy()
