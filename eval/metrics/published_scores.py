"""Published scores of one episode, as functions of plain numbers.

Symbols, once for all of them:
    S: Whether the goal was reached.
    l: `reference_length_m`, the shortest damage-free path with pushing [m].
    p: Length of the path that was driven [m].
    m_0: Mass of the robot [kg].
    md: sum_i m_i d_i, mass times distance of all displaced obstacles [kg m].
    T: Duration [s].
    I: Integral of the robot's contact forces over time [N s].
"""

from beacon_mj.constants import GRAVITY


def spl(success: bool, reference_m: float, path_m: float) -> float:
    """Return S l / max(p, l), success weighted by path length, in [0, 1].

    Anderson et al., "On Evaluation of Embodied Navigation Agents", 2018.
    """
    return reference_m / max(path_m, reference_m) if success else 0.0


def kinematic_score(robot_kg: float, path_m: float, displaced_kgm: float) -> float:
    """Return K = m_0 p / (m_0 p + md), in (0, 1]; 1 if nothing moved at all.

    `kinematic_disturbance` of the iGibson Challenge 2021 (larger is better, in spite
    of its name).
    """
    own = robot_kg * path_m
    return own / (own + displaced_kgm) if own + displaced_kgm > 0.0 else 1.0


def dynamic_score(robot_kg: float, time_s: float, impulse_ns: float) -> float:
    """Return D = m_0 g T / (m_0 g T + I), in (0, 1]; 1 for an empty episode.

    `dynamic_disturbance` of the iGibson Challenge 2021. Its code samples the force
    once per control step and adds vectors; here I integrates magnitudes over every
    physics step, so that opposed contacts do not cancel.
    """
    own = robot_kg * GRAVITY * time_s
    return own / (own + impulse_ns) if own + impulse_ns > 0.0 else 1.0


def ins(spl_score: float, kinematic: float, dynamic: float) -> float:
    """Return INS = SPL / 2 + (K + D) / 4, in [0, 1].

    Interactive Navigation Score, Xia et al., "Interactive Gibson Benchmark", RA-L
    2020, with alpha = 1/2 and K and D as the iGibson Challenge 2021 defines them.
    """
    return 0.5 * spl_score + 0.25 * (kinematic + dynamic)


def bench_push_efficiency(success: bool, reference_m: float, path_m: float) -> float:
    """Return S l / p; unlike SPL it may exceed 1 by the goal's tolerance.

    Efficiency score of Bench-Push (Zhong et al., 2026).
    """
    return reference_m / path_m if success and path_m > 0.0 else 0.0


def bench_push_effort(robot_kg: float, path_m: float, displaced_kgm: float) -> float:
    """Return m_0 p / (m_0 p + md), in (0, 1]; larger is less effort.

    Effort score of Bench-Push (Zhong et al., 2026). It rises when the robot drives
    further, so it is never shown without a path length.
    """
    return kinematic_score(robot_kg, path_m, displaced_kgm)
