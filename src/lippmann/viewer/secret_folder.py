"""A folder that only the printed address names: who cannot read it, cannot ask for anything in it."""

from __future__ import annotations

import hmac
import secrets

from lippmann.viewer.request_guard import Application, Receive, Scope, Send
from lippmann.viewer.responses import not_found


def secret_folder() -> str:
    """Name of a folder that cannot be guessed: 192 random bits."""
    return secrets.token_urlsafe(24)


class SecretFolder:
    """ASGI application that finds another one below a folder, and nothing beside it.

    Parameters
    ----------
    application:
        Its paths begin below the folder.
    folder:
        The folder's name, of letters and digits, ``-`` and ``_``.
    """

    def __init__(self, application: Application, folder: str) -> None:
        self._application = application
        self._prefix = f"/{folder}/".encode("ascii")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        raw: bytes = scope["raw_path"]
        length = len(self._prefix)
        if not hmac.compare_digest(raw[:length], self._prefix):
            raise not_found()
        # The prefix holds nothing to decode: both paths begin with it.
        below = {**scope, "path": scope["path"][length - 1 :], "raw_path": raw[length - 1 :]}
        await self._application(below, receive, send)
