"""Reading input files: regular ones only, and never more than a stated size.

A pipe would be waited for, and a device such as `/dev/zero` has no end.
"""

import errno
import os
import stat
from pathlib import Path


def read_regular(path: str | Path, limit: int) -> bytes:
    """Return the bytes of a regular file.

    Args:
        path: The file; links are followed.
        limit: Its largest size [bytes].

    Raises:
        OSError: If it cannot be read, is no regular file, or is larger; `strerror`
            says which.
    """
    # Opening a pipe that nobody writes to would wait without this.
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    with open(descriptor, "rb") as file:
        found = os.fstat(descriptor)
        if not stat.S_ISREG(found.st_mode):
            raise OSError(errno.EINVAL, "expected a regular file", str(path))
        # Not `limit`, for which the memory would be taken first.
        data = file.read(found.st_size + 1) if found.st_size <= limit else None
    if data is None or len(data) > limit:
        raise OSError(errno.EFBIG, f"expected at most {limit} bytes", str(path))
    return data
