"""Compilation of inner loops, with types that checkers understand."""

from collections.abc import Callable
from typing import TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., object])


def kernel(function: F) -> F:
    """Compile `function` with numba on first call and cache the machine code.

    Floating-point contraction and reordering stay off, so that results are the
    same with `NUMBA_DISABLE_JIT=1`.
    """
    return cast(F, numba.njit(cache=True, nogil=True)(function))
