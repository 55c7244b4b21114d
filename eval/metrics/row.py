"""One episode's row: the columns of every result, in their order.

`docs/metrics.md` has formula and source of each. A value is null where it is
undefined, such as a Brier score of a planner without a belief.
"""

import hashlib
from collections.abc import Iterable
from typing import Any

import msgspec

from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.episode.trace import Outcome
from beacon_mj.scene import Profile


class Row(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The metrics of one episode; lengths in [m], forces in [N], energies in [J]."""

    planner: str
    oracle: bool = False
    suite: str | None = None
    family: str
    scene_index: int
    mission: int | None = None
    day: int | None = None
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
    energy_rolling_j: float
    motion_energy_j: float
    push_energy_j: float
    actuator_work_j: float
    battery_left: float
    pushes: int
    failed_pushes: int
    obstacles_moved: int
    obstacles_moved_indirectly: int
    obstacles_toppled: int
    obstacles_broken: int
    peak_force_n: float
    filtered_peak_force_n: float
    contact_impulse_ns: float
    displaced_mass_distance_kgm: float
    spl: float
    ins: float
    bench_push_efficiency: float
    bench_push_effort: float
    reference_length_m: float
    excess_length_m: float | None
    brier_prior: float | None
    brier_posterior: float | None
    log_loss_prior: float | None
    log_loss_posterior: float | None
    brier_pushed_prior: float | None
    brier_pushed_posterior: float | None
    time_to_identify_s: float | None
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
        """Return the columns by name, in order."""
        return msgspec.structs.asdict(self)


COLUMNS: tuple[str, ...] = Row.__struct_fields__


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
    stable = {k: columns[k] for k in COLUMNS if k not in WALL_CLOCK_COLUMNS}
    return msgspec.json.encode(stable) + b"\n"
