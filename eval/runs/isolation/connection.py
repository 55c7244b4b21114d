"""One end of a pair of sockets, every transfer of which has a time limit."""

import math
import socket
import time

_PART_B = 2**16


class Connection:
    """A connection on which one message is under way at a time."""

    def __init__(self, end: socket.socket) -> None:
        """Use one end of a pair of sockets."""
        self._socket = end
        self._limit_s = math.inf

    def limit(self, limit_s: float) -> None:
        """Have every transfer from now on take at most `limit_s`."""
        if limit_s != self._limit_s:
            self._limit_s = limit_s
            self._socket.settimeout(limit_s)

    def close(self) -> None:
        """Close this end."""
        self._socket.close()

    def _send(self, data: bytes) -> None:
        self._socket.sendall(data)

    def _part(self, began: float) -> bytes:
        """Return what comes next; whoever sends it in drops has no more time."""
        if time.monotonic() - began > self._limit_s:
            raise TimeoutError
        part = self._socket.recv(_PART_B)
        if not part:
            raise EOFError("the other end is closed")
        return part
