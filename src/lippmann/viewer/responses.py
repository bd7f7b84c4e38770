"""Requests and responses of a :class:`Site`, as plain values that know nothing of the server under them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from http import HTTPStatus
from typing import Protocol

_MEDIA_TYPES = {"html": "text/html", "css": "text/css", "js": "text/javascript", "svg": "image/svg+xml"}


@dataclass(frozen=True)
class Request:
    """HTTP request: the ``path`` as sent, without decoding, and the headers, whatever the case of their names."""

    path: str
    headers: Mapping[str, str]


@dataclass(frozen=True)
class Response:
    """HTTP response: body, media type (``kind``), status and additional headers."""

    body: bytes
    kind: str
    status: HTTPStatus = HTTPStatus.OK
    headers: Mapping[str, str] = field(default_factory=dict)


#: The directive that every policy ends with: no page may embed this one. A server may put others in its place.
NO_FRAMING = "frame-ancestors 'none'"


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


def content_security_policy(*inline_scripts: str) -> str:
    """Content-Security-Policy that allows files of this server only, no inline script and no framing.

    ``inline_scripts`` are the exceptions: sources ``'sha256-...'`` of inline scripts, quoted.
    """
    scripts = " ".join(["'self'", *inline_scripts])
    return (
        f"default-src 'none'; script-src {scripts}; style-src 'self'; "
        f"img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; {NO_FRAMING}"
    )


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


def error_response(line: str, status: HTTPStatus) -> Response:
    """``{"error": line}``: one line for the user."""
    return replace(json_response({"error": line}), status=status)


def not_found() -> RefusedError:
    """Refusal of a path that leads to nothing."""
    return RefusedError(HTTPStatus.NOT_FOUND, "there is nothing here")
