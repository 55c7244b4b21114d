"""One episode's row: the columns of every result, in their order.

`docs/metrics.md` has formula and source of each. A value is null where it is
undefined, such as a Brier score of a planner without a belief.
"""

from typing import Any

import msgspec

from beacon_mj.episode.trace import Outcome
from beacon_mj.scene import Profile


class Row(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The metrics of one episode; lengths in [m], forces in [N], energies in [J]."""

    planner: str
    family: str
    index: int
    scene_sha256: str
    perception: Profile
    seed: int
    outcome: Outcome
    success: bool
    clean_success: bool
    steps: int
    path_length_m: float
    contacts: int
    sensed_obstacles: int
    energy_j: float
    energy_kd2_j: float
    motion_energy_j: float
    push_energy_j: float
    actuator_work_j: float
    battery_left: float
    pushes: int
    failed_pushes: int
    obstacles_moved: int
    chain_moved: int
    toppled: int
    broken: int
    peak_force_n: float
    filtered_peak_force_n: float
    contact_impulse_ns: float
    displaced_mass_distance_kgm: float
    spl: float
    ins: float
    bench_push_efficiency: float
    bench_push_effort: float
    reference_length_m: float
    regret_length_m: float | None
    brier_first: float | None
    brier_last: float | None
    log_loss_first: float | None
    log_loss_last: float | None
    brier_pushed_first: float | None
    brier_pushed_last: float | None
    identified_after_s: float | None
    replans: int
    expansions: int
    plan_ms_p50: float | None
    plan_ms_p99: float | None
    sim_time_s: float
    wall_time_s: float
    detail: str

    @property
    def key(self) -> tuple[str, str, int]:
        """Planner, family and index: the canonical order of rows."""
        return self.planner, self.family, self.index

    def as_dict(self) -> dict[str, Any]:
        """Return the columns by name, in order."""
        return msgspec.structs.asdict(self)


COLUMNS: tuple[str, ...] = Row.__struct_fields__
