"""What machine computed something: where rows may differ, this says why.

Rows are equal on every x86-64 machine with glibc (`docs/same-rows.md`), so nothing
here is an option of a run: two machines may share one run, and logs of one verify on
the other.
"""

import ctypes
import functools
import hashlib
import math
import platform
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

_MAPS = Path("/proc/self/maps")
_CPU_INFO = Path("/proc/cpuinfo")
#: What a build of OpenBLAS calls the function that names its kernels.
_CORE_NAMES = (
    "scipy_openblas_get_corename64_",
    "scipy_openblas_get_corename",
    "openblas_get_corename64_",
    "openblas_get_corename",
)


@functools.cache
def machine() -> dict[str, str]:
    """Return what the bits of a number may depend on beside versions, by name.

    `cpu` is the model, `numpy_simd` what NumPy uses of it, `numba_cpu` what kernels
    are compiled for, `blas_core` the kernels of NumPy's OpenBLAS, `libc` the C
    library, and `libm_sha256` a fingerprint of its functions: two machines with one
    fingerprint compute the same sines.
    """
    return {
        "cpu": _cpu(),
        "numpy_simd": " ".join(_simd()),
        "numba_cpu": _numba_cpu(),
        "blas_core": _blas_core(),
        "libc": " ".join(platform.libc_ver()) or "unknown",
        "libm_sha256": _libm_sha256(),
    }


def _cpu() -> str:
    try:
        lines = _CPU_INFO.read_text(errors="replace").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if "model name" in line)
    return next(names, platform.processor() or platform.machine())


def _simd() -> list[str]:
    """Return the instruction sets that NumPy uses on this CPU."""
    found = np.show_config(mode="dicts")
    simd = found.get("SIMD Extensions", {})
    return [*simd.get("baseline", []), *simd.get("found", [])]


def _numba_cpu() -> str:
    from llvmlite import binding
    from numba.core import config

    settings: Any = config  # Its values are set when it is imported.
    if settings.DISABLE_JIT:
        return "none: not compiled"
    return str(settings.CPU_NAME or binding.get_host_cpu_name())


def _blas_core() -> str:
    """Return the name of the kernels that NumPy's OpenBLAS chose for this CPU."""
    for path in _loaded("openblas"):
        library = ctypes.CDLL(path)
        for name in _CORE_NAMES:
            if (function := getattr(library, name, None)) is not None:
                function.restype = ctypes.c_char_p
                return str(function().decode())
    return "unknown"


def _loaded(part: str) -> Iterator[str]:
    """Yield the shared libraries of this process with `part` in their names."""
    try:
        lines = _MAPS.read_text(errors="replace").splitlines()
    except OSError:
        return
    paths = (line.split(maxsplit=5)[-1] for line in lines if "/" in line)
    yield from dict.fromkeys(p for p in paths if part in Path(p).name)


def _libm_sha256() -> str:
    """Return a hash of what the C library's functions give for 10,000 numbers."""
    digest = hashlib.sha256()
    for k in range(10_000):
        x = 0.0007 * k + 1e-9
        values = (math.sin(x), math.cos(x), math.atan2(x, 2.0), math.acos(x / 8.0))
        digest.update(struct.pack("<6d", *values, math.exp(-x), math.log(x)))
    return digest.hexdigest()[:16]
