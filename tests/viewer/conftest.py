"""What the tests of the viewer share: a browser, started once, and its tabs."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

# Modules that only these tests use lie beside them.
sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def browser():
    """Chromium; the test is skipped where none is installed."""
    from browser import started

    with ExitStack() as stack:
        try:
            running = stack.enter_context(started())
        except LookupError as error:
            pytest.skip(f"{error}: scripts/setup.sh --dev installs it")
        yield running


@pytest.fixture
def open_tab(browser):
    """``open_tab(**options)``: a fresh :class:`browser.Tab`, closed after the test; options as for ``browser.tab``."""
    from browser import tab

    with ExitStack() as stack:
        yield lambda **options: stack.enter_context(tab(browser, **options))
