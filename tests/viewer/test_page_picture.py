"""What the page shows at given eyes is what ``lippmann replay`` shows of the same picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lens_samples import eye_of_view
from pages import (
    BENT,
    CELLS,
    DISPLAYS,
    VIEWER,
    array,
    lenticular,
    noise,
    opened,
    page_of,
    psnr,
    put_eye,
    seen,
    shown,
)
from PIL import Image

from lippmann.color.transfer import decode_srgb, encode_srgb, quantize
from lippmann.display import NUMPY
from lippmann.display.visible_pixels import mean_of_points
from lippmann.image import IntegralImage
from lippmann.viewing.refocus import refocus
from lippmann.viewing.replay import default_eye

#: In the middle, aside within the field, far beyond it and high.
EYES = ((0.0, 0.0, 300.0), (17.3, -9.0, 260.0), (-171.0, 60.0, 410.0))

SUBPIXELS = {
    "stripe": lenticular(pixels=6.2, slant=9.46, distance=300.0),
    "stripe, upright": lenticular(pixels=8.0),
    "triangle": lenticular(
        pixels=6.2, slant=-11.0, distance=300.0, subpixel_offsets=((-0.25, 0.2), (0.25, 0.2), (0.0, -0.3))
    ),
    "cells": lenticular(pixels=6.2, slant=9.46, distance=300.0, subpixel_cells=CELLS),
    "cells, rows": lenticular(pixels=6.2, slant=9.46, distance=300.0, subpixel_cells=((CELLS[0][0],), (CELLS[0][1],))),
}


#: Makes each drawing take long, and notes which are coarse.
BUSY_DRAWING = f"""() => {{
  const stage = {VIEWER}.stage, draw = stage.draw.bind(stage);
  window.coarse = [];
  stage.draw = (pictures, view) => {{
    window.coarse.push(view.isCoarse);
    const until = performance.now() + 60;
    while (performance.now() < until);
    return draw(pictures, view);
  }};
}}"""


def assert_shows_replay(tab, image, eyes=EYES):
    for eye in (default_eye(image.display), *eyes):
        put_eye(tab, eye)
        codes = shown(tab)
        expected = seen(image, eye, codes.shape[1::-1])
        assert psnr(codes, expected) >= 40, eye
        # The pictures are noise: one pixel in a thousand beside its place would cost them half of the 40 dB.
        assert np.mean(np.any(codes != expected, axis=2)) < 1e-4, eye


def seen_part(image, eye, frame, shape):
    """What an eye sees through a part of the panel's rectangle, as codes to the half; nearest pixels, no sub-pixels."""
    display, panel = image.display, image.display.panel
    across = 2 if shape[1] < frame["width"] * panel.width else 1
    height, width = (across * side for side in shape[:2])
    u = (frame["x"] + (np.arange(width) + 0.5) / width * frame["width"]) * panel.width
    v = (frame["y"] + (np.arange(height) + 0.5) / height * frame["height"]) * panel.height
    x, y = display.panel_point(*np.meshgrid(u, v))
    u, v = display.pixel_coordinates(*display.visible_panel_point(*eye, x, y, NUMPY))
    column, row = np.floor(u + 1e-6).astype(int), np.floor(v + 1e-6).astype(int)
    inside = (column >= 0) & (column < panel.width) & (row >= 0) & (row < panel.height)
    values = image.pixels[row.clip(0, panel.height - 1), column.clip(0, panel.width - 1)]
    return 255 * mean_of_points(values * inside[..., None], across)


@pytest.mark.long_cases(but=["hexagonal"])
@pytest.mark.slow
@pytest.mark.parametrize("name", DISPLAYS)
def test_page_shows_what_replay_shows(open_tab, tmp_path, name):
    image = noise(DISPLAYS[name])
    tab = opened(open_tab, page_of(tmp_path / "page.html", image))
    assert_shows_replay(tab, image)
    tab.assert_clean()


@pytest.mark.long_cases(but=["slanted", "hexagonal"])
@pytest.mark.slow
@pytest.mark.parametrize("name", ["lenticular", "slanted", "square", "hexagonal"])
def test_true_directions_are_seen_as_replay_shows_them(open_tab, tmp_path, name):
    image = noise(replace(DISPLAYS[name], distortion=BENT))
    tab = opened(open_tab, page_of(tmp_path / "page.html", image))
    assert_shows_replay(tab, image)
    eyes = [list(eye_of_view(image.display, 0, k)[:2]) for k in (0, 3)]
    told = tab.evaluate(f'async () => (await import("lippmann/optics.js")).eyesOfViews({VIEWER}.optics)')
    assert [[told[k]["x"], told[k]["y"]] for k in (0, 3)] == [pytest.approx(eye, rel=1e-9, abs=1e-6) for eye in eyes]
    tab.assert_clean()


@pytest.mark.long_cases(but=["stripe, upright"])
@pytest.mark.slow
@pytest.mark.parametrize("name", SUBPIXELS)
def test_subpixels_are_seen_at_their_own_places(open_tab, tmp_path, name):
    image = noise(SUBPIXELS[name], subpixels=True)
    tab = opened(open_tab, page_of(tmp_path / "page.html", image))
    assert_shows_replay(tab, image)


def test_subpixels_matter():
    plain, own = (noise(SUBPIXELS["cells"], subpixels=subpixels) for subpixels in (False, True))
    assert psnr(seen(plain, EYES[0], (300, 200)), seen(own, EYES[0], (300, 200))) < 15


@pytest.mark.long
def test_wide_panel_is_shown_as_exactly_as_a_small_one(open_tab, tmp_path):
    # Wider than a texture may be, so in tiles; with single precision alone one pixel in a thousand would be another.
    image = noise(lenticular(8200, 96, pixels=9.37, slant=7.0, distance=900.0))
    tab = opened(open_tab, page_of(tmp_path / "page.html", image), size=(1400, 420))
    assert tab.evaluate(f"{VIEWER}.pictures[0].tiles.isTiled")
    tab.evaluate(f"{VIEWER}.zoomBy(6, 1, -1)")
    frame = tab.evaluate(f"{VIEWER}.view.frame")
    for eye in ((31.0, 4.0, 700.0), (-140.0, 9.0, 500.0)):
        put_eye(tab, eye)
        assert np.mean(np.abs(shown(tab) - seen_part(image, eye, frame, shown(tab).shape)) > 0.51) < 1e-4


@pytest.mark.long
def test_picture_beyond_the_memory_is_shown_in_parts(open_tab, tmp_path):
    display = lenticular(2100, 1100, pixels=10.0)
    image = noise(display)
    page = page_of(tmp_path / "page.html", image)
    tab = open_tab(size=(760, 420), offline=True).open(f"{page.resolve().as_uri()}?memory=17")
    tab.evaluate(f"{VIEWER}.ready")
    for pan in ((0, 0), (8, -8)):
        tab.evaluate(f"(pan) => {VIEWER}.panBy(...pan)", list(pan))
        tab.wait_for(f"{VIEWER}.pictures[0].tiles.coming.size === 0")
        put_eye(tab, (20.0, 5.0, 300.0))
        frame = tab.evaluate(f"{VIEWER}.view.frame")
        assert 0.1 < frame["width"] < 0.6
        codes = shown(tab)
        expected = seen_part(image, (20.0, 5.0, 300.0), frame, codes.shape)
        assert np.mean(np.abs(codes - expected) > 0.51) < 1e-4, pan
    tab.assert_clean()


@pytest.mark.slow
def test_codes_of_light_follow_the_transfer(open_tab, tmp_path):
    values = np.random.default_rng(4).uniform(0, 1.2, (64, 96, 3)).astype(np.float32)
    image = IntegralImage(values, DISPLAYS["lenticular"])
    tab = opened(open_tab, page_of(tmp_path / "page.html", image))
    assert_shows_replay(tab, image, EYES[:1])


@pytest.mark.slow
def test_page_smaller_than_the_panel_shows_means_of_points_but_single_ones_in_slow_motion(open_tab, tmp_path):
    values = np.random.default_rng(4).uniform(0, 1, (64, 96, 3)).astype(np.float32)
    image = IntegralImage(decode_srgb(quantize(values, 8, "srgb") / 255).astype(np.float32), DISPLAYS["slanted"])
    tab = opened(open_tab, page_of(tmp_path / "page.html", image))
    tab.page.set_viewport_size({"width": 100, "height": 200})
    tab.wait_for(f"{VIEWER}.stage.canvas.width < 96")
    put_eye(tab, EYES[0])
    codes = shown(tab)
    assert psnr(codes, quantize(image.replay(EYES[0], size=codes.shape[1::-1]), 8, "srgb")) > 55
    assert psnr(codes, seen(image, EYES[0], codes.shape[1::-1])) < 30
    tab.evaluate(BUSY_DRAWING)
    tab.evaluate(f"{VIEWER}.setPlaying(true)")
    tab.wait_for("window.coarse.at(-1)")
    tab.evaluate(f"{VIEWER}.pause()")
    tab.wait_for("!window.coarse.at(-1)")
    put_eye(tab, EYES[0])
    assert np.array_equal(shown(tab), codes)


@pytest.mark.slow
def test_the_window_shows_the_canvas(open_tab, tmp_path):
    tab = opened(open_tab, page_of(tmp_path / "page.html", noise(DISPLAYS["slanted"])))
    put_eye(tab, EYES[1])
    codes = shown(tab)
    tab.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    box = tab.evaluate(
        "(() => { const b = document.querySelector('canvas').getBoundingClientRect(); return [b.left, b.top]; })()"
    )
    with Image.open(tab.screenshot(tmp_path / "shot.png")) as picture:
        window = np.asarray(picture.convert("RGB"))
    left, top = (round(value) for value in box)
    height, width = codes.shape[:2]
    # The canvas may begin between pixels of the window: its inside must be there at one whole place.
    places = [(x, y) for x in (left - 1, left, left + 1) for y in (top - 1, top, top + 1)]
    parts = [window[y + 2 : y + height - 2, x + 2 : x + width - 2] for x, y in places]
    assert any(np.array_equal(part, codes[2:-2, 2:-2]) for part in parts)


@pytest.mark.slow
def test_zoom_shows_a_part_of_what_replay_shows(open_tab, tmp_path):
    image = noise(DISPLAYS["slanted"])
    tab = opened(open_tab, page_of(tmp_path / "page.html", image))
    put_eye(tab, EYES[1])
    tab.evaluate(f"{VIEWER}.zoomBy(2, -1, 1)")
    codes = shown(tab)
    height, width = codes.shape[:2]
    expected = seen(image, EYES[1], (2 * width, 2 * height))[:height, :width]
    assert np.mean(np.any(codes != expected, axis=2)) < 1e-4


@pytest.mark.slow
def test_side_by_side_shows_each_eye_its_own_picture(open_tab, tmp_path):
    image = noise(DISPLAYS["slanted"])
    tab = opened(open_tab, page_of(tmp_path / "page.html", image))
    put_eye(tab, EYES[1])
    tab.evaluate(f"{VIEWER}.setMode('side-by-side')")
    x, y, z = EYES[1]
    for crossed, order in ((False, (-31.5, 31.5)), (True, (31.5, -31.5))):
        tab.evaluate(f"(isCrossed) => {VIEWER}.set({{ isCrossed }})", crossed)
        codes = shown(tab)
        half = (codes.shape[1] - 2) // 2
        for part, aside in zip((codes[:, :half], codes[:, -half:]), order, strict=True):
            assert np.mean(np.any(part != seen(image, (x + aside, y, z), (half, codes.shape[0])), axis=2)) < 1e-4


@pytest.mark.slow
def test_anaglyph_gives_red_to_the_left_eye(open_tab, tmp_path):
    image = noise(DISPLAYS["square"])
    tab = opened(open_tab, page_of(tmp_path / "page.html", image))
    put_eye(tab, EYES[0])
    tab.evaluate(f"{VIEWER}.setMode('anaglyph')")
    codes = shown(tab)
    left, right = (seen(image, (aside, 0.0, 300.0), codes.shape[1::-1]) for aside in (-31.5, 31.5))
    assert np.array_equal(codes[..., 0], left[..., 0])
    assert np.array_equal(codes[..., 1:], right[..., 1:])


#: Displays whose views are exact, so that the page and ``refocus`` mean the same views.
EXACT_VIEWS = {
    "lenticular": DISPLAYS["lenticular"],
    "square": DISPLAYS["square"],
    "hexagonal": array("hexagonal", row_pitch=0.7),
}


@pytest.mark.long_cases(but=["lenticular"])
@pytest.mark.slow
@pytest.mark.parametrize("name", EXACT_VIEWS)
def test_focus_on_a_plane_is_that_of_refocus(open_tab, tmp_path, name):
    display = EXACT_VIEWS[name]
    image = IntegralImage(noise(display).pixels, display)  # sRGB: the mean is one of light, not of codes
    assert image.views_are_exact
    tab = opened(open_tab, page_of(tmp_path / "page.html", image), size=(780, 260))
    for plane in (0.0, 11.0, -14.0):
        tab.evaluate(f"{VIEWER}.setPlane({plane})")
        codes = shown(tab)
        focused = refocus(image, plane, size=codes.shape[1::-1])
        expected = 255 * encode_srgb(focused)
        assert psnr(codes, expected) >= 40, plane


@pytest.mark.slow
def test_divider_shows_the_second_picture_on_its_right(open_tab, tmp_path):
    first, second = noise(DISPLAYS["square"], seed=1), noise(DISPLAYS["hexagonal"], seed=2)
    tab = opened(open_tab, page_of(tmp_path / "page.html", first, second))
    put_eye(tab, EYES[1])
    tab.evaluate(f"{VIEWER}.set({{ divider: 0.25 }})")
    codes = shown(tab)
    size = codes.shape[1::-1]
    seam = round(0.25 * size[0])
    assert np.array_equal(codes[:, :seam], seen(first, EYES[1], size)[:, :seam])
    assert np.mean(np.any(codes[:, seam:] != seen(second, EYES[1], size)[:, seam:], axis=2)) < 1e-4


@pytest.mark.slow
def test_layer_lies_over_the_picture_through_the_lenses(open_tab, tmp_path):
    display = DISPLAYS["slanted"]
    status = np.random.default_rng(5).integers(0, 3, (64, 96)).astype(np.float32)
    image = noise(display, maps={"status": status})
    tab = opened(open_tab, page_of(tmp_path / "page.html", image))
    put_eye(tab, EYES[1])
    tab.evaluate(f"{VIEWER}.setOverlay('status')")
    tab.evaluate(f"{VIEWER}.setOverlayShare(1)")
    from lippmann.viewing.diagnostic_maps import missed_codes

    layer = missed_codes(image)
    assert layer is not None
    colored = image.with_pixels(layer / np.float32(255))
    codes = shown(tab)
    assert np.mean(np.any(codes != seen(colored, EYES[1], codes.shape[1::-1]), axis=2)) < 1e-4
