"""Compilation of inner loops, with types that checkers understand."""

import contextlib
import os
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

_njit: Any = numba.njit  # Its annotations take no options that are not literal.

F = TypeVar("F", bound=Callable[..., object])


def kernel(function: F) -> F:
    """Compile `function` with numba on first call and cache the machine code.

    Floating-point contraction and reordering stay off, so that results are the
    same on every CPU and with `NUMBA_DISABLE_JIT=1`. A kernel calls no function of
    `math` but exact ones such as `sqrt`: Intel's SVML, where it is installed, rounds
    the others in its own way.
    """
    return _compiled(function, {"nogil": True})


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
        return cast(F, _forgiving(_njit(cache=True, **options)(function)))
    except RuntimeError as error:
        if "no locator" not in str(error):
            raise
    if (folder := _private_folder()) is None:
        return cast(F, _njit(**options)(function))
    settings: Any = numba.config  # Its values are set when it is imported.
    settings.CACHE_DIR = folder
    return cast(F, _forgiving(_njit(cache=True, **options)(function)))


def _forgiving(compiled: Any) -> Any:
    """Let a cache that cannot be written to, on a full disk, be no error."""
    cache: Any = getattr(compiled, "_cache", None)  # Without JIT there is none.
    save: Any = getattr(cache, "save_overload", None)
    if save is not None:

        def tried(*arguments: object) -> None:
            with contextlib.suppress(OSError):
                save(*arguments)

        cache.save_overload = tried
    return compiled


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
