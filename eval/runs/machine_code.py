"""Which machine code a planner's episodes use, kept on disk, to load it without them.

numba keeps the machine code, but does not know what an episode will ask for. So a list
of kernels, with the types that they were compiled for, is kept beside the scenes. Its
name holds the planners' source and all versions: whatever changes makes a new one.
"""

import hashlib
from pathlib import Path

import msgspec

from beacon_mj.eval.runs.scene_cache import cache_folder, write_entry
from beacon_mj.eval.runs.versions import versions
from beacon_mj.jit import KERNELS, types_in_use, types_on_disk

#: Kernels by `module:name`, and the types of each as numba prints them.
Used = dict[str, list[str]]


def kept(name: str) -> Used | None:
    """Return the list of a name, if numba has all that it names on disk; else None."""
    path = _path(name)
    if path is None:
        return None
    try:
        found = msgspec.json.decode(path.read_bytes(), type=Used)
        whole = all({*types} <= _on_disk(kernel) for kernel, types in found.items())
    except (OSError, ImportError, msgspec.MsgspecError):
        return None
    return found if whole else None


def load(used: Used) -> None:
    """Load the machine code that a list names."""
    for kernel, wanted in used.items():
        for types in types_on_disk(kernel):
            if str(types) in wanted:
                KERNELS[kernel].compile(types)


def keep(name: str) -> None:
    """Keep under a name the list of what this process has compiled or loaded."""
    path = _path(name)
    used = {kernel: [*map(str, types)] for kernel, types in types_in_use().items()}
    if path is not None and used:
        write_entry(path, msgspec.json.encode(used))


def _on_disk(kernel: str) -> set[str]:
    return {str(types) for types in types_on_disk(kernel)}


def _path(name: str) -> Path | None:
    folder = cache_folder()
    if folder is None:
        return None
    what = (name, sorted(versions().items()))
    return folder / "kernels" / hashlib.sha256(repr(what).encode()).hexdigest()
