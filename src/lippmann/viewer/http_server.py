"""HTTP server for one user's own pages: request checks, security headers, error responses.

A :class:`Site` supplies the content. The server refuses requests whose Host header names another machine, which stops
DNS rebinding: a foreign page whose name resolves to this address. No other site's page can embed or read a response.
"""

from __future__ import annotations

import errno
import io
import ipaddress
import json
import socket
import socketserver
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from email.message import Message
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from typing import Any, Protocol
from urllib.parse import urlsplit

from lippmann.errors import LippmannError, UsageError
from lippmann.printable import one_line
from lippmann.viewer.timed_reader import TimedReader

LOOPBACK = "127.0.0.1"

#: Limit on the body of a request in bytes; pages send a few numbers.
_MAX_BODY = 1 << 16
#: Limit on the digits of a Content-Length, so that absurd numbers are never parsed.
_MAX_LENGTH_DIGITS = 9

#: Seconds after which an idle connection is closed, and one whose request is not whole.
_IDLE_TIMEOUT, _REQUEST_TIMEOUT = 60.0, 20.0
#: Connections at a time; a browser opens six, and each has a thread.
_MOST_CONNECTIONS = 256

_MEDIA_TYPES = {"html": "text/html", "css": "text/css", "js": "text/javascript", "svg": "image/svg+xml"}


def content_security_policy(*inline_scripts: str) -> str:
    """Content-Security-Policy that allows files of this server only, no inline script and no framing.

    ``inline_scripts`` are the exceptions: sources ``'sha256-...'`` of inline scripts, quoted.
    """
    scripts = " ".join(["'self'", *inline_scripts])
    return (
        f"default-src 'none'; script-src {scripts}; style-src 'self'; "
        "img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


_HEADERS = {
    "Content-Security-Policy": content_security_policy(),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    # Files change between two requests.
    "Cache-Control": "no-store",
}


@dataclass(frozen=True)
class Request:
    """HTTP request: the ``path`` as sent, without decoding, and the headers."""

    path: str
    headers: Message


@dataclass(frozen=True)
class Response:
    """HTTP response: body, media type (``kind``), status and additional headers."""

    body: bytes
    kind: str
    status: HTTPStatus = HTTPStatus.OK
    headers: Mapping[str, str] = field(default_factory=dict)


class RefusedError(Exception):
    """A refused request: HTTP status, and one line that tells the user why."""

    def __init__(self, status: HTTPStatus, line: str) -> None:
        self.status = status
        super().__init__(line)


class Site(Protocol):
    """Content of a server. Both methods may be called from several threads and may raise :class:`RefusedError`."""

    def get(self, request: Request) -> Response:
        """Response to GET and HEAD."""

    def post(self, request: Request, body: bytes) -> Response:
        """Response to POST."""


class WebServer:
    """HTTP server that runs in a thread of its own from construction until :meth:`close`.

    Parameters
    ----------
    site:
        Content to serve.
    host:
        Address to listen on: a name of this machine, or an IP address.
    port:
        Port to listen on, 0 to 65535; 0 takes a free one.

    Raises
    ------
    UsageError
        If the port is taken or not allowed, or the address is not this machine's.
    """

    def __init__(self, site: Site, host: str = LOOPBACK, port: int = 0) -> None:
        if not 0 <= port <= 65535:
            raise UsageError(f"{port} is no port", parameter="port", rule="it must lie between 1 and 65535, or be 0")
        try:
            self._server = _Server(site, host, port)
        except (OSError, UnicodeError) as error:  # UnicodeError: a name that no machine can have
            raise _cannot_listen(error, host, port) from None
        self.host, self.port = host, int(self._server.server_address[1])
        # Daemon: an open request does not keep the program alive.
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """URL of the page for a browser on this machine."""
        host = {"0.0.0.0": LOOPBACK, "::": "::1"}.get(self.host, self.host)
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/"

    def close(self) -> None:
        """Stop listening and end all open connections."""
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()
        self._server.end_connections()

    def __enter__(self) -> WebServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def text_response(text: str, kind: str) -> Response:
    """UTF-8 text of the media type ``kind``."""
    return Response(text.encode("utf-8"), f"{kind}; charset=utf-8")


def file_response(name: str, text: str) -> Response:
    """A text file; the extension of ``name`` (html, css, js, svg) determines the media type."""
    return text_response(text, _MEDIA_TYPES[name.rpartition(".")[2]])


def json_response(values: object, headers: Mapping[str, str] | None = None) -> Response:
    """``values``, of types that JSON has, as JSON."""
    body = json.dumps(values, ensure_ascii=False, allow_nan=False).encode("utf-8")
    return Response(body, "application/json", headers=headers or {})


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach a server on this address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


class _Server(socketserver.ThreadingMixIn, socketserver.TCPServer):
    daemon_threads = True
    block_on_close = False
    # A port whose last connections are in TIME_WAIT is free.
    allow_reuse_address = sys.platform != "win32"
    request_queue_size = 64

    def __init__(self, site: Site, host: str, port: int) -> None:
        self.site = site
        self.host = host
        self._open: set[socket.socket] = set()
        family, *_, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        self.address_family = family
        super().__init__((str(place[0]), port), _Handler)

    def process_request(self, request: Any, client_address: Any) -> None:
        if len(self._open) >= _MOST_CONNECTIONS:
            self.shutdown_request(request)
            return
        self._open.add(request)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        self._open.discard(request)
        super().shutdown_request(request)

    def end_connections(self) -> None:
        """End all connections, which browsers keep open for further requests."""
        for connection in tuple(self._open):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def handle_error(self, request: Any, client_address: Any) -> None:
        error = sys.exc_info()[1]
        # A page that is closed or reloaded aborts its requests.
        if not isinstance(error, (ConnectionError, TimeoutError)):
            what = " ".join(f"{type(error).__name__}: {error}".split())
            print(one_line(f"lippmann: internal error while answering a request: {what}; report it"), file=sys.stderr)


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    protocol_version = "HTTP/1.1"
    timeout = _IDLE_TIMEOUT

    def setup(self) -> None:
        super().setup()
        self._timed = TimedReader(self.connection, _IDLE_TIMEOUT, _REQUEST_TIMEOUT)
        self.rfile = io.BufferedReader(self._timed)

    def handle_one_request(self) -> None:
        self._timed.expect_request()
        super().handle_one_request()

    def do_GET(self) -> None:
        self._respond(lambda: self.server.site.get(self._request()))

    def do_HEAD(self) -> None:
        self.do_GET()

    def do_POST(self) -> None:
        self._respond(lambda: self.server.site.post(self._request(), self._body()))

    def _respond(self, respond: Callable[[], Response]) -> None:
        if self.command != "POST" and (self.headers.get("Content-Length") or self.headers.get("Transfer-Encoding")):
            self.close_connection = True  # otherwise its body would be parsed as the next request
        try:
            self._check_host()
            response = respond()
        except RefusedError as refusal:
            response = _line(str(refusal), refusal.status)
        except LippmannError as error:
            response = _line(str(error), HTTPStatus.UNPROCESSABLE_ENTITY)
        except MemoryError:
            response = _line("out of memory; close other programs", HTTPStatus.INSUFFICIENT_STORAGE)
        if self.command == "POST" and response.status >= HTTPStatus.BAD_REQUEST:
            self.close_connection = True  # its body may not have been read
        self._send(response)

    def _send(self, response: Response) -> None:
        self.send_response(response.status)
        for name, value in {**_HEADERS, **response.headers}.items():
            self.send_header(name, value)
        self.send_header("Content-Type", response.kind)
        self.send_header("Content-Length", str(len(response.body)))
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(response.body)

    def _request(self) -> Request:
        return Request(self.path, self.headers)

    def _body(self) -> bytes:
        """Body of a POST request that a page of this server sent as JSON."""
        origin = self.headers.get("Origin")
        if origin is not None and _host_of(origin) != self.headers.get("Host"):
            raise RefusedError(HTTPStatus.FORBIDDEN, "only this server's own pages may send something")
        if self.headers.get_content_type() != "application/json":
            raise RefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "only JSON is taken")
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()):
            raise RefusedError(HTTPStatus.LENGTH_REQUIRED, "the length must be said")
        if len(length) > _MAX_LENGTH_DIGITS or int(length) > _MAX_BODY:
            raise RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "this is too long")
        return self.rfile.read(int(length))

    def _check_host(self) -> None:
        if self.request_version == "HTTP/0.9":  # a response without headers would carry no policy
            raise RefusedError(HTTPStatus.HTTP_VERSION_NOT_SUPPORTED, "HTTP/1.1 is spoken here")
        hosts = self.headers.get_all("Host") or []
        if len(hosts) != 1 or not _is_allowed_host(hosts[0], self.server.host):
            raise RefusedError(HTTPStatus.FORBIDDEN, "this address is not served; use the one that was printed")

    def version_string(self) -> str:
        return "Lippmann"

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Respond to what the base class refuses: malformed requests, and methods that have no handler."""
        self.close_connection = True
        unknown = code == HTTPStatus.NOT_IMPLEMENTED
        status = HTTPStatus.METHOD_NOT_ALLOWED if unknown else HTTPStatus(code)
        self._send(_line(status.phrase, status))

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing."""


def _line(line: str, status: HTTPStatus) -> Response:
    return replace(json_response({"error": line}), status=status)


def _host_of(origin: str) -> str | None:
    """Host and port of an origin; None if it is malformed."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return None


def _is_allowed_host(named: str, listening_on: str) -> bool:
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


def _cannot_listen(error: OSError | UnicodeError, host: str, port: int) -> UsageError:
    number = error.errno if isinstance(error, OSError) else None
    if number == errno.EADDRINUSE:
        return UsageError(f"port {port} is in use", parameter="port", fix="say another, or none to have one chosen")
    if number == errno.EACCES:
        return UsageError(f"port {port} may not be used", parameter="port", fix="say one of at least 1024")
    rule = "it must be an address of this machine, such as 127.0.0.1"
    reason = (error.strerror if isinstance(error, OSError) else "") or "no machine has this name"
    return UsageError(f"cannot listen on '{host}': {reason}", parameter="host", rule=rule)
