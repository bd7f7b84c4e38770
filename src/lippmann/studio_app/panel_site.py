"""Content of the window that ``lippmann show`` puts on a display: one picture, native pixels one to one.

GET /                         the window
GET /panel.json               size of the display
GET /assets/..., /viewer/...  scripts, style sheets, the icon
GET /pictures/0/...           manifest and tiles of the picture, as the viewer's server has them
GET /check.png, POST /check   a pattern to photograph, and the answer to a photograph of it, see panel_check.py
"""

from __future__ import annotations

from http import HTTPStatus

from lippmann.display.formats.bridge import corner_of_screen, panels_or_none
from lippmann.studio_app.pages import static_files
from lippmann.studio_app.panel_check import camera_distance, check_response, pattern_response
from lippmann.viewer.responses import RefusedError, Request, Response, json_response
from lippmann.viewer.served_picture import PictureFile
from lippmann.viewer.server import ViewerSite


class PanelSite:
    """The window for one picture; a :class:`~lippmann.viewer.responses.Site`."""

    def __init__(self, picture: PictureFile) -> None:
        self._picture = picture
        self._panels = panels_or_none()
        self._viewer = ViewerSite([picture])
        self._static = {f"/{name}": response for name, response in static_files().items() if name not in ("", "panel")}
        self._static["/"] = static_files()["panel"]

    def get(self, request: Request) -> Response:
        if request.path in self._static:
            return self._static[request.path]
        if request.path == "/panel.json":
            return json_response(self._size())
        if request.path == "/check.png":
            return pattern_response(self._picture.current().display)
        # The viewer's own page and files are not part of this one.
        if not request.path.startswith("/pictures/"):
            raise RefusedError(HTTPStatus.NOT_FOUND, "there is nothing here")
        return self._viewer.get(request)

    def post(self, request: Request, body: bytes) -> Response:
        if request.path != "/check":
            raise RefusedError(HTTPStatus.METHOD_NOT_ALLOWED, "nothing is taken here")
        return check_response(self._picture.current().display, body)

    def _size(self) -> dict[str, object]:
        picture = self._picture.current()
        manifest = picture.manifest
        tiles = manifest["tiles"]
        assert isinstance(tiles, dict)
        width, height = tiles["width"], tiles["height"]
        corner = corner_of_screen(self._panels, width, height)
        size = {"width": width, "height": height, "name": manifest["display"], "live": None, "corner": corner}
        return {**size, "camera": camera_distance(picture.display)}
