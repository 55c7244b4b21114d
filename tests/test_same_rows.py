"""Scenes, rows and logs are equal under every BLAS, SIMD, libm, CPU and Python.

Each variant runs the same episodes in a process of its own. The episodes are such as
differed while footprints went through BLAS. `python -m tests.portable` runs them on
another machine.
"""

import functools
import json
import math
import os
import platform
import shutil
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from beacon_mj.recording.machine import machine
from tests.repository import REPOSITORY

EPISODES = (
    "beacon/collision-shortcut/0",
    "semantic/collision-required/1",
    "impact/cluttered/0",
    "beacon-voi/collision-required/0",
    "bug1/collision-shortcut/0",
)
#: Without compiled kernels an episode takes minutes: the beginning of one.
SHORT = ("beacon/collision-required/0/60",)
BLAS_CORES = ("Prescott", "Nehalem", "Sandybridge", "Haswell", "Zen")
#: Takes FMA away from libm, in the spelling of glibc since 2.33 and that before.
NO_FMA = "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-FMA_Usable,-FMA4_Usable,-AVX2_Usable"
#: Interpreters beside those on the PATH, by path: each of them must do.
MORE_PYTHONS = "BEACON_MJ_PYTHONS"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        platform.system() != "Linux" or platform.machine() != "x86_64",
        reason="the variants are those of x86-64 Linux",
    ),
]


def simd(*kinds: str) -> str:
    """Return the instruction sets that NumPy may be told not to use here."""
    found = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
    return " ".join(name for name in found if name.startswith(kinds or ""))


#: Environment by name, and the entry of the machine record that must change with it.
VARIANTS: dict[str, tuple[dict[str, str], str]] = {
    **{
        f"blas-{core}": ({"OPENBLAS_CORETYPE": core}, "blas_core")
        for core in BLAS_CORES
    },
    "numpy-without-simd": ({"NPY_DISABLE_CPU_FEATURES": simd()}, "numpy_simd"),
    "numpy-without-avx512": (
        {"NPY_DISABLE_CPU_FEATURES": simd("X86_V4", "AVX512")},
        "numpy_simd",
    ),
    "libm-without-fma": ({"GLIBC_TUNABLES": NO_FMA}, "libm_sha256"),
    "numba-generic": ({"NUMBA_CPU_NAME": "generic"}, "numba_cpu"),
    "numba-nehalem": ({"NUMBA_CPU_NAME": "nehalem"}, "numba_cpu"),
    "other-hashes": ({"PYTHONHASHSEED": "7"}, ""),
}


@functools.cache
def run(
    episodes: tuple[str, ...], python: str = sys.executable, **variables: str
) -> Any:
    """Return what `tests.portable` finds in a process of its own."""
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)} | variables
    done = subprocess.run(
        [python, "-m", "tests.portable", *episodes],
        cwd=REPOSITORY,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)


def differences(here: Any, there: Any) -> list[str]:
    """Return one line for each scene, log, and column of a row that differs."""
    assert list(here["episodes"]) == list(there["episodes"]) != []
    lines = []
    for name, one in here["episodes"].items():
        other = there["episodes"][name]
        lines += [f"{name}: {k}" for k in ("scene", "log") if one[k] != other[k]]
        lines += [
            f"{name}: {column} is {one['row'][column]} here, {value} there"
            for column, value in other["row"].items()
            if value != one["row"][column]
        ]
    return lines


@pytest.mark.parametrize("name", VARIANTS)
def test_the_cpus_libraries_change_no_bit(name: str) -> None:
    variables, entry = VARIANTS[name]
    if not all(variables.values()):
        pytest.skip("this CPU has nothing to take away")
    if variables.get("OPENBLAS_CORETYPE", "").upper() == machine()["blas_core"].upper():
        pytest.skip("this CPU's own kernels")
    there = run(EPISODES, **variables)
    if entry:
        assert there["machine"][entry] != machine()[entry], "the variant had no effect"
    assert differences(run(EPISODES), there) == []


def test_compiled_kernels_change_no_bit() -> None:
    there = run(SHORT, NUMBA_DISABLE_JIT="1")
    assert there["machine"]["numba_cpu"].startswith("none")
    assert differences(run(SHORT), there) == []


def pythons() -> list[str]:
    """Return the interpreters that are named, and others that have what is needed."""
    named = [p for p in os.environ.get(MORE_PYTHONS, "").split(os.pathsep) if p]
    names = [f"python3.{minor}" for minor in range(11, 16)]
    found = [path for name in names if (path := shutil.which(name))]
    usable = [p for p in found if p != sys.executable and _has_dependencies(p)]
    return [*dict.fromkeys([*named, *usable])]


def _has_dependencies(python: str) -> bool:
    needed = (
        "import fcl, mcap, numba, shapely\n"
        "from beacon_mj.scene_gen.family import load_family\n"
        "load_family('sparse')"
    )
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    tried = subprocess.run(
        [python, "-c", needed], env=environment, capture_output=True, check=False
    )
    return tried.returncode == 0


def test_no_python_changes_a_bit() -> None:
    others = pythons()
    if not others:
        pytest.skip(f"no other Python here has the dependencies; see {MORE_PYTHONS}")
    for path in others:
        assert differences(run(EPISODES), run(EPISODES, path)) == [], path


def test_a_differing_bit_is_found() -> None:
    """The comparison above can fail: in a scene, a log, and the last digit of a row."""
    here = run(EPISODES)
    name = EPISODES[0]
    for change in ("scene", "log", "row"):
        there = json.loads(json.dumps(here))
        episode = there["episodes"][name]
        if change == "row":
            length = episode["row"]["path_length_m"]
            episode["row"]["path_length_m"] = math.nextafter(length, math.inf)
        else:
            episode[change] = "0"
        assert len(differences(here, there)) == 1
