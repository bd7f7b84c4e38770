"""The calibration's page in a real browser: its pixels are the patterns', and what is turned is saved."""

from __future__ import annotations

import base64
import math
from dataclasses import replace

import numpy as np
import pytest

from lippmann.calibration import Pattern, draw
from lippmann.display import load_display
from lippmann.display.formats.monitor import Monitor
from lippmann.viewer.calibrate.site import CalibrationSite
from lippmann.viewer.http_server import WebServer

PIXELS = """() => {
  const canvas = document.getElementById("pattern");
  const copy = new OffscreenCanvas(canvas.width, canvas.height);
  const context = copy.getContext("2d");
  context.drawImage(canvas, 0, 0);
  const bytes = context.getImageData(0, 0, copy.width, copy.height).data;
  let text = "";
  for (let start = 0; start < bytes.length; start += 4096) {
    text += String.fromCharCode(...bytes.subarray(start, start + 4096));
  }
  return [copy.width, copy.height, btoa(text)];
}"""


@pytest.fixture
def open_page(open_tab, tmp_path):
    """``open_page(monitor, size)``: the page in a window of this size, the panel's by default, once it has drawn."""
    servers = []

    def go(monitor, size=None, **options):
        servers.append(WebServer(CalibrationSite(monitor, tmp_path / "mine.toml", lambda turned: None)))
        tab = open_tab(size=size or (monitor.panel.width, monitor.panel.height), **options)
        tab.server = servers[-1]
        tab.open(tab.server.address)
        tab.wait_for("globalThis.lippmann?.monitor?.pitch > 0 && !document.getElementById('controls').hidden")
        return tab

    yield go
    for server in servers:
        server.close()


def drawn(tab):
    width, height, data = tab.evaluate(PIXELS)
    pixels = np.frombuffer(base64.b64decode(data), np.uint8).reshape(height, width, 4)
    assert (pixels[..., 3] == 255).all()
    return pixels[..., :3] / 255


def turned(tab):
    return tab.evaluate("lippmann.monitor")


def press(tab, *keys):
    for key in keys:
        tab.page.keyboard.press(key)


def end_to_end(monitor):
    """What half a lens from end to end is for pitch and slope, and the share of a centre's field."""
    panel, right = monitor.panel, monitor.lenses_right
    return {
        "pitch": 0.5 * monitor.pitch / (panel.width * right),
        "slope": 0.5 / (panel.height * right),
        "center": 1 / 11,
    }


@pytest.mark.long_cases(but=["cells"])
@pytest.mark.slow
def test_pixels_are_those_of_the_patterns(open_page, monitor):
    tab = open_page(monitor)
    for key, name in enumerate(("slope", "pitch", "center"), start=1):
        press(tab, str(key))
        expected = draw(Pattern(name, step=end_to_end(monitor)[name]), monitor)
        # Single precision may decide otherwise for a sub-pixel on the very edge of what is lit.
        assert np.count_nonzero(drawn(tab) != expected) <= 2
        assert 0.1 < expected.mean() < 0.9
    press(tab, "4")
    for views in (3, 7):
        tab.page.fill("#views", str(views), force=True)
        assert np.count_nonzero(drawn(tab) != draw(Pattern("stripes", views=views), monitor)) <= 2
    tab.assert_clean()


@pytest.mark.long
def test_pixels_stay_exact_far_from_the_origin(open_page):
    wide = Monitor("wide", replace(load_display("panel-8k").panel, width=3840, height=80), 60.013, -6.0717, 0.111)
    tab = open_page(wide)
    press(tab, "4")
    wrong = np.count_nonzero(drawn(tab) != draw(Pattern("stripes"), wide))
    assert wrong < 1e-5 * 3 * 3840 * 80


@pytest.mark.long
def test_turned_values_are_drawn_and_saved(open_page, slanted, tmp_path):
    tab = open_page(slanted)
    press(tab, "4", "Shift+ArrowRight", "ArrowUp", "Alt+Comma", "Period")
    now = turned(tab)
    assert now["pitch"] > slanted.pitch
    assert now["lean"] > 1 / slanted.slope
    monitor = replace(slanted, pitch=now["pitch"], slope=1 / now["lean"], center=now["center"])
    assert np.count_nonzero(drawn(tab) != draw(Pattern("stripes"), monitor)) <= 2
    press(tab, "s")
    tab.wait_for("document.getElementById('status').textContent.startsWith('Saved')")
    saved = Monitor.of_display(load_display(tmp_path / "mine.toml"))
    assert saved.pitch == pytest.approx(now["pitch"], rel=1e-12)
    assert saved.slope == pytest.approx(1 / now["lean"], rel=1e-9)
    assert saved.center == pytest.approx(now["center"], abs=1e-9)
    tab.assert_clean()


@pytest.mark.slow
def test_turning_leaves_the_middle_of_the_panel_as_it_is(open_page, slanted):
    tab = open_page(slanted)
    press(tab, "Shift+ArrowRight", "Shift+ArrowDown")
    now = turned(tab)
    monitor = replace(slanted, pitch=now["pitch"], slope=1 / now["lean"], center=now["center"])
    width, height = slanted.panel.width, slanted.panel.height
    middle = np.array([(width - 1) / 2]), np.array([(height - 1) / 2])
    difference = monitor.phase(*middle, 1) - slanted.phase(*middle, 1)
    assert difference % 1 == pytest.approx(0, abs=1e-9) or difference % 1 == pytest.approx(1, abs=1e-9)


@pytest.mark.slow
def test_a_key_turns_by_a_tenth_of_a_lens_from_end_to_end(open_page, slanted):
    tab = open_page(slanted)
    press(tab, "ArrowRight")
    more = replace(slanted, pitch=turned(tab)["pitch"]).lenses_right - slanted.lenses_right
    assert more * slanted.panel.width == pytest.approx(0.1, rel=1e-3)


@pytest.mark.slow
def test_a_click_takes_the_value_of_a_field(open_page, slanted):
    tab = open_page(slanted, size=(1200, 900))
    tab.page.mouse.click(slanted.panel.width - 3, 20)  # the rightmost of the fields, beside which the panel ends
    steps = end_to_end(slanted)
    assert turned(tab)["lean"] == pytest.approx(1 / slanted.slope + 5 * steps["slope"], rel=1e-9)
    press(tab, "2")
    now = turned(tab)
    tab.page.mouse.click(20, 3)  # the uppermost
    assert turned(tab)["pitch"] == pytest.approx(slanted.pitch - 5 * steps["pitch"], rel=1e-2)
    assert turned(tab)["lean"] == now["lean"]
    before = turned(tab)
    tab.page.mouse.click(1000, 300)  # beyond the panel
    assert turned(tab) == before


@pytest.mark.slow
def test_values_can_be_typed_and_nonsense_is_marked(open_page, slanted):
    tab = open_page(slanted, size=(1000, 800))
    tab.page.fill("#pitch", "46.25")
    tab.page.press("#pitch", "Enter")
    assert turned(tab)["pitch"] == 46.25
    tab.page.fill("#slope", "infinite")
    tab.page.press("#slope", "Tab")
    assert turned(tab)["lean"] == 0
    before = turned(tab)
    for field, text in (("#pitch", "0"), ("#pitch", "x"), ("#slope", "0.01"), ("#center", ""), ("#pitch", "1e9")):
        tab.page.fill(field, text)
        tab.page.press(field, "Tab")
        assert tab.page.get_attribute(field, "aria-invalid") == "true"
    assert turned(tab) == before
    tab.page.click("#reset")
    assert turned(tab)["pitch"] == pytest.approx(slanted.pitch)


@pytest.mark.long
def test_sub_pixels_can_be_swapped(open_page, slanted):
    tab = open_page(slanted, size=(1000, 800))
    press(tab, "4")
    tab.page.select_option("#order", "bgr")
    panel = replace(slanted.panel, subpixel_offsets=slanted.panel.subpixel_offsets[::-1])
    expected = draw(Pattern("stripes"), replace(slanted, panel=panel))
    found = drawn(tab)
    assert np.count_nonzero(found[: panel.height, : panel.width] != expected) <= 2
    assert not found[panel.height :].any()
    assert not found[:, panel.width :].any()


@pytest.mark.long
def test_windows_of_the_page_follow_each_other(open_page, slanted):
    tab = open_page(slanted, size=(1000, 800))
    press(tab, "4", "ArrowRight")
    with tab.page.expect_popup() as opened:
        tab.page.click("#window")
    other = opened.value
    other.wait_for_load_state()
    tab.wait_for("true")
    here = turned(tab)

    def follows():
        return other.evaluate("globalThis.lippmann?.monitor?.pitch") == turned(tab)["pitch"]

    tab.wait_until(follows)
    assert other.evaluate("document.getElementById('controls').hidden")
    press(tab, "Shift+ArrowLeft")
    assert turned(tab)["pitch"] != here["pitch"]
    tab.wait_until(follows)
    other.keyboard.press("Shift+ArrowRight")
    tab.wait_until(lambda: turned(tab)["pitch"] == pytest.approx(here["pitch"]))
    tab.wait_until(follows)


@pytest.mark.slow
def test_a_stopped_server_is_said(open_page, slanted):
    tab = open_page(slanted, size=(1000, 800))
    tab.server.close()
    press(tab, "s")
    tab.wait_for("!document.querySelector('[role=alert]').hidden")
    assert "does not answer" in tab.page.inner_text("[role=alert]")


@pytest.mark.slow
def test_a_file_that_cannot_be_written_is_said(open_page, slanted, tmp_path):
    tab = open_page(slanted, size=(1000, 800))
    (tmp_path / "mine.toml").mkdir()
    press(tab, "s")
    tab.wait_for("!document.querySelector('[role=alert]').hidden")
    assert "mine.toml" in tab.page.inner_text("[role=alert]")


@pytest.mark.slow
def test_a_lost_drawing_comes_back(open_page, slanted):
    tab = open_page(slanted)
    before = drawn(tab)
    tab.evaluate(
        """async () => {
          const canvas = document.getElementById("pattern");
          const lose = canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
          const restored = new Promise((go) => canvas.addEventListener("webglcontextrestored", go));
          lose.loseContext();
          await new Promise((go) => setTimeout(go, 50));
          lose.restoreContext();
          await restored;
        }"""
    )
    np.testing.assert_array_equal(drawn(tab), before)


@pytest.mark.slow
def test_all_controls_are_reached_by_keyboard_and_fit_a_narrow_window(open_page, slanted):
    tab = open_page(slanted, size=(360, 700))
    names = set()
    for _ in range(40):
        tab.page.keyboard.press("Tab")
        names.add(tab.evaluate("document.activeElement.id || document.activeElement.dataset.pattern || ''"))
    wanted = {"hide", "pitch", "pitch-turn", "slope", "center", "fineness", "views", "order", "full", "window", "save"}
    assert wanted <= names
    assert tab.evaluate("document.getElementById('controls').scrollWidth <= innerWidth")


@pytest.mark.slow
def test_whole_lenses_are_taken_off_in_double_precision(open_page, slanted):
    tab = open_page(slanted)
    code = """async () => {
      const { phaseTables } = await import("/assets/phases.js");
      const panel = { width: 7680, height: 1 };
      const { columns } = phaseTables(panel, [{ right: 1 / 7, up: 0, constant: 0 }]);
      return columns[7000 * 1];
    }"""
    assert tab.evaluate(code) == pytest.approx(math.modf(7000.5 / 7)[0], abs=1e-6)
