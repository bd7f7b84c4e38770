"""The studio's server, as an ASGI application below a secret folder.

    GET  /                                      the studio's page
    GET  /panel                                 the window for the display itself
    GET  /panel.json                            size of the display, and what the window shows
    GET  /assets/NAME, /viewer/NAME             scripts, style sheets, the icon
    GET  /pictures/N/...                        manifest and tiles of the picture that the Nth render made
    GET  /results/N/NAME                        the file that it made
    GET  /check.png                             a pattern to photograph, for the display of the page's state
    POST /check                                 what a photograph of it tells, see panel_check.py
    POST /files/NAME, /files                    a model or an environment dropped onto the page, or several files
    WS   /live, /live-panel                     frames and messages, see live_socket.py

All other paths are refused, and so are all without the folder's name, which only the printed address tells.
"""

from __future__ import annotations

import asyncio
from http import HTTPStatus

import anyio.to_thread
from starlette.requests import Request as ServerRequest
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route, Router, WebSocketRoute
from starlette.websockets import WebSocket

from lippmann.display.formats.bridge import corner_of_screen
from lippmann.errors import LippmannError, PictureError
from lippmann.studio_app.live_socket import LiveSocket
from lippmann.studio_app.pages import static_files
from lippmann.studio_app.panel_check import camera_distance, check_response, pattern_response
from lippmann.studio_app.session import StudioSession
from lippmann.studio_app.uploads import Dropped
from lippmann.studio_app.wire import Coding
from lippmann.viewer.request_guard import Receive, Scope, Send, send_response
from lippmann.viewer.responses import RefusedError, Request, json_response, not_found
from lippmann.viewer.responses import Response as PlainResponse
from lippmann.viewer.served_picture import PictureFile
from lippmann.viewer.server import ViewerSite
from lippmann.viewer.site_application import json_body

#: Pages at a time; each has a socket.
MOST_PAGES = 8


class StudioSite:
    """Routes of a studio.

    Parameters
    ----------
    session:
        What the pages show.
    coding:
        How pictures are sent while they change: ``rgb`` within one machine, ``jpeg`` through a wire.
    """

    def __init__(self, session: StudioSession, coding: Coding = "jpeg") -> None:
        self._session = session
        self._coding = coding
        self._pictures: dict[int, ViewerSite] = {}
        self._pages = 0
        routes: list[BaseRoute] = [
            _Route("/panel.json", self._panel),
            _Route("/check.png", self._pattern),
            _Route("/check", self._check, methods=["POST"]),
            _Route("/pictures/{number:int}/{rest:path}", self._picture),
            _Route("/results/{number:int}/{name}", self._result),
            _Route("/files/{name}", self._file, methods=["POST"]),
            _Route("/files", self._file, methods=["POST"]),
            WebSocketRoute("/live", self._live),
            WebSocketRoute("/live-panel", self._live_panel),
        ]
        self._router = Router(routes, redirect_slashes=False, default=_static)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await self._router(scope, receive, send)

    async def _live(self, socket: WebSocket) -> None:
        await self._serve(socket, follows=False)

    async def _live_panel(self, socket: WebSocket) -> None:
        await self._serve(socket, follows=True)

    async def _serve(self, socket: WebSocket, *, follows: bool) -> None:
        if self._pages >= MOST_PAGES:
            raise RefusedError(HTTPStatus.SERVICE_UNAVAILABLE, "the studio is open in too many pages; close some")
        self._pages += 1
        try:
            await socket.accept()
            await LiveSocket(self._session, socket, self._coding, follows=follows).run()
        finally:
            self._pages -= 1

    async def _panel(self, request: ServerRequest) -> Response:
        display = self._session.display(self._session.state)
        panel = display.panel
        size = {"width": panel.width, "height": panel.height, "name": display.title or display.name}
        corner = corner_of_screen(self._session.panels, panel.width, panel.height)
        facts = {**size, "live": "live-panel", "corner": corner, "camera": camera_distance(display)}
        return _as_response(json_response(facts))

    async def _pattern(self, request: ServerRequest) -> Response:
        display = self._session.display(self._session.state)
        return _as_response(await anyio.to_thread.run_sync(pattern_response, display))

    async def _check(self, request: ServerRequest) -> Response:
        display, body = self._session.display(self._session.state), await json_body(request)
        return _as_response(await anyio.to_thread.run_sync(check_response, display, body))

    async def _picture(self, request: ServerRequest) -> Response:
        number, rest = request.path_params["number"], request.path_params["rest"]
        job = self._session.jobs.finished(number)
        if job is None or job.shows != "picture":
            raise not_found()
        if number not in self._pictures:
            try:
                self._pictures[number] = ViewerSite([PictureFile(job.output)])
            except PictureError as error:
                raise RefusedError(HTTPStatus.NOT_FOUND, str(error)) from None
        plain = Request(f"/pictures/0/{rest}", request.headers)
        response = await anyio.to_thread.run_sync(self._pictures[number].get, plain)
        return _as_response(response)

    async def _result(self, request: ServerRequest) -> Response:
        job = self._session.jobs.finished(request.path_params["number"])
        if job is None or request.path_params["name"] != job.output.name or not job.output.is_file():
            raise not_found()
        return FileResponse(job.output)

    async def _file(self, request: ServerRequest) -> Response:
        """Keep a drop that can be shown, and answer with the settings that show it; another one changes nothing.

        What is wrong with the files is a regular answer: browsers log all others as faults of the page.
        """
        session = self._session
        try:
            dropped = await session.uploads.receive(request.path_params.get("name", ""), request)
            try:
                changes = await self._try(dropped)
            except BaseException:
                session.uploads.discard(dropped)
                raise
        except LippmannError as error:
            return _as_response(json_response({"error": str(error)}))
        return _as_response(json_response({"path": str(dropped.path), "changes": changes}))

    async def _try(self, dropped: Dropped) -> dict[str, object]:
        loop = asyncio.get_running_loop()
        tried: asyncio.Future[LippmannError | None] = loop.create_future()

        def end(error: LippmannError | None) -> None:
            if not tried.done():
                tried.set_result(error)

        def then(error: LippmannError | None) -> None:
            if not loop.is_closed():
                loop.call_soon_threadsafe(end, error)

        changes = self._session.try_dropped(dropped, then)
        error = await tried
        if error is not None:
            raise error
        return changes


class _Route(Route):
    """A route that refuses other methods as the guard refuses requests: with one line of JSON."""

    async def handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        if self.methods is not None and scope["method"] not in self.methods:
            raise RefusedError(HTTPStatus.METHOD_NOT_ALLOWED, HTTPStatus.METHOD_NOT_ALLOWED.phrase)
        await super().handle(scope, receive, send)


async def _static(scope: Scope, receive: Receive, send: Send) -> None:
    path = scope["path"].removeprefix("/")
    response = static_files().get(path)
    if scope["type"] != "http" or response is None:
        raise not_found()
    if scope["method"] == "POST":
        raise RefusedError(HTTPStatus.METHOD_NOT_ALLOWED, "nothing is taken here")
    await send_response(send, response)


def _as_response(plain: PlainResponse) -> Response:
    return Response(plain.body, int(plain.status), dict(plain.headers), plain.kind)
