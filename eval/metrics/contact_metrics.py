"""What an episode did to its obstacles: contacts, forces, displacements."""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from beacon_mj.constants import CONTACT_N, MOVED_M
from beacon_mj.episode.trace import Trace
from beacon_mj.scene import Obstacle
from beacon_mj.world.outcome import ROBOT, PairForce

PAUSE_S = 0.5  #: Time without contact after which a contact is a new event [s].


class Travel(NamedTuple):
    """How far the robot made an obstacle travel [m]: in all, and through others."""

    total_m: float = 0.0
    chained_m: float = 0.0


def robot_contacts(trace: Trace) -> Iterator[tuple[float, PairForce]]:
    """Yield time at the end of the step [s] and force, for all robot contacts."""
    for record in trace.steps:
        for contact in record.outcome.contacts:
            if contact.counterpart == ROBOT:
                yield record.outcome.time_s, contact


def contact_events(trace: Trace) -> int:
    """Return the number of contact events (paper App. B).

    An event is a filtered peak force above 1 N between the robot and an obstacle
    after at least 0.5 s without such a force on that obstacle.
    """
    period = trace.scene.robot.control_period_s
    last: dict[str, float] = {}
    events = 0
    for time_s, contact in robot_contacts(trace):
        if contact.filtered_peak_n <= CONTACT_N:
            continue
        before = last.get(contact.obstacle)
        # The step that ends now began one period ago: that is where the pause ends.
        if before is None or time_s - period - before >= PAUSE_S - 1e-9:
            events += 1
        last[contact.obstacle] = time_s
    return events


def peak_force_n(trace: Trace) -> float:
    """Return the largest robot contact force at any physics step [N]; 0 if none."""
    return max((c.peak_n for _, c in robot_contacts(trace)), default=0.0)


def filtered_peak_force_n(trace: Trace) -> float:
    """Return the largest 10 ms mean of a robot contact force [N]; 0 if none."""
    return max((c.filtered_peak_n for _, c in robot_contacts(trace)), default=0.0)


def contact_impulse_ns(trace: Trace) -> float:
    """Return the integral of robot contact force magnitudes over time [N s]."""
    return math.fsum(c.impulse_ns for _, c in robot_contacts(trace))


def travels(trace: Trace) -> dict[str, Travel]:
    """Return how far each obstacle travelled because of the robot.

    A chain of one is a direct push, a longer one goes through other obstacles; a
    displacement without a chain has no cause in the robot and does not count.
    """
    out: dict[str, Travel] = {}
    for record in trace.steps:
        for moved in record.outcome.displacements:
            if moved.chain:
                so_far = out.get(moved.obstacle, Travel())
                chained = moved.distance_m if len(moved.chain) > 1 else 0.0
                out[moved.obstacle] = Travel(
                    so_far.total_m + moved.distance_m, so_far.chained_m + chained
                )
    return out


def obstacles_moved(travel: Mapping[str, Travel]) -> int:
    """Return how many obstacles travelled more than 10 mm in all."""
    return sum(t.total_m > MOVED_M for t in travel.values())


def moved_indirectly(travel: Mapping[str, Travel]) -> int:
    """Return how many travelled more than 10 mm while pushed through others."""
    return sum(t.chained_m > MOVED_M for t in travel.values())


def push_energy_j(
    obstacles: Mapping[str, Obstacle], travel: Mapping[str, Travel]
) -> float:
    """Return sum_i mu_i m_i g d_i over displaced obstacles [J] (paper II.D, App. B).

    It is the paper's force-energy model with the true material. A body that rolls
    costs less than it says; `actuator_work_j` is the measured work.
    """
    return math.fsum(
        obstacles[i].breakaway_force_n * t.total_m for i, t in travel.items()
    )


def displaced_mass_distance_kgm(
    obstacles: Mapping[str, Obstacle], travel: Mapping[str, Travel]
) -> float:
    """Return sum_i m_i d_i over displaced obstacles [kg m]."""
    return math.fsum(obstacles[i].mass_kg * t.total_m for i, t in travel.items())


def pushes(trace: Trace) -> int:
    """Return the push attempts that left evidence: moved, not moved, or broken.

    An obstacle that another one broke, with no attempt on it, is no push.
    """
    return sum(len(record.outcome.own_attempts) for record in trace.steps)


def failed_pushes(trace: Trace) -> int:
    """Return the push attempts whose obstacle did not move."""
    return sum(
        attempt.evidence == "not_moved"
        for record in trace.steps
        for attempt in record.outcome.attempts
    )


def broken(trace: Trace) -> int:
    """Return the number of obstacles that broke."""
    return len({d.obstacle for r in trace.steps for d in r.outcome.damages})


def toppled(trace: Trace) -> int:
    """Return the number of obstacles that fell over."""
    return len({name for r in trace.steps for name in r.outcome.toppled})
