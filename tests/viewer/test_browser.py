"""The harness itself: what it says of a page is so."""

from __future__ import annotations

import pytest
from PIL import Image


@pytest.fixture
def page(tmp_path):
    def write(body):
        path = tmp_path / "page.html"
        path.write_text(f"<!doctype html><meta charset=utf-8><title>t</title>{body}", encoding="utf-8")
        return path

    return write


def test_clean_page_is_clean(open_tab, page):
    tab = open_tab().open(page("<body style='margin:0;background:#204060'></body>"))
    tab.assert_clean()
    assert tab.evaluate("document.title") == "t"
    assert tab.evaluate("async (x) => x + 1", 2) == 3


@pytest.mark.slow
@pytest.mark.parametrize(
    "fault", ["console.log('x')", "console.warn('x')", "throw new Error('x')", "fetch('missing.json').catch(() => 0)"]
)
def test_faults_are_seen(open_tab, page, fault):
    tab = open_tab().open(page(f"<script>{fault}</script>"))
    tab.wait_for("document.readyState === 'complete'")
    with pytest.raises(AssertionError):
        tab.assert_clean()


def test_screenshot_shows_exact_colours(open_tab, page, tmp_path):
    tab = open_tab(size=(64, 48)).open(page("<body style='margin:0;background:#204060'></body>"))
    with Image.open(tab.screenshot(tmp_path / "shot.png")) as shot:
        assert shot.size == (64, 48)
        assert shot.convert("RGB").getpixel((30, 20)) == (0x20, 0x40, 0x60)


def test_webgl_is_there(open_tab, page):
    tab = open_tab().open(page("<canvas></canvas>"))
    assert tab.evaluate("document.querySelector('canvas').getContext('webgl2') !== null")
    tab.assert_clean()
