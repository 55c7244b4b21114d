"""One process at a time writes to a run folder, and knows if the folder is moved.

The lock is the system's own (`flock`) on the open file of the rows. It ends with the
process, however that ends, so that a killed run leaves none behind. Systems without
`flock` (Windows) have no lock.
"""

import os
import sys
import weakref
from pathlib import Path

from beacon_mj.errors import RunError

if sys.platform != "win32":
    import fcntl

_held: "weakref.WeakSet[LockedFile]" = weakref.WeakSet()


class LockedFile:
    """A file that is open for appending, and locked until it is closed."""

    def __init__(self, path: Path) -> None:
        """Open and lock a file, which is made if it is not there.

        Raises:
            RunError: If another process has locked it.
            OSError: If it cannot be opened.
        """
        self.path = path
        flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | getattr(os, "O_CLOEXEC", 0)
        number = os.open(path, flags, 0o666)
        self._close = weakref.finalize(self, os.close, number)
        self._number = number
        try:
            self._lock()
        except BaseException:
            self.close()
            raise
        _held.add(self)

    def append(self, data: bytes) -> None:
        """Add to the file; it is on disk when this returns, wherever the file is now.

        Raises:
            RunError: If it cannot be written, or is no longer where it was.
        """
        before = os.lseek(self._number, 0, os.SEEK_END)
        view = memoryview(data)
        try:
            while view:
                view = view[os.write(self._number, view) :]
            os.fsync(self._number)
        except OSError as error:
            os.ftruncate(self._number, before)  # A full disk takes a part of a line.
            why = error.strerror or str(error)
            raise RunError(f"{self.path}: cannot be written: {why}.") from error
        self.check_in_place()

    def replace(self, path: Path) -> None:
        """Move the file to the place of another one of the same folder."""
        self.path.replace(path)
        self.path = path

    def check_in_place(self) -> None:
        """Raise RunError if the file is no longer where it was."""
        if not self.in_place():
            raise RunError(
                f"{self.path.parent}: expected the run folder to stay where it is but "
                "it was moved or deleted. What was finished is in it, wherever it is: "
                "go on with --resume there."
            )

    def in_place(self) -> bool:
        """Whether the file is where it was when it was opened."""
        mine = os.fstat(self._number)
        try:
            there = os.stat(self.path)
        except OSError:
            return False
        return (mine.st_dev, mine.st_ino) == (there.st_dev, there.st_ino)

    def close(self) -> None:
        """Unlock and close the file."""
        _held.discard(self)
        self._close()

    def _lock(self) -> None:
        if sys.platform == "win32":
            return
        try:
            fcntl.flock(self._number, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise RunError(
                f"{self.path.parent}: expected a run folder that nobody else writes to "
                "but another evaluation is running in it."
            ) from error
        except OSError:
            return  # A file system without locks, such as some network mounts.
        if not self.in_place():  # Deleted or replaced between opening and locking.
            raise RunError(
                f"{self.path.parent}: expected the run folder to stay where it is but "
                "it was deleted just now."
            )


def _let_go() -> None:
    """Close the files in a forked child, which would keep the locks of its parent."""
    for each in [*_held]:
        each.close()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go)
