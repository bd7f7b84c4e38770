"""A real browser for tests: Debian's chromium, driven by Playwright, which has nothing to download for that.

``LIPPMANN_TEST_BROWSER`` names another chromium to use. WebGL 2 is drawn by software (SwiftShader), so that pictures
are the same on every machine.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome-stable", "google-chrome")

SWITCHES = (
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--force-color-profile=srgb",
    "--hide-scrollbars",
)


@dataclass
class Tab:
    """One page with what it said since it was opened.

    ``page`` is Playwright's (``evaluate``, ``keyboard``, ``mouse``, ``screenshot`` ...), ``said`` are the console's
    messages as "type: text", ``faults`` the exceptions that nothing caught and the requests that failed.
    """

    page: Any
    said: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    asked_for: list[str] = field(default_factory=list)

    def listen(self) -> None:
        self.page.on("console", lambda message: self.said.append(f"{message.type}: {message.text}"))
        self.page.on("pageerror", lambda error: self.faults.append(f"uncaught: {error}"))
        self.page.on("requestfailed", lambda request: self.faults.append(f"failed: {request.url}"))
        self.page.on("request", lambda request: self.asked_for.append(request.url))

    def open(self, address: str | Path) -> Tab:
        """Goes to an address, or to a file by its path, and waits until it is loaded; returns itself."""
        self.page.goto(address.resolve().as_uri() if isinstance(address, Path) else address, wait_until="load")
        return self

    def evaluate(self, script: str, argument: Any = None) -> Any:
        """The value of a JavaScript expression or function; promises are waited for."""
        return self.page.evaluate(script, argument)

    def wait_for(self, script: str, seconds: float = 60.0) -> Any:
        """Waits until the expression is true, and returns its value; a TimeoutError if it does not become so."""
        # Playwright's own waiting evaluates text inside the page, which pages of ours forbid.
        return self.wait_until(lambda: self.evaluate(script), seconds, script)

    def wait_until(self, holds: Callable[[], Any], seconds: float = 60.0, what: str = "the condition") -> Any:
        """Waits until the function's value is true, and returns that; a TimeoutError if it does not become so."""
        until = time.monotonic() + seconds
        while not (value := holds()):
            if time.monotonic() > until:
                raise TimeoutError(f"{what} is {value!r} after {seconds:g} s; said: {self.said}, {self.faults}")
            self.page.wait_for_timeout(50)
        return value

    def screenshot(self, path: Path) -> Path:
        """Writes what the window shows as a PNG."""
        self.page.screenshot(path=str(path))
        return path

    def assert_clean(self) -> None:
        """Nothing was said on the console, nothing was thrown, nothing failed to load."""
        assert self.said == []
        assert self.faults == []


def find_browser() -> str | None:
    """The path of a chromium, or None."""
    named = os.environ.get("LIPPMANN_TEST_BROWSER")
    if named:
        return named
    return next((path for path in map(shutil.which, NAMES) if path), None)


@contextmanager
def started() -> Iterator[Any]:
    """Playwright's browser, running for as long as the block lasts; LookupError where there is none."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        path = find_browser() or playwright.chromium.executable_path
        if not Path(path).exists():
            raise LookupError("no chromium is installed")
        browser = playwright.chromium.launch(executable_path=path, args=list(SWITCHES), timeout=60_000)
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def tab(
    browser: Any, *, size: tuple[int, int] = (1024, 768), offline: bool = False, dark: bool = False, **options: Any
) -> Iterator[Tab]:
    """A fresh page in a profile of its own; ``offline`` cuts it from all networks, this machine's own included.

    ``options`` go to Playwright's ``new_context``: ``has_touch``, ``device_scale_factor``, ``reduced_motion`` ...
    """
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]},
        offline=offline,
        color_scheme="dark" if dark else "light",
        **options,
    )
    try:
        opened = Tab(context.new_page())
        opened.listen()
        yield opened
    finally:
        context.close()
