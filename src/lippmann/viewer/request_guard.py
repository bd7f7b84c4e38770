"""Checks and headers that all pages of a server have in common, as ASGI middleware.

The guard refuses requests whose Host header names another machine, which stops DNS rebinding: a foreign page whose name
resolves to this address. No other site's page can read a response, send a body or open a WebSocket. Pages that embed a
response must be of the origins that the server is given; by default there are none.
"""

from __future__ import annotations

import asyncio
import ipaddress
import socket
from collections.abc import Awaitable, Callable, MutableMapping
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

from lippmann.errors import LippmannError
from lippmann.printable import print_fault
from lippmann.runtime.machine import is_loopback
from lippmann.viewer.responses import NO_FRAMING, RefusedError, Response, content_security_policy, error_response

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

#: Headers of a request at most, and bytes of them with the path; browsers send about twenty.
_MOST_HEADERS, _MOST_HEAD_BYTES = 100, 1 << 15

_METHODS = ("GET", "HEAD", "POST")

_HEADERS = {
    "Content-Security-Policy": content_security_policy(),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    # Files change between two requests.
    "Cache-Control": "no-store",
    "Server": "Lippmann",
}


class RequestGuard:
    """ASGI application that passes on what this server's own pages ask, and turns errors into one line of JSON.

    Parameters
    ----------
    application:
        Answers the requests that pass; may raise :class:`RefusedError` or :class:`LippmannError` before it answers.
    host:
        Address that the server listens on.
    framed_by:
        Sources of ``frame-ancestors``: pages that may embed the answers. By default none may.
    """

    def __init__(self, application: Application, host: str, framed_by: tuple[str, ...] = ()) -> None:
        self._application = application
        self._host = host
        self._framed_by = framed_by

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        sender = _Sender(send, self._framed_by)
        try:
            self._check(scope)
            await self._application(scope, receive, sender)
        except Exception as error:  # noqa: BLE001  a fault in one answer does not end the server
            answer = _answer_to(error)
            if sender.has_begun:
                raise ConnectionAbortedError from None
            if scope["type"] == "http":
                await send_response(sender, answer)
            else:
                await _refuse_socket(sender, answer)

    def _check(self, scope: Scope) -> None:
        if scope["http_version"] not in ("1.0", "1.1"):
            raise RefusedError(HTTPStatus.HTTP_VERSION_NOT_SUPPORTED, "HTTP/1.1 is spoken here")
        head = len(scope["raw_path"]) + len(scope["query_string"]) + sum(len(n) + len(v) for n, v in scope["headers"])
        if len(scope["headers"]) > _MOST_HEADERS or head > _MOST_HEAD_BYTES:
            raise RefusedError(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE, "the address or the headers are too long")
        hosts = header_values(scope, b"host")
        if len(hosts) != 1 or not is_allowed_host(hosts[0], self._host):
            raise RefusedError(HTTPStatus.FORBIDDEN, "this address is not served; use the one that was printed")
        origins = header_values(scope, b"origin")
        is_socket = scope["type"] == "websocket"
        if not is_socket and scope["method"] not in _METHODS:
            raise RefusedError(HTTPStatus.METHOD_NOT_ALLOWED, HTTPStatus.METHOD_NOT_ALLOWED.phrase)
        # Browsers name the origin of every WebSocket and of every POST; other programs may leave it out of the latter.
        if is_socket or scope["method"] == "POST":
            is_own = all(_host_of(origin) == hosts[0] for origin in origins)
            if not is_own or (is_socket and not origins):
                raise RefusedError(HTTPStatus.FORBIDDEN, "only this server's own pages may send something")


class _Sender:
    """``send`` of ASGI with the headers of every response."""

    def __init__(self, send: Send, framed_by: tuple[str, ...]) -> None:
        self._send = send
        self._framed_by = framed_by
        self.has_begun = False

    async def __call__(self, message: MutableMapping[str, Any]) -> None:
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            named = {name.lower() for name, _ in message["headers"]}
            extra = [(n.encode(), v.encode()) for n, v in _HEADERS.items() if n.lower().encode() not in named]
            message = {**message, "headers": _embeddable([*message["headers"], *extra], self._framed_by)}
        self.has_begun = True
        await self._send(message)


def _embeddable(headers: list[tuple[bytes, bytes]], framed_by: tuple[str, ...]) -> list[tuple[bytes, bytes]]:
    """Headers that let pages of these origins embed an answer; X-Frame-Options cannot name any."""
    if not framed_by:
        return headers
    none, some = NO_FRAMING.encode(), f"frame-ancestors {' '.join(framed_by)}".encode("ascii")
    policy = b"content-security-policy"
    kept = [(name, value) for name, value in headers if name.lower() != b"x-frame-options"]
    return [(name, value.replace(none, some) if name.lower() == policy else value) for name, value in kept]


async def send_response(send: Send, response: Response) -> None:
    """Send a whole response over ASGI."""
    await _send_response(send, response, "http.response")


async def _refuse_socket(send: Send, response: Response) -> None:
    await _send_response(send, response, "websocket.http.response")


async def _send_response(send: Send, response: Response, kind: str) -> None:
    headers = {**response.headers, "Content-Type": response.kind, "Content-Length": str(len(response.body))}
    raw = [(name.encode("latin-1"), value.encode("latin-1")) for name, value in headers.items()]
    await send({"type": f"{kind}.start", "status": int(response.status), "headers": raw})
    await send({"type": f"{kind}.body", "body": response.body})


def header_values(scope: Scope, name: bytes) -> list[str]:
    """Values of the headers ``name``, which is in lower case."""
    return [value.decode("latin-1") for key, value in scope["headers"] if key == name]


def is_allowed_host(named: str, listening_on: str) -> bool:
    """Whether the Host header ``named`` means this server; its port may be that of a tunnel.

    DNS rebinding can make a foreign name resolve to this address, but not an IP address.
    """
    try:
        name = urlsplit(f"//{named}").hostname or ""
    except ValueError:
        return False
    if name == "localhost" or name == listening_on.lower():
        return True
    try:
        address = ipaddress.ip_address(name)
    except ValueError:
        return not is_loopback(listening_on) and name in (socket.gethostname().lower(), socket.getfqdn().lower())
    return address.is_loopback or not is_loopback(listening_on)


def _host_of(origin: str) -> str | None:
    """Host and port of an origin; None if it is malformed."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return None


def _answer_to(error: Exception) -> Response:
    """The one line that tells of an error; a fault of the program is also printed."""
    if isinstance(error, RefusedError):
        return error_response(str(error), error.status)
    if isinstance(error, LippmannError):
        return error_response(str(error), HTTPStatus.UNPROCESSABLE_ENTITY)
    if isinstance(error, MemoryError):
        return error_response("out of memory; close other programs", HTTPStatus.INSUFFICIENT_STORAGE)
    # A page that is closed or reloaded aborts its requests.
    if not isinstance(error, (ConnectionError, TimeoutError, asyncio.TimeoutError)):
        print_fault(error, "answering a request")
    return error_response("internal error; the terminal says which", HTTPStatus.INTERNAL_SERVER_ERROR)
