"""The work of the drives, as the implicit integrator applies their force."""

from beacon_mj.geometry import Array
from beacon_mj.jit import kernel
from beacon_mj.scene_gen.mjcf import ACROSS_SHARE


@kernel
def drive_work(
    force: Array,
    velocity: Array,
    target: Array,
    qvel: Array,
    axis: Array,
    gain: float,
    force_max_n: float,
    timestep_s: float,
) -> float:
    """Return the work of both drives in the physics step just taken [J].

    A servo's force k (v* - v) changes within the step. Below its limit, MuJoCo's
    implicit integrator applies the force at the end of the step, k (v* - v'); at its
    limit, the limit. The work is that force times the mean velocity.

    Args:
        force: Forces at the start of the step, along and across, shape (2,) [N].
        velocity: Velocities v at the start of the step, shape (2,) [m/s].
        target: Velocities v* that the servos hold, shape (2,) [m/s].
        qvel: Generalised velocities after the step; the first two are the base's.
        axis: Unit vector along which the first drive acts, shape (2,).
        gain: Gain k of the servos [N s/m].
        force_max_n: Limit of the drive along its direction [N].
        timestep_s: Physics step [s].
    """
    work = 0.0
    after_along = qvel[0] * axis[0] + qvel[1] * axis[1]
    after_across = qvel[1] * axis[0] - qvel[0] * axis[1]
    for i in range(2):
        after = after_along if i == 0 else after_across
        limit = force_max_n if i == 0 else ACROSS_SHARE * force_max_n
        applied = force[i]
        if abs(applied) < limit:
            applied = gain * (target[i] - after)
        work += applied * 0.5 * (velocity[i] + after) * timestep_s
    return work
