"""A :class:`~lippmann.viewer.responses.Site` as an ASGI application: its methods run in threads."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from http import HTTPStatus

import anyio.to_thread
from starlette.requests import ClientDisconnect
from starlette.requests import Request as ServerRequest

from lippmann.viewer.request_guard import Application, Receive, Scope, Send, send_response
from lippmann.viewer.responses import RefusedError, Request, Response, Site, not_found

#: Limit on the body of a request in bytes; pages send a few numbers, or a small photograph.
_MAX_BODY = 1 << 20
#: Limit on the digits of a Content-Length, so that absurd numbers are never parsed.
_MAX_LENGTH_DIGITS = 12


def site_application(site: Site) -> Application:
    """ASGI application of the site; it takes no WebSocket."""

    async def application(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            raise not_found()
        request = plain_request(scope)
        call: Callable[[], Response] = partial(site.get, request)
        if scope["method"] == "POST":
            body = await json_body(ServerRequest(scope, receive))
            call = partial(site.post, request, body)
        # A thread that hangs does not keep a closed server alive.
        await send_response(send, await anyio.to_thread.run_sync(call, abandon_on_cancel=True))

    return application


def plain_request(scope: Scope) -> Request:
    """Path, as it was sent, and headers of an HTTP request."""
    query = b"?" + scope["query_string"] if scope["query_string"] else b""
    return Request((scope["raw_path"] + query).decode("latin-1"), ServerRequest(scope).headers)


async def json_body(request: ServerRequest) -> bytes:
    """Body of a POST request that a page of this server sent as JSON."""
    check_body(request, "application/json", _MAX_BODY)
    try:
        return await request.body()
    except ClientDisconnect:
        raise ConnectionAbortedError from None


def check_body(request: ServerRequest, kind: str, most_bytes: int) -> int:
    """Length of a body, from the headers alone; a RefusedError unless it is of the media type and within the limit."""
    named = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if named != kind:
        what = "JSON" if kind == "application/json" else kind
        raise RefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, f"only {what} is taken")
    length = request.headers.get("content-length", "")
    if not (length.isascii() and length.isdigit()):
        raise RefusedError(HTTPStatus.LENGTH_REQUIRED, "the length must be said")
    if len(length) > _MAX_LENGTH_DIGITS or int(length) > most_bytes:
        raise RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "this is too long")
    return int(length)
