"""The window for the display itself: native pixels reach the screen one to one, or it complains."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from lippmann.calibration.panel_photograph import draw_photograph_pattern
from lippmann.color.transfer import quantize
from lippmann.display import Display, LensArray, Panel
from lippmann.image import IntegralImage
from lippmann.studio_app.panel_site import PanelSite
from lippmann.viewer.http_server import WebServer
from lippmann.viewer.responses import RefusedError, Request
from lippmann.viewer.served_picture import PictureFile

SIZE = (1338, 642)  # two tiles across
DISPLAY = Display("wall", Panel(*SIZE, 0.1), LensArray("lenticular", 0.8), gap=2.5, viewing_distance=500.0)
MAPPING = "document.body.dataset.mapping"
COMPLAINT = "(a => a.hidden ? '' : a.textContent)(document.querySelector('[role=alert]'))"


@pytest.fixture(scope="module")
def picture(tmp_path_factory):
    """A picture of noise: a pixel beside the right one is seen as wrong."""
    path = tmp_path_factory.mktemp("panel") / "picture.png"
    values = np.random.default_rng(3).random((SIZE[1], SIZE[0], 3), np.float32)
    IntegralImage(values, DISPLAY).save(path)
    return path


@pytest.fixture(scope="module")
def address(picture):
    with WebServer(PanelSite(PictureFile(picture))) as server:
        yield server.address


def screen(tab, tmp_path):
    with Image.open(tab.screenshot(tmp_path / "screen.png")) as shot:
        return np.asarray(shot.convert("RGB"))


def opened(open_tab, address, **options):
    tab = open_tab(**{"size": SIZE, **options}).open(address)
    tab.wait_for("Number(document.body.dataset.drawn) > 0")
    return tab


@pytest.mark.slow
def test_every_pixel_of_the_picture_is_a_pixel_of_the_screen(open_tab, address, picture, tmp_path):
    tab = opened(open_tab, address)
    tab.wait_for(f"{MAPPING} === 'exact'")
    tab.page.keyboard.press("h")
    with Image.open(picture) as file:
        np.testing.assert_array_equal(screen(tab, tmp_path), np.asarray(file.convert("RGB")))
    tab.assert_clean()


@pytest.mark.slow
def test_pictures_through_a_wire_are_the_same(open_tab, picture, tmp_path):
    with WebServer(PanelSite(PictureFile(picture, tile_format="png"))) as server:
        tab = opened(open_tab, server.address)
        tab.page.keyboard.press("h")
        with Image.open(picture) as file:
            np.testing.assert_array_equal(screen(tab, tmp_path), np.asarray(file.convert("RGB")))


def pattern():
    height, width = SIZE[1], SIZE[0]
    y, x = np.mgrid[:height, :width]
    found = np.where(((x + y) % 2 == 0)[..., None], 255, 0) * np.ones(3, int)
    found[(x % 100 == 0) | (y % 100 == 0)] = (0, 255, 0)
    found[:, -1], found[-1] = (0, 0, 255), (255, 0, 0)
    found[:, 0], found[0] = (255, 255, 255), (255, 255, 255)
    return found


@pytest.mark.slow
def test_the_pattern_reaches_the_screen_pixel_by_pixel(open_tab, address, tmp_path):
    tab = opened(open_tab, address)
    tab.page.keyboard.press("p")
    tab.wait_for("Number(document.body.dataset.drawn) > 1")
    tab.page.keyboard.press("h")
    np.testing.assert_array_equal(screen(tab, tmp_path), pattern())
    tab.page.keyboard.press("h")
    assert tab.page.get_by_role("button", name="Test pattern").is_visible()
    tab.assert_clean()


@pytest.mark.slow
def test_a_photograph_of_the_pattern_is_answered(open_tab, address, tmp_path):
    """The photograph is the screen's own: without lenses no view is seen alone."""
    tab = opened(open_tab, address)
    check = tab.page.get_by_role("button", name="Check by photograph")
    # The pattern of a large panel takes seconds.
    held = []
    tab.page.route("**/check.png", lambda route: held.append(route))
    check.click()
    tab.wait_for("document.querySelector('.state').textContent.includes('is being drawn')")
    tab.wait_until(lambda: held)
    held[0].continue_()
    tab.wait_for("document.querySelector('.state').textContent.includes('500 mm away')")
    tab.page.keyboard.press("h")
    np.testing.assert_array_equal(screen(tab, tmp_path), draw_photograph_pattern(DISPLAY))
    tab.page.keyboard.press("h")
    tab.page.get_by_label("Photograph of the panel").set_input_files(tmp_path / "screen.png")
    tab.wait_for("document.querySelector('.state').textContent.includes('the pixels without lenses')")
    tab.page.get_by_label("Photograph of the panel").set_input_files(
        {"name": "a.jpg", "mimeType": "image/jpeg", "buffer": b"no picture"}
    )
    tab.wait_for("document.querySelector('.state').textContent.startsWith('The photograph cannot be read')")
    check.click()
    assert tab.page.get_by_label("Photograph of the panel").is_hidden()
    tab.assert_clean()


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [pytest.param(2, marks=pytest.mark.long), 1.5])
def test_a_dense_screen_of_the_right_size_is_exact(open_tab, address, picture, tmp_path, ratio):
    """Where the system scales, the window divides by the ratio that the browser tells."""
    size = tuple(int(np.ceil(side / ratio)) for side in SIZE)
    tab = opened(open_tab, address, size=size, device_scale_factor=ratio)
    tab.page.keyboard.press("h")
    tab.evaluate("document.querySelector('.bar').style.visibility = 'hidden'")
    with Image.open(picture) as file:
        width, height = SIZE
        np.testing.assert_array_equal(screen(tab, tmp_path)[:height, :width], np.asarray(file.convert("RGB")))


@pytest.mark.slow
def test_another_screen_is_complained_of(open_tab, address):
    tab = opened(open_tab, address, size=(1000, 600))
    assert "This screen has 1000 x 600 pixels, wall has 1338 x 642" in tab.wait_for(COMPLAINT)
    assert tab.evaluate(MAPPING) == "wrong"
    tab.page.keyboard.press("h")
    assert tab.page.get_by_role("alert").is_visible()


CHECK = """async (changed) => {
  const { complaint } = await import('studio/native_check.js');
  const panel = { width: 1338, height: 642, name: 'wall' };
  const screen = [1338, 642];
  const right = { panel, box: screen, ratio: 1, screen, zoom: 1, inside: screen, isFull: true, turn: 0 };
  return complaint({ ...right, ...changed });
}"""


CAUSES = [
    ({}, None),
    ({"box": None}, None),
    ({"isFull": False, "inside": [1338, 500]}, None),
    ({"box": [1339, 642]}, "The browser scales"),
    ({"zoom": 1.2}, "zoomed by fingers"),
    ({"ratio": 1.25}, "This screen has 1673 x 803 pixels"),
    ({"screen": [1920, 1080]}, "This screen has 1920 x 1080"),
    ({"inside": [1338, 600]}, "does not give the whole screen"),
    ({"turn": 90}, None),
    ({"turn": 180}, "upside down"),
    ({"screen": [642, 1338], "turn": 90}, "shows this screen turned, 642 x 1338 pixels for 1338 x 642"),
]


@pytest.mark.slow
def test_each_complaint_has_its_cause(open_tab, address):
    tab = opened(open_tab, address)
    for changed, words in CAUSES:
        found = tab.evaluate(CHECK, changed)
        assert found is None if words is None else words in found, (changed, found)


def test_only_the_window_and_its_picture_are_served(picture):
    site = PanelSite(PictureFile(picture))
    assert site.get(Request("/", {})).kind.startswith("text/html")
    for path in ("/panel", "/assets/viewer.js", "/picture.png", "/pictures/1/manifest.json", "/../x", str(picture)):
        with pytest.raises(RefusedError):
            site.get(Request(path, {}))
    with pytest.raises(RefusedError):
        site.post(Request("/", {}), b"{}")


@pytest.mark.slow
def test_the_studio_is_shown_live_on_the_panel(studio, open_tab, tmp_path):
    panel = studio.session.display(studio.session.state).panel
    tab = open_tab(size=(max(panel.width, 300), max(panel.height, 300))).open(f"{studio.address}panel?live")
    tab.wait_for("Number(document.body.dataset.drawn) > 0")
    tab.evaluate("document.querySelector('.bar').style.visibility = 'hidden'")
    expected = np.zeros((panel.height, panel.width, 3), np.uint8)
    expected[..., 0] = int(studio.session.state.turn[0])
    expected[..., 1] = 128
    expected[::2, ::2, 2] = 255
    tab.wait_for("parseInt(document.querySelector('.state').textContent) > 1")
    shown = screen(tab, tmp_path)[: panel.height, : panel.width]
    np.testing.assert_array_equal(shown, expected)


def test_quantized_values_are_what_the_file_holds(picture):
    values = np.random.default_rng(3).random((SIZE[1], SIZE[0], 3), np.float32)
    with Image.open(picture) as file:
        np.testing.assert_array_equal(np.asarray(file.convert("RGB")), quantize(values, 8, "srgb"))


#: Screens of a computer: a laptop's, one that is scaled, and two panels alike.
SCREENS = [
    {"left": 0, "top": 0, "width": 1920, "height": 1080, "devicePixelRatio": 1, "label": "Laptop"},
    {"left": 1920, "top": 0, "width": 892, "height": 428, "devicePixelRatio": 1.5, "label": "LKG"},
    {"left": 2812, "top": 0, "width": 1536, "height": 2048, "devicePixelRatio": 1, "label": ""},
    {"left": 4348, "top": 0, "width": 1536, "height": 2048, "devicePixelRatio": 1, "label": "Second"},
]
PLACES = [
    ({"width": 1338, "height": 642}, 1, "Found on the screen LKG."),
    (
        {"width": 1536, "height": 2048},
        None,
        "No single screen has 1536 x 2048 pixels (they have 1920 x 1080, ",
    ),
    ({"width": 1536, "height": 2048, "corner": [2812, 0]}, 2, "Found on the screen at 2812, 0."),
    ({"width": 1920, "height": 1080, "corner": [5, 5]}, 0, "Found on the screen Laptop."),
    ({"width": 1440, "height": 2560}, None, "put this window on the display yourself"),
]
FIND = """async ([screens, panel]) => {
  const { screenOf, placeInWords } = await import('studio/screens.js');
  return [screens.indexOf(screenOf(screens, panel)), placeInWords(screens, panel)];
}"""
#: A browser that grants the Window Management API, as far as a page can tell.
GRANT = """(screens) => {
  Object.defineProperty(window.screen, 'isExtended', { value: true });
  window.getScreenDetails = async () => ({ screens });
  document.documentElement.requestFullscreen = async (asked) => { window.asked = asked; };
}"""


@pytest.mark.slow
def test_the_display_is_found_among_the_screens(open_tab, address):
    tab = opened(open_tab, address)
    for panel, number, words in PLACES:
        found, said = tab.evaluate(FIND, [SCREENS, panel])
        assert found == (-1 if number is None else number), panel
        assert words in said
    tab.evaluate(GRANT, SCREENS)
    tab.page.keyboard.press("f")
    assert tab.wait_for("window.asked?.screen?.label") == "LKG"
    tab.wait_for("document.querySelector('output').textContent === 'Found on the screen LKG.'")


@pytest.mark.slow
def test_full_screen_without_the_right_to_see_all_screens(open_tab, address):
    tab = opened(open_tab, address)
    tab.evaluate(GRANT, SCREENS)
    tab.evaluate("() => { window.getScreenDetails = () => Promise.reject(new Error('not granted')); }")
    tab.page.keyboard.press("f")
    assert tab.wait_for("JSON.stringify(window.asked)") == '{"navigationUI":"hide"}'


def test_the_page_is_told_where_bridge_has_the_panel(picture, fake_bridge):
    asked = Request("/panel.json", {})
    assert json.loads(PanelSite(PictureFile(picture)).get(asked).body)["corner"] is None
    fake_bridge.connect("LKG-E00002", (1920, 7), SIZE)
    assert json.loads(PanelSite(PictureFile(picture)).get(asked).body)["corner"] == [1920, 7]
