"""Photographs of the pattern that tells whether native pixels reach the lenses: simulated by replay, then spoiled."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy import ndimage

from lippmann import Display, LensArray, Panel, load_display
from lippmann.calibration.panel_photograph import check_photograph, draw_photograph_pattern
from lippmann.color.transfer import decode_srgb, quantize
from lippmann.errors import PictureError, UsageError
from lippmann.image import IntegralImage
from lippmann.viewing.replay import default_eye, replay

DISPLAY = Display(
    "slanted",
    Panel(768, 576, 0.1, ((-1 / 3, 0), (0, 0), (1 / 3, 0))),
    LensArray("lenticular", 0.52, slant=10.0),
    gap=0.8,
    viewing_distance=400.0,
)
UPRIGHT = np.array([(60, 45), (740, 45), (740, 555), (60, 555)], float)
OBLIQUE = np.array([(120, 80), (700, 40), (735, 550), (90, 480)], float)


def seen_by(codes, eye=None, display=DISPLAY):
    """What an eye sees of a picture, as a lens draws it: ``(H, W, 3)`` linear, a pixel for each of the panel."""
    image = IntegralImage(decode_srgb(codes.astype(np.float32) / 255), display)
    seen = replay(image, eye, size=(display.panel.width, display.panel.height), subpixels=True)
    return ndimage.gaussian_filter(seen, (0.8, 0.8, 0))


def photograph(codes, *, eye=None, display=DISPLAY, **camera):
    """A photograph of a picture; ``camera`` as of :func:`photograph_of`."""
    return photograph_of(seen_by(codes, eye, display), **camera)


def photograph_of(seen, *, corners=UPRIGHT, blur=0.0, fall=0.0, noise=0.005, ambient=0.005):
    """A photograph of 800 x 600 pixels by a camera of a warm white balance."""
    height, width = seen.shape[:2]
    rows = []
    for (u, v), (x, y) in zip([(0, 0), (1, 0), (1, 1), (0, 1)], corners, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
    inverse = np.linalg.solve(rows, [0, 0, 1, 0, 1, 1, 0, 1])
    y, x = np.mgrid[:600, :800]
    u, v, w = np.moveaxis(np.stack([x, y, 1 + 0 * x], -1) @ np.append(inverse, 1).reshape(3, 3).T, -1, 0)
    u, v = u / w, v / w
    place = [v * height - 0.5, u * width - 0.5]
    light = np.stack([ndimage.map_coordinates(seen[..., c], place, order=1, cval=0.0) for c in range(3)], -1)
    light = light * (1.0, 0.9, 0.75) * (1 - fall * np.clip(1 - u, 0, 1))[..., None] + ambient
    if blur:
        light = ndimage.gaussian_filter(light, (blur, blur, 0))
    light = light + np.random.default_rng(5).normal(0, noise, light.shape)
    return quantize(np.clip(light, 0, 1).astype(np.float32), 8, "srgb").astype(np.uint8)


def moved(codes, *, right=1.0, down=1.0, degrees=0.0):
    """The picture as a system shows it that scales or turns it about its middle."""
    height, width = codes.shape[:2]
    y, x = np.mgrid[:height, :width].astype(float)
    y, x, angle = (y - height / 2 + 0.5) / down, (x - width / 2 + 0.5) / right, np.radians(degrees)
    x, y = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    place = [y + height / 2 - 0.5, x + width / 2 - 0.5]
    values = [ndimage.map_coordinates(codes[..., c].astype(float), place, order=1) for c in range(3)]
    return np.stack(values, -1).round().astype(np.uint8)


def scale_in(line):
    native, percent = re.search(r"scale ([\d.]+) within|scaled to ([\d.]+) %", line).groups()
    return float(native) if native else float(percent) / 100


@pytest.fixture(scope="module")
def codes():
    return draw_photograph_pattern(DISPLAY)


#: Cameras that are not ideal.
CAMERAS = {
    "straight": {},
    "in perspective": {"corners": OBLIQUE},
    "blurred": {"blur": 3.0},
    "in uneven light": {"fall": 0.6},
    "noisy": {"noise": 0.06},
    "in a room that is not dark": {"ambient": 0.15},
}


@pytest.fixture(scope="module", params=[1.0, 1.01])
def scaled(codes, request):
    """How much a system scales the pattern, and what is seen of that."""
    return request.param, seen_by(moved(codes, right=request.param, down=request.param))


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_a_change_of_size_is_measured_by_any_camera(scaled, camera):
    scale, seen = scaled
    line = check_photograph(photograph_of(seen, **camera), DISPLAY, 400.0)
    assert line.startswith("Native pixels reach") == (scale == 1.0)
    assert scale_in(line) == pytest.approx(scale, abs=0.0011)


@pytest.mark.parametrize("eye", [(0.0, 0.0, 320.0), (0.0, 0.0, 500.0), (15.0, 0.0, 400.0)])
def test_a_camera_near_its_place_sees_one_hue(codes, eye):
    line = check_photograph(photograph(codes, eye=eye), DISPLAY, 400.0)
    assert line.startswith("Native pixels reach")
    beside = float(line.split("view ")[1].split()[0])
    assert beside == pytest.approx(-eye[0] * DISPLAY.gap / 400 / 0.52 * np.cos(np.radians(10)), abs=0.05)


@pytest.mark.parametrize(
    ("turned", "how"),
    [
        (lambda codes: codes[:, ::-1], "mirrored"),
        (lambda codes: codes[::-1], "mirrored"),
        (lambda codes: codes[::-1, ::-1], "upside down"),
        (lambda codes: np.rot90(codes)[::4].repeat(3, 0)[:, ::3].repeat(4, 1), "turned by 90 degrees"),
        (lambda codes: moved(codes, degrees=0.7), "turned or stretched"),
    ],
)
def test_a_picture_that_does_not_lie_right_is_told(codes, turned, how):
    assert how in check_photograph(photograph(turned(codes)), DISPLAY, 400.0)


def test_pixels_that_no_lens_covers(codes):
    bare = Display("bare", DISPLAY.panel, LensArray("lenticular", 0.1), gap=0.001)
    line = check_photograph(photograph(codes, display=bare), DISPLAY, 400.0)
    assert line.endswith("the photograph shows the pixels without lenses.")


def test_a_picture_larger_than_the_panel_is_refused(codes):
    with pytest.raises(PictureError, match="scaled beyond the panel"):
        check_photograph(photograph(moved(codes, right=1.25, down=1.25)), DISPLAY, 400.0)


def test_pixels_that_are_mixed_have_no_hue(codes):
    gray = codes.copy()
    gray[46:-46, 46:-46] = ndimage.uniform_filter(codes[46:-46, 46:-46].astype(float), (1, 16, 0)).astype(np.uint8)
    assert "pixels are mixed" in check_photograph(photograph(gray), DISPLAY, 400.0)


@pytest.mark.parametrize(
    ("light", "line"),
    [
        (np.zeros((300, 400, 3), np.uint8), "black|no bright rectangle"),
        (np.random.default_rng(1).integers(0, 255, (300, 400, 3), np.uint8), "no bright rectangle|squares"),
        (np.pad(np.full((200, 300, 3), 200, np.uint8), ((50, 50), (50, 50), (0, 0))), "squares"),
        (np.full((3, 2, 3), 200, np.uint8), "no bright rectangle"),
    ],
)
def test_other_pictures_are_refused_in_one_line(light, line):
    with pytest.raises(PictureError, match=line):
        check_photograph(light, DISPLAY, 400.0)


@pytest.mark.parametrize("name", ["mla-square", "mla-hexagonal", "seed-lenticular"])
def test_round_and_parallel_lenses(name):
    display = load_display(name)
    distance = default_eye(display)[2]
    corners = UPRIGHT * (0.75, 1.0)
    line = check_photograph(
        photograph(draw_photograph_pattern(display), display=display, corners=corners), display, distance
    )
    assert line.startswith("Native pixels reach")
    assert scale_in(line) == pytest.approx(1.0, abs=0.003)


def test_views_that_follow_the_eye_have_no_pattern():
    with pytest.raises(UsageError, match="eye tracking"):
        draw_photograph_pattern(load_display("displayxr"))
