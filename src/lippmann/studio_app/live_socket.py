"""The WebSocket of a page: views come in, frames go out as fast as the page shows them, the newest first."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import anyio.to_thread
from starlette.websockets import WebSocket, WebSocketDisconnect

from lippmann.display.panel import PixelWindow
from lippmann.display.visible_pixels import EyeMap
from lippmann.errors import LippmannError, UsageError
from lippmann.studio_app.page_values import (
    display_size,
    facts_of_view,
    optics_of,
    shell_line,
    state_of_values,
    values_of_state,
)
from lippmann.studio_app.real_lens import RealEyeMap
from lippmann.studio_app.render_jobs import KINDS, Job
from lippmann.studio_app.render_thread import LiveResult, Watcher
from lippmann.studio_app.session import WITHOUT_FILE, StudioSession, open_state
from lippmann.studio_app.state import StudioState
from lippmann.studio_app.state_toml import text_of_state, with_whole_paths
from lippmann.studio_app.wire import (
    LARGEST_NUMBER,
    Coding,
    FrameHeader,
    count_of,
    encode_frame,
    message_text,
    numbers_of,
    parse_message,
)

#: Frames on their way that the page has not shown yet: one travels while the next is made.
_MOST_ON_THE_WAY = 2

#: Seconds between two views that are taken over, half a frame of a usual screen. Of more views the newest is taken.
_VIEW_SECONDS = 1 / 120

#: Longest side of a picture in pixels, and the farthest that an eye may stand, in mm.
_MOST_SIDE, _FARTHEST = 4096, 1e5

#: How a page leaves, perhaps in the middle of a frame, and how one that takes nothing any more is left.
_PAGE_LEFT = (WebSocketDisconnect, ConnectionError, TimeoutError, asyncio.TimeoutError)

#: From so many samples on a picture is worth coding without loss.
_LOSSLESS_FROM = 32


class LiveSocket:
    """One page of a studio.

    Parameters
    ----------
    session:
        What the page shows.
    socket:
        The accepted WebSocket.
    coding:
        How pictures are sent while they change.
    follows:
        Whether the page shows all native pixels of whatever state others set, as a panel does, and sets none.
    """

    def __init__(self, session: StudioSession, socket: WebSocket, coding: Coding, *, follows: bool = False) -> None:
        self._session = session
        self._socket = socket
        self._coding = coding
        self._follows = follows
        self._loop = asyncio.get_running_loop()
        self._changed = asyncio.Event()
        self._messages: dict[str, dict[str, Any]] = {}
        self._newest: dict[str, Any] = {}
        self._looked = asyncio.Event()
        self._state = session.state
        self._pending: LiveResult | None = None
        self._sent = self._acknowledged = self._view = 0
        self._sent_facts: tuple[object, ...] | None = None
        self._watcher = Watcher(self._take_frame, self._take_error, self._take_busy)

    async def run(self) -> None:
        """Serve the page until it leaves."""
        session = self._session
        session.thread.add(self._watcher)
        session.job_listeners.append(self._take_job)
        session.state_listeners.append(self._take_state)
        self._say(self._hello())
        if session.jobs.last is not None:
            self._say(session.jobs.last.message())
        if self._follows:
            self._want_all()
        work = self._receive_all(), self._send_all(), self._watch_views()
        tasks = [asyncio.create_task(each) for each in work]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            session.job_listeners.remove(self._take_job)
            session.state_listeners.remove(self._take_state)
            session.thread.remove(self._watcher)
            for task in tasks:
                task.cancel()
            outcomes = await asyncio.gather(*tasks, return_exceptions=True)
        for outcome in outcomes:
            if isinstance(outcome, Exception) and not isinstance(outcome, _PAGE_LEFT):
                raise outcome

    # ---- From the page ---------------------------------------------------------------------------------------------

    async def _receive_all(self) -> None:
        while True:
            await self._receive()

    async def _receive(self) -> None:
        message = await self._socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect
        with self._report_errors():
            said = parse_message(message.get("text"))
            handlers: dict[str, Callable[[dict[str, Any]], None]] = {
                "shown": self._acknowledge,
                **({} if self._follows else self._commands()),
            }
            if said["type"] not in handlers:
                raise UsageError.unknown("message", said["type"], handlers)
            handlers[said["type"]](said)

    @contextmanager
    def _report_errors(self) -> Iterator[None]:
        try:
            yield
        except LippmannError as error:
            self._say({"type": "error", "line": str(error)})

    async def _watch_views(self) -> None:
        """Take over the newest view, and again after a while."""
        while True:
            await self._looked.wait()
            self._looked.clear()
            with self._report_errors():
                self._want(self._newest)
            await asyncio.sleep(_VIEW_SECONDS)

    def _commands(self) -> dict[str, Callable[[dict[str, Any]], None]]:
        return {
            "view": self._set_view,
            "pick": self._pick,
            "render": self._render,
            "cancel": lambda _: self._session.jobs.cancel(),
            "resume": lambda _: self._session.jobs.resume(),
            "save": self._save,
            "open": self._open,
        }

    def _acknowledge(self, said: dict[str, Any]) -> None:
        self._acknowledged = max(self._acknowledged, min(self._sent, count_of(said, "frame")))
        self._changed.set()

    def _set_view(self, said: dict[str, Any]) -> None:
        self._newest = said
        self._looked.set()

    def _want(self, said: dict[str, Any]) -> None:
        self._view = count_of(said, "number")
        width, height = (max(1, round(side)) for side in numbers_of(said, "size", 2, _MOST_SIDE))
        state = self._take_over(said)
        if said.get("eye") is None:
            left, top, columns, rows = (round(part) for part in numbers_of(said, "window", 4, LARGEST_NUMBER))
            panel = self._session.display(state).panel
            left, top = min(max(left, 0), panel.width - 1), min(max(top, 0), panel.height - 1)
            columns, rows = min(max(columns, 1), panel.width - left), min(max(rows, 1), panel.height - top)
            window = PixelWindow(left, top, columns, rows)
            view = state.native_view(window)
        else:
            x, y, z = numbers_of(said, "eye", 3, _FARTHEST)
            is_real = said.get("real") is True and self._session.display(state).lens is not None
            view = state.view((x, y, z), (width, height), RealEyeMap if is_real else EyeMap)
        self._session.thread.want(self._watcher, self._session.request_view(self._view, state, view))

    def _want_all(self) -> None:
        self._view += 1
        state = self._state = self._session.state
        self._session.thread.want(self._watcher, self._session.request_view(self._view, state, state.native_view()))

    def _take_over(self, said: dict[str, Any]) -> StudioState:
        """The state that a message carries: that of its page, whatever other pages have set since."""
        state = state_of_values(said.get("state"))
        self._session.set_state(state)
        self._state = state
        return state

    def _pick(self, said: dict[str, Any]) -> None:
        u, v = numbers_of(said, "place", 2, 1.0)

        def tell(depth: float | None) -> None:
            self._say_soon({"type": "picked", "depth": depth})

        self._session.thread.pick(self._watcher, u, v, tell)

    def _render(self, said: dict[str, Any]) -> None:
        kind = said.get("kind")
        if kind not in KINDS:
            raise UsageError.unknown("kind of render", kind, KINDS)
        self._session.render(kind, self._take_over(said))

    def _save(self, said: dict[str, Any]) -> None:
        state = self._take_over(said)
        self._session.check_has_file(state, "a saved state")
        title = self._session.title(state)
        name = f"{title.rpartition('.')[0] or title}.toml"
        self._say({"type": "saved", "name": name, "text": text_of_state(with_whole_paths(state))})

    def _open(self, said: dict[str, Any]) -> None:
        text = said.get("text")
        if not isinstance(text, str):
            raise UsageError("this is no state", rule="the text of a TOML file")
        state = open_state(text, self._state)
        self._session.check_files(state)

        def tell(error: LippmannError | None) -> None:
            if error is None:
                self._say_soon({"type": "state", "state": values_of_state(state)})
            else:
                self._take_error(error)

        self._session.try_state(state, tell)

    # ---- From the studio, in other threads -------------------------------------------------------------------------

    def _take_frame(self, result: LiveResult) -> None:
        self._soon(partial(self._put_frame, result))

    def _take_error(self, error: LippmannError) -> None:
        self._say_soon({"type": "error", "line": str(error)})

    def _take_busy(self, line: str | None) -> None:
        self._say_soon({"type": "busy", "line": line})

    def _take_job(self, job: Job) -> None:
        self._say_soon(job.message())

    def _take_state(self) -> None:
        if self._follows:
            self._soon(self._want_all)

    def _say_soon(self, message: dict[str, Any]) -> None:
        self._soon(partial(self._say, message))

    def _soon(self, call: Callable[[], None]) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(call)

    # ---- To the page -----------------------------------------------------------------------------------------------

    def _hello(self) -> dict[str, Any]:
        session, state = self._session, self._state
        return {
            "type": "hello",
            "state": values_of_state(state),
            "optics": optics_of(session.display(state), subpixels=state.subpixels),
            "displays": session.display_names(),
        }

    def _facts(self, result: LiveResult) -> dict[str, Any] | None:
        """Remarks on a frame; None if they were sent before."""
        session, state, frame = self._session, self._state, result.frame
        display = session.display(state)
        # Of the frame too: one of an older view may come after the state has changed.
        facts = facts_of_view(display, frame.placement, round(frame.exposure, 3))
        known = (state, display, facts)
        previous, self._sent_facts = self._sent_facts, known
        if previous == known:
            return None
        is_new = previous is None or previous[1] is not display
        return {
            "type": "facts",
            "title": session.title(state),
            "command": self._command_line(state),
            "optics": optics_of(display, subpixels=state.subpixels) if is_new else None,
            "display_size": display_size(state),
            **facts,
        }

    def _command_line(self, state: StudioState) -> str:
        words = self._session.command(state)
        return f"# This scene has no file: {WITHOUT_FILE}" if words is None else shell_line(words)

    def _put_frame(self, result: LiveResult) -> None:
        facts = self._facts(result)
        if facts is not None:
            self._say(facts)
        self._pending = result
        self._changed.set()

    def _say(self, message: dict[str, Any]) -> None:
        """Say something, in place of anything of the same type that has not been said yet."""
        self._messages[message["type"]] = message
        self._changed.set()

    async def _send_all(self) -> None:
        while True:
            await self._changed.wait()
            self._changed.clear()
            while self._messages:
                message = self._messages.pop(next(iter(self._messages)))
                await self._socket.send_text(message_text(message))
            if self._pending is not None and self._sent - self._acknowledged < _MOST_ON_THE_WAY:
                result, self._pending = self._pending, None
                await self._send_frame(result)
                self._changed.set()

    async def _send_frame(self, result: LiveResult) -> None:
        frame = result.frame
        height, width = frame.pixels.shape[:2]
        is_good = self._follows or result.is_final or frame.samples >= _LOSSLESS_FROM
        header = FrameHeader(
            "png" if is_good and self._coding == "jpeg" else self._coding,
            self._sent + 1,
            result.number,
            width,
            height,
            frame.samples,
            sum(frame.seconds.values()),
            result.is_final,
            frame.is_denoised,
        )
        body = await anyio.to_thread.run_sync(encode_frame, header, frame.pixels)
        self._sent += 1
        await self._socket.send_bytes(body)
