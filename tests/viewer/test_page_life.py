"""The page in people's hands: pointer, touch, tilt, wheel and keys; themes and phones; what goes wrong is said."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from pages import DISPLAYS, VIEWER, noise, opened, page_of, put_eye, seen, shown

from lippmann.image.write import write_picture


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A page of a picture with a layer."""
    status = np.random.default_rng(5).integers(0, 3, (80, 96)).astype(np.float32)
    image = noise(DISPLAYS["square"], maps={"status": status})
    return page_of(tmp_path_factory.mktemp("page") / "page.html", image)


@pytest.fixture(scope="module")
def page_of_two(tmp_path_factory):
    return page_of(tmp_path_factory.mktemp("page") / "two.html", noise(DISPLAYS["square"]), noise(DISPLAYS["slanted"]))


def state(tab, name):
    return tab.evaluate(f"{VIEWER}.view.{name}")


def settle(tab):
    """Waits until the eye has glided to its goal."""
    tab.wait_for(f"{VIEWER}.goal === null && {VIEWER}.requested === 0")


def middle(tab):
    return tab.evaluate(
        "(() => { const b = document.querySelector('canvas').getBoundingClientRect();"
        " return [b.left + b.width / 2, b.top + b.height / 2, b.width / 2, b.height / 2]; })()"
    )


def words(tab, selector):
    return tab.page.locator(selector).inner_text()


# ---- Pointer, touch, tilt, wheel -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_pointer_leads_the_eye_and_nothing_moves_by_itself(open_tab, page):
    tab = opened(open_tab, page)
    before = state(tab, "eye")
    tab.page.wait_for_timeout(300)
    assert state(tab, "eye") == before
    assert tab.evaluate(f"{VIEWER}.requested") == 0
    x, y, right, up = middle(tab)
    tab.page.mouse.move(x + 0.5 * right, y - 0.5 * up)
    settle(tab)
    eye = state(tab, "eye")
    reach = 1.3 * 0.5 * eye["z"] * 0.8 / 2.5
    assert eye["x"] == pytest.approx(0.5 * reach, rel=0.02)
    assert eye["y"] == pytest.approx(0.5 * reach, rel=0.02)
    tab.assert_clean()


@pytest.mark.long
def test_drag_moves_the_eye_from_where_it_is_and_wheel_moves_it_away(open_tab, page):
    tab = opened(open_tab, page)
    x, y, right, _ = middle(tab)
    put_eye(tab, (5.0, 0.0, 100.0))
    tab.page.mouse.move(x - 5000, y)
    tab.evaluate(f"{VIEWER}.setEye(5, 0, 100)")
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    settle(tab)
    before = state(tab, "eye")
    tab.page.mouse.move(x + 0.25 * right, y, steps=4)
    tab.page.mouse.up()
    settle(tab)
    dragged = state(tab, "eye")
    assert dragged["x"] - before["x"] == pytest.approx(0.25 * 1.3 * 0.5 * before["z"] * 0.8 / 2.5, rel=0.05)
    tab.page.mouse.wheel(0, 400)
    settle(tab)
    assert state(tab, "eye")["z"] == pytest.approx(before["z"] * np.exp(0.48), rel=0.02)


@pytest.mark.slow
def test_touch_drags_the_eye_and_two_fingers_zoom(open_tab, page):
    tab = opened(open_tab, page, size=(390, 800), has_touch=True, is_mobile=True)
    x, y, right, _ = middle(tab)
    fingers = tab.page.context.new_cdp_session(tab.page)

    def touch(kind, *points):
        at = [{"x": px, "y": py, "id": number} for number, (px, py) in enumerate(points)]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})

    touch("touchStart", (x, y))
    touch("touchMove", (x + 0.2 * right, y))
    touch("touchMove", (x + 0.4 * right, y))
    touch("touchEnd")
    settle(tab)
    assert state(tab, "eye")["x"] > 1
    touch("touchStart", (x - 20, y), (x + 20, y))
    touch("touchMove", (x - 30, y), (x + 30, y))
    touch("touchMove", (x - 40, y), (x + 40, y))
    touch("touchEnd")
    assert state(tab, "frame")["width"] < 0.7
    tab.assert_clean()


@pytest.mark.slow
def test_tilt_moves_the_eye(open_tab, page):
    tab = opened(open_tab, page, size=(390, 800), has_touch=True, is_mobile=True)
    device = tab.page.context.new_cdp_session(tab.page)

    def tilt(beta, gamma):
        device.send("DeviceOrientation.setDeviceOrientationOverride", {"alpha": 0, "beta": beta, "gamma": gamma})

    tab.page.get_by_role("button", name="Tilt").click()
    tab.wait_for(f"Boolean({VIEWER}.endTilt)")
    tab.evaluate("addEventListener('deviceorientation', (event) => { window.turned = event.gamma; })")
    tilt(40, 0)
    tab.wait_for("window.turned === 0")
    # The right edge turned away from the face: the eye is further to the left of the display.
    tilt(40, 12)
    tab.wait_for(f"{VIEWER}.view.eye.x < -3")
    tab.page.get_by_role("button", name="Tilt").click()
    tab.wait_for(f"!{VIEWER}.endTilt")


# ---- Keys ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_everything_can_be_done_with_keys(open_tab, page):
    tab = opened(open_tab, page)
    tab.page.focus("canvas")

    def press(key):
        tab.page.keyboard.press(key)
        settle(tab)

    for key, axis, sign in (("ArrowRight", "x", 1), ("ArrowDown", "y", -1), ("PageUp", "z", -1)):
        before = state(tab, "eye")[axis]
        press(key)
        assert sign * (state(tab, "eye")[axis] - before) > 0, key
    press("Home")
    assert state(tab, "eye")["x"] == 0
    press("3")
    assert state(tab, "mode") == "anaglyph"
    press("1")
    press("f")
    press(">")
    assert state(tab, "plane") > 0
    press("f")
    assert state(tab, "plane") is None
    press("m")
    press("Shift+ArrowLeft")
    assert state(tab, "glass")["x"] < 0
    press("o")
    assert state(tab, "overlay")["name"] == "status"
    press("+")
    assert state(tab, "frame")["width"] == pytest.approx(0.8)
    press("0")
    assert state(tab, "frame")["width"] == 1
    tab.page.keyboard.press("Space")
    assert state(tab, "isPlaying")
    tab.wait_for(f"Math.abs({VIEWER}.view.eye.x) > 1")
    press("Space")
    assert not state(tab, "isPlaying")
    tab.assert_clean()


@pytest.mark.slow
def test_tab_reaches_every_control(open_tab, page_of_two):
    tab = opened(open_tab, page_of_two, size=(1200, 1600))
    reached = set()
    for _ in range(40):
        tab.page.keyboard.press("Tab")
        reached.add(
            tab.evaluate(
                "(e => e.getAttribute('aria-label') ?? e.closest('label')?.innerText ?? e.innerText)"
                "(document.activeElement)"
            )
        )
    text = "\n".join(reached)
    for name in (
        "arrow keys",
        "Divider",
        "Sway",
        "Sideways",
        "Distance",
        "One eye",
        "Refocus",
        "Magnifier",
        "Zoom",
        "Colours",
    ):
        assert name in text, name


@pytest.mark.slow
def test_divider_is_moved_by_pointer_and_keys(open_tab, page_of_two):
    tab = opened(open_tab, page_of_two)
    x, y, right, _ = middle(tab)
    handle = tab.page.get_by_role("slider", name="Divider")
    handle.hover()
    tab.page.mouse.down()
    tab.page.mouse.move(x + 0.5 * right, y)
    tab.page.mouse.up()
    assert state(tab, "divider") == pytest.approx(0.75, abs=0.02)
    settle(tab)
    handle.press("Home")
    assert state(tab, "divider") == 0
    assert state(tab, "eye")["x"] == 0


# ---- Magnifier -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_magnifier_shows_raw_pixels_and_frames_the_one_seen(open_tab, page):
    tab = opened(open_tab, page, size=(900, 600))
    put_eye(tab, (3.0, 4.0, 120.0))
    plain = shown(tab)
    tab.evaluate(f"{VIEWER}.set({{ glass: {{ x: 0, y: 0 }}, glassScale: 26 }})")
    glass = shown(tab)
    height, width = plain.shape[:2]
    display = DISPLAYS["square"]
    raw = np.round(noise(display).pixels * 255)
    row, column = height // 2, width // 2
    assert np.array_equal(plain[5, 5], glass[5, 5])
    # Pixel centres of the panel lie half a pixel beside its middle; inside a pixel the colour is plain, dimmed or not.
    framed = 0
    for right in range(-4, 4):
        for below in range(-4, 4):
            got = glass[row + 26 * below + 13, column + 26 * right + 13].astype(float)
            code = raw[40 + below, 48 + right]
            is_seen = np.abs(got - code).max() <= 1
            assert is_seen or np.abs(got - 0.72 * code).max() <= 1
            framed += is_seen
            i, j = display.lens_of(*display.panel_point(48 + right + 0.5, 40 + below + 0.5))
            seen_x, seen_y = display.visible_panel_point(3.0, 4.0, 120.0, *display.lattice.center(i, j, 0.0, 0.0, None))
            u, v = display.pixel_coordinates(seen_x, seen_y)
            assert is_seen == (np.floor(u) == 48 + right and np.floor(v) == 40 + below)
    assert framed >= 1


# ---- Looks ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True])
def test_page_follows_the_system_until_told_otherwise(open_tab, page, dark):
    tab = opened(open_tab, page, dark=dark)

    def brightness():
        color = tab.evaluate("getComputedStyle(document.querySelector('aside')).backgroundColor")
        return sum(int(number) for number in re.findall(r"\d+", color)[:3]) / 3

    assert (brightness() < 100) == dark
    button = tab.page.locator("header button.quiet").last
    button.click()
    assert brightness() > 200
    button.click()
    assert brightness() < 100


@pytest.mark.slow
def test_page_fits_a_phone(open_tab, page_of_two):
    tab = opened(open_tab, page_of_two, size=(360, 740), has_touch=True, is_mobile=True, device_scale_factor=3)
    assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")
    box = tab.evaluate("document.querySelector('canvas').getBoundingClientRect().toJSON()")
    assert box["width"] > 300
    assert box["right"] <= 360
    # Fingers need room.
    heights = tab.evaluate("[...document.querySelectorAll('aside button')].map((b) => b.offsetHeight)")
    assert min(height for height in heights if height > 0) >= 40
    tab.assert_clean()


# ---- What goes wrong -----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_lost_context_recovers(open_tab, page):
    image = noise(DISPLAYS["square"])
    tab = opened(open_tab, page)
    put_eye(tab, (9.0, 3.0, 140.0))
    tab.evaluate(f"{VIEWER}.setOverlay('status')")
    tab.evaluate(f"window.lost = {VIEWER}.stage.gl.getExtension('WEBGL_lose_context'); lost.loseContext()")
    tab.wait_for("document.querySelector('.message').innerText.includes('waiting')")
    put_eye(tab, (5.0, 3.0, 140.0))
    tab.evaluate("lost.restoreContext()")
    tab.wait_for("document.querySelector('.message').hidden")
    tab.evaluate(f"{VIEWER}.setOverlay(null)")
    codes = shown(tab)
    assert np.array_equal(codes, seen(image, (5.0, 3.0, 140.0), codes.shape[1::-1]))
    assert tab.faults == []


def changed(page, tmp_path, change):
    """The page with other data."""
    text = page.read_text(encoding="utf-8")
    found = re.search(r'(id="lippmann-data">)(.*?)(</script>)', text, re.S)
    data = json.loads(found[2])
    change(data[0])
    path = tmp_path / "changed.html"
    path.write_text(text[: found.start(2)] + json.dumps(data) + text[found.end(2) :], encoding="utf-8")
    return path


def cut_tile(data):
    data["tiles"]["picture"]["0_0"] = data["tiles"]["picture"]["0_0"][:400]


def lose_tile(data):
    del data["tiles"]["picture"]["0_0"]


def grow_version(data):
    data["manifest"]["lippmann"] = 99


@pytest.mark.slow
def test_damage_is_said_on_the_page(open_tab, page, tmp_path):
    tab = open_tab(offline=True)
    for change, said in ((cut_tile, "damaged"), (lose_tile, "missing"), (grow_version, "another version")):
        tab.open(changed(page, tmp_path, change))
        tab.wait_for("!document.querySelector('.message').hidden")
        assert said in words(tab, ".message")
        tab.assert_clean()


@pytest.mark.slow
def test_browser_without_webgl_is_told(open_tab, page):
    tab = open_tab(offline=True)
    tab.page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    tab.open(page)
    tab.wait_for("!document.querySelector('.message').hidden")
    assert "WebGL 2" in words(tab, ".message")
    tab.assert_clean()


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["gone", "cut"])
def test_file_that_is_gone_or_cut_is_named_on_the_page(open_tab, tmp_path, damage):
    from lippmann.viewer.http_server import WebServer
    from lippmann.viewer.served_picture import PictureFile
    from lippmann.viewer.server import ViewerSite

    path = tmp_path / "teapot.png"
    write_picture(noise(DISPLAYS["square"]), path)
    server = WebServer(ViewerSite([PictureFile(path)]))
    try:
        if damage == "gone":
            path.unlink()
        else:
            path.write_bytes(path.read_bytes()[:900])
        tab = open_tab().open(server.address)
        tab.wait_for("!document.querySelector('.message').hidden")
        assert "teapot.png" in words(tab, ".message")
    finally:
        server.close()
