"""HTTP server for one user's own pages: uvicorn in a thread, behind a :class:`RequestGuard`."""

from __future__ import annotations

import errno
import socket
import sys
import threading
import time

import uvicorn
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from lippmann.errors import UsageError
from lippmann.viewer.request_guard import Application, RequestGuard
from lippmann.viewer.responses import Site
from lippmann.viewer.secret_folder import SecretFolder
from lippmann.viewer.site_application import site_application

LOOPBACK = "127.0.0.1"

#: Limit on a message that a page sends by WebSocket, in bytes.
_MAX_MESSAGE = 1 << 16
#: Seconds after which an idle connection is closed.
_IDLE_TIMEOUT = 60
#: Seconds until open connections are ended by force when a server is closed, and until its thread is left alone.
_GRACE, _PATIENCE = 1, 5.0


class WebServer:
    """HTTP server that runs in a thread of its own from construction until :meth:`close`.

    Parameters
    ----------
    content:
        What to serve: a site, or an ASGI application.
    host:
        Address to listen on: a name of this machine, or an IP address.
    port:
        Port to listen on, 0 to 65535; 0 takes a free one.
    folder:
        First part of every path of the content, such as ``secret``; only the address tells it.
    framed_by:
        Pages that may embed those of the content, as sources of ``frame-ancestors``; by default none may.

    Raises
    ------
    UsageError
        If the port is taken or not allowed, or the address is not this machine's.
    """

    def __init__(
        self,
        content: Site | Application,
        host: str = LOOPBACK,
        port: int = 0,
        *,
        folder: str = "",
        framed_by: tuple[str, ...] = (),
    ) -> None:
        if not 0 <= port <= 65535:
            raise UsageError(f"{port} is no port", parameter="port", rule="it must lie between 1 and 65535, or be 0")
        try:
            listener = _listen(host, port)
        except (OSError, UnicodeError) as error:  # UnicodeError: a name that no machine can have
            raise _cannot_listen(error, host, port) from None
        self.host, self.port = host, int(listener.getsockname()[1])
        self._folder = folder
        application = content if callable(content) else site_application(content)
        if folder:
            application = SecretFolder(application, folder)
        self._server = uvicorn.Server(
            uvicorn.Config(
                RequestGuard(application, host, framed_by),
                http="h11",
                ws=WebSocketsSansIOProtocol,
                ws_max_size=_MAX_MESSAGE,
                ws_per_message_deflate=False,  # pictures do not get smaller
                lifespan="off",
                loop="asyncio",
                log_config=None,
                log_level="critical",
                access_log=False,
                server_header=False,
                proxy_headers=False,
                timeout_keep_alive=_IDLE_TIMEOUT,
                timeout_graceful_shutdown=_GRACE,
            )
        )
        # Daemon: an open request does not keep the program alive.
        self._thread = threading.Thread(target=self._server.run, args=([listener],), daemon=True)
        self._thread.start()
        while not self._server.started and self._thread.is_alive():
            time.sleep(0.005)

    @property
    def address(self) -> str:
        """URL of the page for a browser on this machine."""
        host = {"0.0.0.0": LOOPBACK, "::": "::1"}.get(self.host, self.host)
        folder = f"{self._folder}/" if self._folder else ""
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/{folder}"

    def close(self) -> None:
        """Stop listening and end all open connections."""
        self._server.should_exit = True
        self._thread.join(_PATIENCE)

    def __enter__(self) -> WebServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _listen(host: str, port: int) -> socket.socket:
    family, kind, protocol, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    listener = socket.socket(family, kind, protocol)
    try:
        if sys.platform != "win32":
            # A port whose last connections are in TIME_WAIT is free.
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(place)
        # Now, not once the loop runs: another program may listen on a port that is only bound.
        listener.listen(64)
    except OSError:
        listener.close()
        raise
    return listener


def _cannot_listen(error: OSError | UnicodeError, host: str, port: int) -> UsageError:
    number = error.errno if isinstance(error, OSError) else None
    if number == errno.EADDRINUSE:
        return UsageError(f"port {port} is in use", parameter="port", fix="say another, or none to have one chosen")
    if number == errno.EACCES:
        return UsageError(f"port {port} may not be used", parameter="port", fix="say one of at least 1024")
    rule = "it must be an address of this machine, such as 127.0.0.1"
    reason = (error.strerror if isinstance(error, OSError) else "") or "no machine has this name"
    return UsageError(f"cannot listen on '{host}': {reason}", parameter="host", rule=rule)
