"""One episode's row: the columns of every result, in their order.

Each has its definition and source above it, from which docs/reference/columns.md is
written; docs/metrics.md has the symbols. A value is null where it is
undefined, such as a Brier score of a planner without a belief.
"""

import hashlib
from collections.abc import Iterable
from typing import Any, Literal

import msgspec
from msgspec import UNSET, UnsetType

from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.episode.trace import Outcome
from beacon_mj.scene import Profile


class Row(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The metrics of one episode; lengths in [m], forces in [N], energies in [J]."""

    #: Name of the planner; with the settings of a variant in brackets.
    planner: str
    #: Whether the planner was told the truth about its world: a reference planner,
    #: whatever its name. No planner gets the truth without this mark, and tables mark
    #: its name with a star.
    oracle: bool = False
    #: Released suite whose scene it is; null where that is not shown.
    suite: str | None = None
    #: Family of the scene.
    family: str
    #: Index of the scene within the family; rows are sorted by planner, family and
    #: this.
    scene_index: int
    #: Which mission the scene is a day of; null outside missions.
    mission: int | None = None
    #: Which day of the mission, from 0; null outside missions.
    day: int | None = None
    #: Identity of the scene.
    scene_sha256: str
    #: Perception profile stored in the scene.
    perception: Profile
    #: Seed stored in the scene.
    seed: int
    #: Robot, where it is not the disc; rows of the disc have no such column.
    robot: str | UnsetType = UNSET
    #: World, where it is not MuJoCo's; rows of MuJoCo have no such column.
    world: Literal["planar"] | UnsetType = UNSET
    #: How the episode ended.
    outcome: Outcome
    #: S: the robot's centre came within the goal tolerance (paper, App. B).
    success: bool
    #: S, and `obstacles_broken` is 0 (ours).
    clean_success: bool
    #: Executed control steps (paper, App. B).
    steps: int
    #: L = sum over t of |x(t+1) - x(t)| (paper, App. B).
    path_length_m: float
    #: Contact events: filtered peak force above 1 N between robot and obstacle after
    #: 0.5 s without one on that obstacle (paper, App. B).
    contacts: int
    #: Distinct obstacles sensed (paper, App. B).
    sensed_obstacles: int
    #: `motion_energy_j` + `push_energy_j` (paper, App. B).
    energy_j: float
    #: The same with kappa_d = 2 J/m, bare rolling resistance: who wins on energy can
    #: depend on kappa_d (ours).
    energy_rolling_j: float
    #: kappa_d L, with kappa_d = 0.2 m_0 g (19.6 J/m), a cost of transport of 0.2
    #: (paper, App. B).
    motion_energy_j: float
    #: Sum of mu_i m_i g d_i over displaced obstacles, true material (paper, II.D and
    #: App. B).
    push_energy_j: float
    #: Integral of F v dt of the drives, over every physics step: measured, not modelled
    #: (ours).
    actuator_work_j: float
    #: Charge at the end, 0 to 1; falls by distance over the workspace's diagonal
    #: (paper, II.A).
    battery_left: float
    #: Push attempts that left evidence: moved, not moved, or broken (ours).
    pushes: int
    #: Those whose obstacle did not move (ours).
    failed_pushes: int
    #: Obstacles that travelled more than 10 mm in all because of the robot (ours).
    obstacles_moved: int
    #: Obstacles that travelled more than 10 mm while pushed through others (ours).
    obstacles_moved_indirectly: int
    #: Obstacles that fell over (ours).
    obstacles_toppled: int
    #: Obstacles whose filtered contact force exceeded their break force (ours).
    obstacles_broken: int
    #: Largest robot contact force at any physics step, 500 Hz (ours).
    peak_force_n: float
    #: Largest mean of it over 10 ms (ours).
    filtered_peak_force_n: float
    #: I = sum of the integrals of |F| dt over robot contacts; opposed contacts do not
    #: cancel (ours).
    contact_impulse_ns: float
    #: Sum of m_i d_i over obstacles (ours).
    displaced_mass_distance_kgm: float
    #: S l / max(L, l) (Anderson et al. 2018, arXiv:1807.06757).
    spl: float
    #: SPL / 2 + (K + D) / 4, with K = m_0 L / (m_0 L + sum of m_i d_i) and D = m_0 g T
    #: / (m_0 g T + I) (Xia et al., RA-L 2020; K and D as in the iGibson Challenge
    #: 2021).
    ins: float
    #: S l / L (Bench-Push, Zhong et al. 2026).
    bench_push_efficiency: float
    #: m_0 L / (m_0 L + sum of m_i d_i); rises when the robot drives further (Bench-
    #: Push, Zhong et al. 2026).
    bench_push_effort: float
    #: l: shortest path when every obstacle that can be pushed without damage is removed
    #: (the scene's certificate).
    reference_length_m: float
    #: L - l on success, else null; negative by at most the goal tolerance (ours).
    excess_length_m: float | None
    #: Mean of sum over c of (p(c) - [c = c*])^2, 0 to 2, at the first report (Brier
    #: 1950).
    brier_prior: float | None
    #: The same at the last report.
    brier_posterior: float | None
    #: Mean of -ln max(p(c*), 1e-6) at the first report (Good 1952).
    log_loss_prior: float | None
    #: The same at the last report.
    log_loss_posterior: float | None
    #: `brier_prior` over obstacles that a push attempt left evidence about (ours).
    brier_pushed_prior: float | None
    #: The same at the last report.
    brier_pushed_posterior: float | None
    #: Mean time from the first report until p(c*) is 0.9 or more for good, over
    #: obstacles for which that happens (ours).
    time_to_identify_s: float | None
    #: Paths planned anew.
    replans: int
    #: Vertices expanded by the search.
    expansions: int
    #: Median of the wall-clock time of a decision.
    plan_ms_p50: float | None
    #: Its 99th percentile.
    plan_ms_p99: float | None
    #: Simulated duration T.
    sim_time_s: float
    #: Wall-clock time of the episode.
    wall_time_s: float
    #: One line about how it ended: a planner's reason, or an error's text.
    detail: str

    @property
    def key(self) -> tuple[str, str, int]:
        """Planner, family and index: the canonical order of rows."""
        return self.planner, self.family, self.scene_index

    @property
    def unit(self) -> str:
        """What is independent of other rows: the scene, or the mission of the day."""
        if self.mission is None:
            return self.scene_sha256
        return f"{self.family} {self.seed} {self.perception} {self.mission}"

    @property
    def scene_name(self) -> str:
        """The scene's name, such as `cluttered_0007`; also the stem of its log."""
        return f"{self.family}_{self.scene_index:04d}"

    def as_dict(self) -> dict[str, Any]:
        """Return the columns by name, in order, without those that are unset."""
        found = msgspec.structs.asdict(self)
        return {name: value for name, value in found.items() if value is not UNSET}


#: Columns of every row.
COLUMNS: tuple[str, ...] = tuple(
    field.name for field in msgspec.structs.fields(Row) if field.default is not UNSET
)
#: Columns of rows that are not of the disc in MuJoCo.
OPTIONAL = frozenset(Row.__struct_fields__) - frozenset(COLUMNS)


def rows_sha256(rows: Iterable[Row]) -> str:
    """Return the SHA-256 of a table's rows: equal on every machine.

    It is over one line of JSON a row, in canonical order: its columns in their order
    but for the wall-clock ones, floats with all their digits.

    Args:
        rows: Rows of a run, in any order.
    """
    digest = hashlib.sha256()
    for row in sorted(rows, key=lambda row: row.key):
        digest.update(_line(row))
    return digest.hexdigest()


def row_sha256(row: Row) -> str:
    """Return the SHA-256 of the line that stands for a row in `rows_sha256`."""
    return hashlib.sha256(_line(row)).hexdigest()


def _line(row: Row) -> bytes:
    columns = row.as_dict()
    stable = {k: v for k, v in columns.items() if k not in WALL_CLOCK_COLUMNS}
    return msgspec.json.encode(stable) + b"\n"
