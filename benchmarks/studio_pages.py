"""Several pages of one studio in a real browser: how often each of them, and the window on the display, is drawn anew.

Time on two cores: an estimated 5 minutes.

- Four pages turn the model at the same time: frames a second of each, and the ratio of the best to the worst.
- One page turns it while the panel's window shows all native pixels: frames a second of both, and the longest that the
  window stood still.
- A page sends 1 700 changes a second, over its WebSocket: frames a second that it gets.

Ratios and whether a window follows are what counts: frames a second are this machine's, with the browser on it.

python benchmarks/studio_pages.py [--seconds 10]
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from harness import save
from studio_command import live_socket, running_command

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "viewer"))

from browser import started, tab

PAGES, SIZE = 4, (900, 700)
CHANGES_PER_SECOND = 1700
#: Counts the frames that a page draws, and turns the model with each frame of the screen.
_MOVE = """(() => {
  const { studio } = window.lippmann;
  const draw = studio.stage.draw.bind(studio.stage);
  window.drawn = 0;
  studio.stage.draw = (...frame) => { window.drawn += 1; draw(...frame); };
  let turn = 0;
  const move = () => {
    turn = (turn + 1) % 180;
    studio.store.set({ turn: [turn, 0, 0] });
    requestAnimationFrame(move);
  };
  move();
})()"""
#: Milliseconds of each frame that the panel's window draws.
_WATCH = """(() => {
  window.times = [];
  new MutationObserver(() => window.times.push(performance.now())).observe(document.body, { attributes: true,
    attributeFilter: ['data-drawn'] });
})()"""
_READY = "(window.lippmann?.studio?.stage?.header?.number ?? 0) > 0"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0)
    seconds = parser.parse_args().seconds
    with started() as browser:
        result = {
            "seconds": seconds,
            "pages": _pages(browser, "seed-lenticular", seconds),
            "panel": _panel(browser, "looking-glass-portrait", seconds),
        }
    result["changes"] = _changes("seed-lenticular", seconds)
    save("studio_pages", result)


def _pages(browser: Any, display: str, seconds: float) -> dict[str, Any]:
    """Frames a second of pages that all turn the model."""
    with running_command(display, "teapot") as (_, address), ExitStack() as stack:
        pages = [stack.enter_context(tab(browser, size=SIZE)).open(address) for _ in range(PAGES)]
        for page in pages:
            page.wait_for(_READY)
        for page in pages:
            page.evaluate(_MOVE)
        pages[0].page.wait_for_timeout(3000)  # sizes have settled
        began, before = time.perf_counter(), [page.evaluate("drawn") for page in pages]
        pages[0].page.wait_for_timeout(1000 * seconds)
        spent = time.perf_counter() - began
        rates = sorted((page.evaluate("drawn") - count) / spent for page, count in zip(pages, before, strict=True))
    return {"display": display, "frames_per_second": rates, "ratio": rates[-1] / max(rates[0], 1e-9)}


def _panel(browser: Any, display: str, seconds: float) -> dict[str, Any]:
    """Frames a second of a page that turns the model, and of the panel's window beside it."""
    with (
        running_command(display, "teapot") as (_, address),
        tab(browser, size=SIZE) as page,
        tab(browser, size=(1536, 2048)) as panel,
    ):
        page.open(address).wait_for(_READY)
        panel.open(f"{address}panel?live").wait_for("Number(document.body.dataset.drawn) > 0")
        panel.evaluate(_WATCH)
        page.evaluate(_MOVE)
        page.page.wait_for_timeout(3000)
        began, before = panel.evaluate("performance.now()"), page.evaluate("drawn")
        page.page.wait_for_timeout(1000 * seconds)
        ended, drawn = panel.evaluate("performance.now()"), page.evaluate("drawn") - before
        times = [each for each in panel.evaluate("times") if began < each <= ended]
    spent = (ended - began) / 1000
    still = max(later - earlier for earlier, later in zip([began, *times], [*times, ended], strict=True)) / 1000
    return {
        "display": display,
        "frames_per_second": drawn / spent,
        "panel_frames_per_second": len(times) / spent,
        "longest_still_s": still,
    }


def _changes(display: str, seconds: float) -> dict[str, Any]:
    """Frames a second of a page that sends more changes than frames can be made."""
    with running_command(display, "teapot") as (_, address), live_socket(address) as socket:
        state = json.loads(socket.recv(60))["state"]

        def turn(number: int) -> None:
            turned = state | {"turn": [number % 180, 0, 0]}
            view = {"type": "view", "number": number, "size": [512, 512], "eye": [0, 0, 500], "state": turned}
            socket.send(json.dumps(view))

        def take(wait: float) -> int:
            """1 once a frame came, which is acknowledged."""
            try:
                message = socket.recv(wait)
            except TimeoutError:
                return 0
            if isinstance(message, str):
                return 0
            socket.send(json.dumps({"type": "shown", "frame": int.from_bytes(message[4:8], "little")}))
            return 1

        turn(0)
        while not take(60.0):  # kernels are compiled
            pass
        sent = frames = 0
        began = now = time.perf_counter()
        while now - began < seconds:
            while sent < (now - began) * CHANGES_PER_SECOND:
                sent += 1
                turn(sent)
            frames += take(0.002)
            now = time.perf_counter()
    return {"display": display, "changes_per_second": sent / (now - began), "frames_per_second": frames / seconds}


if __name__ == "__main__":
    main()
