"""Quilts without their display's lenses: the right view for every eye, and planes that are drawn by hand in focus."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel
from lippmann.display.sheet_layout import with_margin
from lippmann.errors import PictureError, UsageError
from lippmann.quilts.quilt import Quilt, QuiltLayout
from lippmann.viewing.quilt_views import quilt_display, refocus_quilt, replay_quilt

COUNT, VIEW = 24, (120, 90)
DISTANCE, FIELD = 300.0, 40.0
PIXEL, LENS = 0.1, 0.6


def display(slant=0.0):
    # The field of view is that of the micro-images: m = p (D + g) / D, tan(F / 2) = m / (2 g).
    g = LENS / (2 * math.tan(math.radians(FIELD / 2)) - LENS / DISTANCE)
    lenses = LensArray("lenticular", LENS, slant=slant)
    return Display("d", Panel(480, 360, PIXEL), lenses, gap=g, viewing_distance=DISTANCE)


def camera(number, slant=0.0):
    """Eye of a view: level, even in the tangent; it passes the field of view across the lenses."""
    across = (2 * (number + 0.5) / COUNT - 1) * DISTANCE * math.tan(math.radians(FIELD / 2))
    return across / math.cos(math.radians(slant)), 0.0, DISTANCE


def drawn(z, slant=0.0):
    """A quilt of a plane at z with stripes 3 mm wide from corner to corner, as its cameras see it."""
    x, y = np.meshgrid(*(((np.arange(count) + 0.5) / count - 0.5) * count * 0.4 for count in VIEW))
    quilt = Quilt(np.empty((VIEW[1], VIEW[0] * COUNT, 3), dtype=np.float32), QuiltLayout(COUNT, 1, None))
    for number in range(COUNT):
        eye_x, _, eye_z = camera(number, slant)
        at = x + (eye_x - x) * z / eye_z  # where the line from the eye to the lens plane meets the plane
        quilt.view(number)[...] = stripes(at - y * (1 - z / eye_z))[..., None]
    return quilt


def stripes(x):
    return (0.5 + 0.5 * np.sin(np.pi * x / 3)).astype(np.float32)


def levels():
    quilt = Quilt(np.empty((VIEW[1], VIEW[0] * COUNT, 3), dtype=np.float32), QuiltLayout(COUNT, 1, None))
    for number in range(COUNT):
        quilt.view(number)[...] = number
    return quilt


@pytest.mark.parametrize("slant", [0.0, 12.0])
@pytest.mark.parametrize("number", [0, 7, 23])
def test_the_eye_of_a_camera_sees_its_view(slant, number):
    seen = replay_quilt(levels(), display(slant), camera(number, slant), size=(60, 40))
    np.testing.assert_allclose(seen, number, atol=1e-4)


def test_between_two_cameras_their_views_mix_or_the_nearest_is_seen():
    eye = tuple(0.7 * a + 0.3 * b for a, b in zip(camera(7), camera(8), strict=True))
    assert np.abs(replay_quilt(levels(), display(), eye, size=(60, 40)) - 7.3).max() < 1e-4
    assert (replay_quilt(levels(), display(), eye, size=(60, 40), linear=False) == 7).all()
    beyond = replay_quilt(levels(), display(), (500.0, 0.0, 300.0), size=(60, 40))
    assert (beyond == COUNT - 1).all()


def test_an_eye_nearer_than_the_cameras_sees_the_plane_in_perspective():
    z, eye = 12.0, (20.0, 0.0, 200.0)
    x = ((np.arange(240) + 0.5) / 240 - 0.5) * 48.0
    seen = replay_quilt(drawn(z), display(), eye, size=(240, 9))[4, :, 0]
    expected = stripes(x + (eye[0] - x) * z / eye[2])
    assert np.abs(seen - expected)[20:-20].max() < 0.06


def test_an_eye_sees_the_trim_of_a_sheet_alone():
    quilt, eye = drawn(6.0), (20.0, 0.0, 300.0)
    sheet = quilt_display(quilt, with_margin(display(), 60), "a.png")
    np.testing.assert_allclose(replay_quilt(quilt, sheet, eye), replay_quilt(quilt, display(), eye), atol=1e-5)


@pytest.mark.parametrize(("z", "slant"), [(-15.0, 0.0), (10.0, 0.0), (-15.0, 25.0)])
def test_a_plane_is_sharp_at_its_own_depth(z, slant):
    x = ((np.arange(240) + 0.5) / 240 - 0.5) * 48.0
    own, other = refocus_quilt(drawn(z, slant), display(slant), [z, -z], size=(240, 9))
    inner = slice(60, -60)
    assert np.abs(own[4, :, 0] - stripes(x))[inner].max() < 0.06
    assert np.ptp(other[4, inner, 0]) < 0.3


def test_what_cannot_be_shown():
    with pytest.raises(PictureError, match="a\\.png: the quilt does not say its display"):
        quilt_display(levels(), None, "a.png")
    with pytest.raises(PictureError, match="square lenses"):
        quilt_display(levels(), Display("s", Panel(60, 60, 0.1), LensArray("square", 0.6), gap=1.0), "a.png")
    with pytest.raises(UsageError, match="mm and below the viewing distance"):
        refocus_quilt(levels(), display(), [0.0, 300.0])
