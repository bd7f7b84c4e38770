"""What a client sends, read with two limits of time: to begin a request, and to finish it."""

from __future__ import annotations

import io
import socket
import time
from typing import Any


class TimedReader(io.RawIOBase):
    """Bytes of a connection. A client that sends one now and then does not hold a thread for ever.

    Parameters
    ----------
    connection:
        The socket; its timeout is set as it is read.
    idle:
        Seconds until a request begins.
    whole:
        Seconds from then on until all of it is there.
    """

    def __init__(self, connection: socket.socket, idle: float, whole: float) -> None:
        self._connection = connection
        self._raw: Any = connection.makefile("rb", 0)
        self._idle, self._whole = idle, whole
        self._end: float | None = None

    def expect_request(self) -> None:
        """The last request was answered: the next may take its time to begin."""
        self._end = None

    def close(self) -> None:
        """Close the file; the socket stays open."""
        self._raw.close()
        super().close()

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        """Read what is there, waiting for at least a byte; 0 at the end. A :class:`TimeoutError` ends the wait."""
        left = self._idle if self._end is None else self._end - time.monotonic()
        if left <= 0.0:
            raise TimeoutError("the request took too long")
        self._connection.settimeout(left)
        try:
            read: int = self._raw.readinto(buffer) or 0
        finally:
            self._connection.settimeout(self._idle)  # for the answer
        if self._end is None:
            self._end = time.monotonic() + self._whole
        return read
