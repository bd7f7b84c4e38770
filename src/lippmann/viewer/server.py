"""Content of the viewer's server: the page, its files, and manifests and tiles of pictures.

    GET /                                     the page
    GET /assets/NAME                          a script, a style sheet or the icon of the page
    GET /pictures/N/manifest.json             description of a picture; the ETag identifies the file's version
    GET /pictures/N/light.json                light of its display's lenses; If-Match as for tiles
    GET /pictures/N/tiles/LAYER/COLUMN_ROW    a tile in the manifest's format; If-Match requires a version

All other paths are refused. An error response is {"error": "one line for the user"}.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from http import HTTPStatus

from lippmann.errors import UsageError
from lippmann.viewer import page
from lippmann.viewer.lens_light import lens_light
from lippmann.viewer.responses import (
    RefusedError,
    Request,
    Response,
    content_security_policy,
    file_response,
    json_response,
    not_found,
    text_response,
)
from lippmann.viewer.served_picture import PictureFile, ServedPicture

_MANIFEST = re.compile(r"/pictures/([0-9]{1,3})/manifest\.json")
_LIGHT = re.compile(r"/pictures/([0-9]{1,3})/light\.json")
_TILE = re.compile(r"/pictures/([0-9]{1,3})/tiles/([A-Za-z_][A-Za-z0-9_-]{0,99})/([0-9]{1,6})_([0-9]{1,6})")


class ViewerSite:
    """The viewer's page for one or more pictures; a :class:`~lippmann.viewer.responses.Site`."""

    def __init__(self, pictures: Sequence[PictureFile]) -> None:
        self._pictures = tuple(pictures)
        policy = content_security_policy(page.served_script_hash())
        html = text_response(page.served_page(len(self._pictures)), "text/html")
        self._page = {f"/assets/{name}": file_response(name, text) for name, text in page.assets().items()}
        self._page["/"] = replace(html, headers={"Content-Security-Policy": policy})

    def get(self, request: Request) -> Response:
        path = request.path
        if path in self._page:
            return self._page[path]
        if match := _MANIFEST.fullmatch(path):
            return self._manifest(int(match[1]))
        if match := _LIGHT.fullmatch(path):
            picture = self._require_version(int(match[1]), request.headers.get("If-Match"))
            return json_response(lens_light(picture.display))
        if match := _TILE.fullmatch(path):
            number, layer, column, row = match.groups()
            return self._tile(int(number), layer, int(column), int(row), request.headers.get("If-Match"))
        raise not_found()

    def post(self, request: Request, body: bytes) -> Response:
        raise RefusedError(HTTPStatus.METHOD_NOT_ALLOWED, "nothing is taken here")

    def _picture(self, number: int) -> PictureFile:
        if number >= len(self._pictures):
            raise not_found()
        return self._pictures[number]

    def _require_version(self, number: int, version: str | None) -> ServedPicture:
        picture = self._picture(number).load_once()
        if version is not None and version != f'"{picture.version}"':
            raise RefusedError(HTTPStatus.PRECONDITION_FAILED, "the file was written anew; reload the page")
        return picture

    def _manifest(self, number: int) -> Response:
        picture = self._picture(number).current()
        return json_response(picture.manifest, headers={"ETag": f'"{picture.version}"'})

    def _tile(self, number: int, layer: str, column: int, row: int, version: str | None) -> Response:
        picture = self._require_version(number, version)
        try:
            if picture.tile_format == "png":
                return Response(picture.tiles.png(layer, column, row), "image/png")
            return Response(picture.tiles.rgb(layer, column, row), "application/octet-stream")
        except UsageError as error:
            raise RefusedError(HTTPStatus.NOT_FOUND, str(error)) from None
