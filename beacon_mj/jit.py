"""Compilation of inner loops, with types that checkers understand."""

import contextlib
import functools
import importlib
import os
import stat
import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

_njit: Any = numba.njit  # Its annotations take no options that are not literal.

F = TypeVar("F", bound=Callable[..., object])

#: Kernels of the modules that were imported, by `module:name`; none without JIT.
KERNELS: dict[str, Any] = {}


def kernel(function: F) -> F:
    """Compile `function` with numba on first call and cache the machine code.

    Floating-point contraction and reordering stay off, so that results are the
    same on every CPU and with `NUMBA_DISABLE_JIT=1`. A kernel calls no function of
    `math` but exact ones such as `sqrt`: Intel's SVML, where it is installed, rounds
    the others in its own way.
    """
    compiled = _compiled(function, {"nogil": True})
    if hasattr(compiled, "overloads"):
        KERNELS[f"{function.__module__}:{function.__name__}"] = compiled
    return compiled


def inlined(function: F) -> F:
    """Compile `function` into each kernel that calls it.

    For small functions inside of inner loops. It cannot be left to the compiler:
    numba passes an array as seven arguments, which makes a call look expensive to
    inline while it is more expensive not to.
    """
    return _compiled(function, {"nogil": True, "forceinline": True})


def _compiled(function: F, options: dict[str, bool]) -> F:
    """Return a kernel whose machine code is cached where that is possible.

    numba caches beside the source, else in the user's cache folder. In a read-only
    installation without a home it finds neither, and refuses; there, machine code goes
    to a private folder of temporary files, or is compiled anew by each process.
    """
    try:
        return cast(F, _adapted(_njit(cache=True, **options)(function)))
    except RuntimeError as error:
        if "no locator" not in str(error):
            raise
    if (folder := _private_folder()) is None:
        return cast(F, _njit(**options)(function))
    settings: Any = numba.config  # Its values are set when it is imported.
    settings.CACHE_DIR = folder
    return cast(F, _adapted(_njit(cache=True, **options)(function)))


def _adapted(compiled: Any) -> Any:
    """Let a cache that cannot be written to, on a full disk, be no error.

    And have numba begin without SciPy before machine code is loaded the first time.
    """
    cache: Any = getattr(compiled, "_cache", None)  # Without JIT there is none.
    save: Any = getattr(cache, "save_overload", None)
    load: Any = getattr(cache, "load_overload", None)
    if save is not None and load is not None:

        def tried(*arguments: object) -> None:
            with contextlib.suppress(OSError):
                save(*arguments)

        def loaded(*arguments: object) -> object:
            _begin_without_scipy()
            return load(*arguments)

        cache.save_overload, cache.load_overload = tried, loaded
    return compiled


@functools.cache
def _begin_without_scipy() -> None:
    """Let numba find SciPy, whose BLAS kernels may not call, without importing it.

    numba asks for BLAS while it registers what can be compiled, which costs a fifth of
    a second. What needs BLAS, such as a kernel of somebody's planner, asks again.
    """
    linalg: Any = importlib.import_module("numba.np.linalg")
    ask: Any = getattr(linalg, "ensure_blas", None)
    if ask is None or find_spec("scipy") is None:
        return
    linalg.ensure_blas = lambda: None
    try:
        importlib.import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = ask


def types_in_use() -> dict[str, list[Any]]:
    """Return the types that kernels were compiled or loaded for, by `module:name`."""
    used = {name: [*compiled.overloads] for name, compiled in KERNELS.items()}
    return {name: types for name, types in used.items() if types}


def types_on_disk(name: str) -> list[Any]:
    """Return the types for which numba has a kernel's machine code for this CPU.

    None if numba does not say, as it need not: its index is no public interface.

    Args:
        name: The kernel, as `module:name`; its module is imported.
    """
    importlib.import_module(name.partition(":")[0])
    try:
        compiled = KERNELS[name]
        index = compiled._cache._cache_file._load_index()
        cpu = compiled.targetctx.codegen().magic_tuple()
        return [types for types, magic, _ in index if magic == cpu]
    except (AttributeError, KeyError, ValueError, TypeError, OSError):
        return []


def _private_folder() -> str | None:
    """Return a folder that nobody else can write to; None if there cannot be one.

    What lies there is run, so a folder of the same name that is somebody else's, or a
    link, is not used.
    """
    try:
        user = os.getuid()
        path = Path(tempfile.gettempdir()) / f"beacon-mj-{user}"
        path.mkdir(mode=0o700, exist_ok=True)
        found = path.lstat()
    except (OSError, AttributeError):
        return None
    private = stat.S_ISDIR(found.st_mode) and not found.st_mode & 0o077
    return str(path) if private and found.st_uid == user else None
