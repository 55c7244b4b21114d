"""Every script in examples/ runs, in an empty folder."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.repository import REPOSITORY

#: What each script prints or writes.
MADE = {
    "one_episode.py": ("reached after", "episode.svg"),
    "compare_planners.py": ("beacon against dstar-lite", "runs/compared"),
    "own_planner.py": ("Wary", "runs/wary"),
    "own_push_policy.py": ("bold", "runs/sure"),
    "own_family.py": ("of margin", "runs/stools"),
    "cost_of_sensing.py": ("lidar only", "runs/sensing/perfect"),
    "read_log.py": ("at most", "force.png"),
}


#: Clients of an evaluation, which `tests/eval/runs/test_programs.py` runs.
CLIENTS = {"exec_python.py"}
#: What needs packages that few have, which `tests/planners/test_ppo.py` runs.
TRAINING = {"train_ppo.py"}


def test_every_example_is_tested() -> None:
    found = {p.name for p in (REPOSITORY / "examples").glob("*.py")}
    assert set(MADE) | CLIENTS | TRAINING == found


@pytest.mark.slow
@pytest.mark.parametrize("name", MADE)
def test_an_example_runs(name: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, REPOSITORY / "examples" / name],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    printed, written = MADE[name]
    assert printed in done.stdout
    assert (tmp_path / written).exists()
