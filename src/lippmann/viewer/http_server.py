"""A small web server for one person's own pages: who may ask, in which form, and what every answer carries.

What is answered is the :class:`Site`'s business. Requests are taken from pages of this server alone: one that names
another host (a foreign page whose name was made to lead here: DNS rebinding) is refused, and nothing that is served
can be embedded in, or read by, another site's page.
"""

from __future__ import annotations

import errno
import ipaddress
import json
import socket
import socketserver
import sys
import threading
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from email.message import Message
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from typing import Any, Protocol
from urllib.parse import urlsplit

from lippmann.errors import LippmannError, UsageError

LOOPBACK = "127.0.0.1"

#: Largest body of a request; what pages send are a few numbers.
_LARGEST_BODY = 1 << 16
_MOST_DIGITS = 9

#: Seconds after which a connection that says nothing is closed.
_PATIENCE = 60.0

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
    # Pages show files as they are now.
    "Cache-Control": "no-store",
}


@dataclass(frozen=True)
class Request:
    """What was asked: the ``path`` as it was sent, nothing decoded, and the headers."""

    path: str
    headers: Message


@dataclass(frozen=True)
class Answer:
    """What is answered; ``kind`` is the media type."""

    body: bytes
    kind: str
    status: HTTPStatus = HTTPStatus.OK
    headers: Mapping[str, str] = field(default_factory=dict)


class RefusedError(Exception):
    """A request that is refused, with a line for people."""

    def __init__(self, status: HTTPStatus, line: str) -> None:
        self.status = status
        super().__init__(line)


class Site(Protocol):
    """What is served. Both may be called by several threads at once, and may raise :class:`RefusedError`."""

    def get(self, request: Request) -> Answer:
        """The answer to GET and HEAD."""

    def post(self, request: Request, body: bytes) -> Answer:
        """The answer to POST."""


class WebServer:
    """Serves a site from the moment it is made until :meth:`close`.

    Parameters
    ----------
    site:
        What is served.
    host:
        The address to listen on: a name of this machine, or an IP address.
    port:
        The port to listen on; 0 takes one that is free.

    Raises
    ------
    UsageError
        If the port is taken or not allowed, or the address is not this machine's.
    """

    def __init__(self, site: Site, host: str = LOOPBACK, port: int = 0) -> None:
        if not 0 <= port <= 65535:
            raise UsageError(f"{port} is no port", where="--port", rule="it must lie between 1 and 65535, or be 0")
        try:
            self._server = _Server(site, host, port)
        except (OSError, UnicodeError) as error:  # the latter of names that no machine can have
            raise _cannot_listen(error, host, port) from None
        self.host, self.port = host, int(self._server.server_address[1])
        # Daemon: a page that is still being answered does not keep the program alive.
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """Where a browser on this machine finds the page."""
        host = {"0.0.0.0": LOOPBACK, "::": "::1"}.get(self.host, self.host)
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/"

    def close(self) -> None:
        """Stop listening; connections that are open are cut off."""
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()
        self._server.cut_off()

    def __enter__(self) -> WebServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def text_answer(text: str, kind: str) -> Answer:
    """A text of the media type ``kind``."""
    return Answer(text.encode("utf-8"), f"{kind}; charset=utf-8")


def file_answer(name: str, text: str) -> Answer:
    """A text file; the extension of ``name`` (html, css, js, svg) determines the media type."""
    return text_answer(text, _MEDIA_TYPES[name.rpartition(".")[2]])


def json_answer(values: Any, headers: Mapping[str, str] | None = None) -> Answer:
    """``values`` as JSON."""
    body = json.dumps(values, ensure_ascii=False, allow_nan=False).encode("utf-8")
    return Answer(body, "application/json", headers=headers or {})


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach a server on this address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


class _Server(socketserver.ThreadingMixIn, socketserver.TCPServer):
    daemon_threads = True
    block_on_close = False
    # A port whose last connections are still being wound up is free.
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
        self._open.add(request)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        self._open.discard(request)
        super().shutdown_request(request)

    def cut_off(self) -> None:
        """End all connections, which pages keep open for what they may still ask."""
        for connection in tuple(self._open):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def handle_error(self, request: Any, client_address: Any) -> None:
        error = sys.exc_info()[1]
        # A page that is closed or reloaded breaks off what it asked for.
        if not isinstance(error, (ConnectionError, TimeoutError)):
            what = " ".join(f"{type(error).__name__}: {error}".split())
            print(f"lippmann: internal error while answering the page: {what}; report it", file=sys.stderr)


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    protocol_version = "HTTP/1.1"
    timeout = _PATIENCE

    def do_GET(self) -> None:
        self._respond(lambda: self.server.site.get(self._request()))

    def do_HEAD(self) -> None:
        self.do_GET()

    def do_POST(self) -> None:
        self._respond(lambda: self.server.site.post(self._request(), self._body()))

    def _respond(self, answer_to: Any) -> None:
        if self.command != "POST" and (self.headers.get("Content-Length") or self.headers.get("Transfer-Encoding")):
            self.close_connection = True  # else its body would be taken for the next request
        try:
            self._check_host()
            answer = answer_to()
        except RefusedError as refusal:
            answer = _line(str(refusal), refusal.status)
        except LippmannError as error:
            answer = _line(str(error), HTTPStatus.UNPROCESSABLE_ENTITY)
        except MemoryError:
            answer = _line("out of memory; close other programs", HTTPStatus.INSUFFICIENT_STORAGE)
        if self.command == "POST" and answer.status >= HTTPStatus.BAD_REQUEST:
            self.close_connection = True  # its body may not have been read
        self._send(answer)

    def _send(self, answer: Answer) -> None:
        self.send_response(answer.status)
        for name, value in {**_HEADERS, **answer.headers}.items():
            self.send_header(name, value)
        self.send_header("Content-Type", answer.kind)
        self.send_header("Content-Length", str(len(answer.body)))
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(answer.body)

    def _request(self) -> Request:
        return Request(self.path, self.headers)

    def _body(self) -> bytes:
        """The body of a POST request that a page of this server sent as JSON."""
        origin = self.headers.get("Origin")
        if origin is not None and _host_of(origin) != self.headers.get("Host"):
            raise RefusedError(HTTPStatus.FORBIDDEN, "only this server's own pages may send something")
        if self.headers.get_content_type() != "application/json":
            raise RefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "only JSON is taken")
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()):
            raise RefusedError(HTTPStatus.LENGTH_REQUIRED, "the length must be said")
        # A number of absurd length is not even read.
        if len(length) > _MOST_DIGITS or int(length) > _LARGEST_BODY:
            raise RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "this is too long")
        return self.rfile.read(int(length))

    def _check_host(self) -> None:
        if self.request_version == "HTTP/0.9":  # whose answers have no headers, so nothing guards them
            raise RefusedError(HTTPStatus.HTTP_VERSION_NOT_SUPPORTED, "HTTP/1.1 is spoken here")
        hosts = self.headers.get_all("Host") or []
        if len(hosts) != 1 or not _is_expected(hosts[0], self.server.host):
            raise RefusedError(HTTPStatus.FORBIDDEN, "this address is not served; use the one that was printed")

    def version_string(self) -> str:
        return "Lippmann"

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """What the base class refuses by itself: requests that are no HTTP, and methods without an answer."""
        self.close_connection = True
        unknown = code == HTTPStatus.NOT_IMPLEMENTED
        status = HTTPStatus.METHOD_NOT_ALLOWED if unknown else HTTPStatus(code)
        self._send(_line(status.phrase, status))

    def log_message(self, format: str, *args: Any) -> None:
        """Requests are not reported."""


def _line(line: str, status: HTTPStatus) -> Answer:
    return replace(json_answer({"error": line}), status=status)


def _host_of(origin: str) -> str | None:
    """Host and port of an origin; None if it is none."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return None


def _is_expected(named: str, listening_on: str) -> bool:
    """Whether a request may name this host; the port may be that of a tunnel.

    A foreign name may have been made to lead here; an IP address cannot be.
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
        return UsageError(f"port {port} is in use", where="--port", fix="say another, or none to have one chosen")
    if number == errno.EACCES:
        return UsageError(f"port {port} may not be used", where="--port", fix="say one of at least 1024")
    rule = "it must be an address of this machine, such as 127.0.0.1"
    reason = (error.strerror if isinstance(error, OSError) else "") or "no machine has this name"
    return UsageError(f"cannot listen on '{host}': {reason}", where="--host", rule=rule)
