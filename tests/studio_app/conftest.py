"""What the tests of the studio share: studios that render by a stand-in, and a browser."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

# Modules that only these tests use lie beside them, the browser beside those of the viewer.
sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parent.parent / "viewer")]


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    """A running studio of small pictures, made by a stand-in; see :class:`stand_in.Running`."""
    from stand_in import running

    with running(tmp_path_factory.mktemp("studio")) as made:
        yield made


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
