"""Models dropped onto the page: kept in a private folder, for as long as the studio runs."""

from __future__ import annotations

import re
from http import HTTPStatus
from pathlib import Path
from urllib.parse import unquote

import anyio
from starlette.requests import ClientDisconnect, Request

from lippmann.viewer.responses import RefusedError
from lippmann.viewer.site_application import check_body

#: Endings of models that are one file.
ENDINGS = (".glb", ".obj", ".stl", ".ply")

#: Bytes of one model, and of all that one studio keeps.
MOST_BYTES = 1 << 29
MOST_BYTES_IN_ALL = 1 << 31

_NAME = re.compile(r"[^\W_][\w .()+-]{0,99}", re.UNICODE)


class Uploads:
    """Folder of the models dropped onto a page.

    Parameters
    ----------
    folder:
        An empty folder that other users cannot read.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._count = 0
        self._bytes = 0

    async def receive(self, name: str, request: Request) -> Path:
        """Write the body of a request into the folder.

        Parameters
        ----------
        name:
            File name, as the address has it.
        request:
            POST of ``application/octet-stream``.

        Returns
        -------
        Path
            The file, in a folder of its own, so that two of one name live beside each other.

        Raises
        ------
        RefusedError
            The name or the ending is not allowed, or there are too many bytes.
        """
        named = unquote(name)
        if not _NAME.fullmatch(named) or not named.lower().endswith(ENDINGS):
            rule = f"it must be one of {', '.join(ENDINGS)}"
            raise RefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, f"{named[:60]}: this file cannot be opened; {rule}")
        length = check_body(request, "application/octet-stream", MOST_BYTES)
        if self._bytes + length > MOST_BYTES_IN_ALL:
            raise RefusedError(HTTPStatus.INSUFFICIENT_STORAGE, "too many models were dropped; start the studio anew")
        self._bytes += length
        self._count += 1
        folder = self._folder / str(self._count)
        folder.mkdir(mode=0o700)
        path = folder / named
        try:
            async with await anyio.open_file(path, "xb") as file:
                async for chunk in request.stream():
                    await file.write(chunk)
        except ClientDisconnect:
            path.unlink()
            raise ConnectionAbortedError from None
        return path
