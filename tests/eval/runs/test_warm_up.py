"""Warming up leaves nothing to compile for a decision."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.repository import REPOSITORY

#: Compile in a fresh cache, then run episodes whose decisions have a tight limit.
PROGRAM = """
from beacon_mj.eval.runs.warm_up import compile_kernels, load_kernels
compile_kernels()
load_kernels()
from beacon_mj import Protocol, generate_scene, load_planner, run_episode
tight = Protocol(decision_limit_s={limit})
for name in ("beacon", "dstar-lite", "bug2", "semantic"):
    for family in ("collision-required", "collision-shortcut", "cluttered"):
        scene = generate_scene(family, 1, seed=5000)
        trace = run_episode(scene, load_planner(name)[1](), name, tight)
        assert trace.outcome != "planner_error", (name, family, trace.detail)
"""


@pytest.mark.slow
def test_no_decision_waits_for_the_compiler(tmp_path: Path) -> None:
    environment = os.environ | {
        "NUMBA_CACHE_DIR": str(tmp_path),
        "PYTHONPATH": str(REPOSITORY),
    }
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(limit=1.0)],
        env=environment, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert any(tmp_path.rglob("*.nbi")), "the cache folder was not used"


#: Warm up for one planner, then print the kernels that its episodes need beside.
MISSED = """
import sys
from beacon_mj.eval.runs.warm_up import compile_kernels, load_kernels
from beacon_mj import Protocol, load_planner, run_episode
from numba.core.dispatcher import Dispatcher
from tests.worlds import cached_scene
def compiled():
    return {{
        (module, name, signature)
        for module, loaded in list(sys.modules.items())
        if module.startswith("beacon_mj")
        for name, value in vars(loaded).items()
        if isinstance(value, Dispatcher)
        for signature in map(str, value.signatures)
    }}
scenes = [cached_scene(f, 1) for f in {families}]
compile_kernels([{name!r}])
load_kernels([{name!r}])
before = compiled()
assert before
for scene in scenes:
    run_episode(scene, load_planner({name!r})[1](), {name!r}, Protocol(max_steps=600))
sys.exit(str(compiled() - before) if compiled() - before else 0)
"""


@pytest.mark.parametrize("name", ["bug2", "dstar-lite", "semantic", "beacon-voi"])
def test_kernels_of_one_planner_are_enough_for_it(name: str) -> None:
    families = ["collision-required", "cluttered"]
    if name == "beacon-voi":
        families.append("warehouse-12")  # Its grid is not searched whole.
    done = subprocess.run(
        [sys.executable, "-c", MISSED.format(name=name, families=families)],
        cwd=REPOSITORY, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


#: Make the kernels of a planner ready; print tours, and what came from disk and not.
LOADED = """
from beacon_mj.eval.runs import warm_up
tours = []
warm_up._tour = tours.append
warm_up.compile_kernels(["dstar-lite"])
warm_up.load_kernels(["dstar-lite"])
from beacon_mj.jit import KERNELS, types_in_use
hits = [sum(KERNELS[k].stats.cache_hits.values()) for k in types_in_use()]
misses = [sum(KERNELS[k].stats.cache_misses.values()) for k in types_in_use()]
print(tours, len(hits) > 10 and all(hits), sum(misses))
"""


def test_a_second_process_loads_machine_code_and_runs_nothing(tmp_path: Path) -> None:
    environment = os.environ | {"BEACON_MJ_CACHE": str(tmp_path)}

    def call(code: str) -> str:
        return subprocess.run(
            [sys.executable, "-c", code],
            cwd=REPOSITORY, env=environment, capture_output=True, text=True, check=True,
        ).stdout.strip()  # fmt: skip

    compiled = "from beacon_mj.eval.runs.warm_up import compile_kernels"
    assert call(LOADED) == "['dstar-lite'] False 0"
    call(f"{compiled}; compile_kernels(['dstar-lite'])")
    assert call(LOADED) == "[] True 0"


def test_a_list_of_what_is_not_on_disk_counts_for_nothing(tmp_path: Path) -> None:
    code = """
from beacon_mj.eval.runs import machine_code
machine_code.types_in_use = lambda: {"beacon_mj.geometry:_signed_distances": ["(x,)"]}
machine_code.keep("mine")
print(machine_code.kept("mine"), machine_code.kept("other"))
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=REPOSITORY, env=os.environ | {"BEACON_MJ_CACHE": str(tmp_path)},
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.stdout.strip() == "None None", done.stderr
    assert [*(tmp_path / "kernels").iterdir()]
