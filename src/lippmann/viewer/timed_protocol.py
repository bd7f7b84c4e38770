"""HTTP/1.1 connections with limits of time and number: a slow client holds nothing for ever."""

from __future__ import annotations

import asyncio
from http import HTTPStatus
from typing import Any, cast

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from lippmann.viewer.responses import error_response

#: Seconds after which an idle connection is closed, and one whose request is not whole.
IDLE_TIMEOUT, REQUEST_TIMEOUT = 60, 20.0
#: Bytes of a body within :data:`REQUEST_TIMEOUT` that earn a large one as much time again.
_STEADY_BYTES = 1 << 20
#: Connections at a time; a browser opens six.
_MOST_CONNECTIONS = 256


class TimedProtocol(H11Protocol):
    """uvicorn's HTTP/1.1 with limits on the time of a request and on the number of connections."""

    _timer: asyncio.TimerHandle | None = None
    _is_in_request = False
    _bytes = 0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        if len(self.connections) > _MOST_CONNECTIONS:
            transport.abort()
        else:
            self._wait(IDLE_TIMEOUT)

    def connection_lost(self, exc: Exception | None) -> None:
        self._stop_waiting()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        if not self._is_in_request:
            self._is_in_request, self._bytes = True, 0
            self._wait(REQUEST_TIMEOUT)
        self._bytes += len(data)
        super().data_received(data)
        # Ours is idle again once a request has been answered; bytes may have come of the one after it.
        is_partial = self.conn.their_state is h11.SEND_BODY
        is_partial |= self.conn.their_state is h11.IDLE and bool(self.conn.trailing_data[0])
        if not is_partial or self.transport.get_protocol() is not self:
            self._is_in_request = False
            self._stop_waiting()

    def eof_received(self) -> bool:  # type: ignore[override]
        """Answer what was asked for, in whole, before the client ended its side; True keeps ours open for that."""
        is_owed = self.cycle is not None and not self.cycle.response_complete
        is_owed = is_owed and self.conn.their_state is not h11.SEND_BODY
        if is_owed:
            self.cycle.keep_alive = False
        return is_owed

    def send_400_response(self, msg: str) -> None:
        """Refuse what is no request in the form of every other refusal."""
        if self.conn.our_state not in (h11.IDLE, h11.SEND_RESPONSE):
            self.transport.close()
            return
        response = error_response("Bad Request", HTTPStatus.BAD_REQUEST)
        headers = [
            (b"content-type", response.kind.encode()),
            (b"content-length", str(len(response.body)).encode()),
            (b"content-security-policy", b"default-src 'none'"),
            (b"server", b"Lippmann"),
            (b"connection", b"close"),
        ]
        parts: list[Any] = [
            h11.Response(status_code=400, headers=headers, reason=b"Bad Request"),
            h11.Data(data=response.body),
            h11.EndOfMessage(),
        ]
        for part in parts:
            self.transport.write(cast(bytes, self.conn.send(part)))
        self.transport.close()

    def _wait(self, seconds: float) -> None:
        self._stop_waiting()
        self._timer = self.loop.call_later(seconds, self._end)

    def _stop_waiting(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _end(self) -> None:
        if self._is_in_request and self._bytes >= _STEADY_BYTES:
            self._bytes = 0
            self._wait(REQUEST_TIMEOUT)
        else:
            self.transport.abort()
