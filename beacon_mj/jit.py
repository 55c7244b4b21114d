"""Compilation of inner loops, with types that checkers understand."""

from collections.abc import Callable
from typing import TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., object])


def kernel(function: F) -> F:
    """Compile `function` with numba on first call and cache the machine code.

    Floating-point contraction and reordering stay off, so that results are the
    same on every CPU and with `NUMBA_DISABLE_JIT=1`. A kernel calls no function of
    `math` but exact ones such as `sqrt`: Intel's SVML, where it is installed, rounds
    the others in its own way.
    """
    return cast(F, numba.njit(cache=True, nogil=True)(function))


def inlined(function: F) -> F:
    """Compile `function` into each kernel that calls it.

    For small functions inside of inner loops. It cannot be left to the compiler:
    numba passes an array as seven arguments, which makes a call look expensive to
    inline while it is more expensive not to.
    """
    compiled = numba.njit(cache=True, nogil=True, forceinline=True)(function)
    return cast(F, compiled)
