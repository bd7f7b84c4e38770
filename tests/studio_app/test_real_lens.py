"""The studio's switch *Real lens* shows what ``lippmann replay --optics`` shows of a render."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann.display import load_display
from lippmann.display.lens_profile import LensProfile
from lippmann.display.visible_pixels import EyeMap
from lippmann.image import IntegralImage
from lippmann.studio_app.real_lens import RealEyeMap
from lippmann.viewing.optical_replay import replay_optics
from lippmann.viewing.replay import default_eye

ROUND = LensProfile(radius=2.3, thickness=6.0, index=1.5)
DISPLAYS = {
    "print": load_display("print:lpi=60,ppi=360,size=8x5mm,thickness=0.6604mm,index=1.57,blur=9um"),
    "slanted": replace(
        load_display("panel-4k").resized(160, 90), lens=LensProfile(radius=1.9, thickness=4.6, index=1.57)
    ),
    "hexagonal": replace(load_display("mla-hexagonal").resized(96, 80), lens=ROUND, viewing_distance=300.0),
}


def psnr(one, other):
    return -10 * np.log10(max(np.mean((one.astype(float) - other) ** 2), 1e-12))


def smooth(display):
    """A picture of the panel whose neighbours along are alike, those across are not."""
    panel = display.panel
    across = np.arange(panel.width)[None, :, None] * np.array([0.7, 0.9, 1.3])
    along = np.linspace(0, 3, panel.height)[:, None, None]
    return (0.5 + 0.5 * np.sin(across + along)).astype(np.float32)


@pytest.mark.long_cases("hexagonal-True")
@pytest.mark.slow
@pytest.mark.parametrize("subpixels", [True, False])
@pytest.mark.parametrize("name", DISPLAYS)
def test_mixed_pixels_are_those_of_replay(name, subpixels):
    display = DISPLAYS[name]
    picture = smooth(display)
    x, y, z = default_eye(display)
    size = 3 * display.panel.width, 3 * display.panel.height
    for eye in ((x, y, z), (-0.2 * z, 0.1 * z, 1.2 * z)):
        found = RealEyeMap(display, size, subpixels=subpixels).pixels_for_eye(eye)
        traced = picture[found.row, found.column]
        if subpixels:
            # A ray carries one colour of the three.
            traced = np.where(np.arange(3) == found.channel[:, None], traced, np.float32(99))
        expected = replay_optics(IntegralImage(picture, display), eye, size=size)
        # The page, too, knows fewer directions of round lenses.
        least = 40 if display.lens_array.layout == "lenticular" else 30
        assert psnr(found.arrange(traced), expected) > least
        ideal = EyeMap(display, size, subpixels=False).pixels_for_eye(eye)
        # Ideal lenses show something else.
        assert (
            psnr(ideal.arrange(picture[ideal.row, ideal.column]), expected) < psnr(found.arrange(traced), expected) - 5
        )
        # Each pixel is traced once, and fewer than all.
        keys = set(zip(found.row.tolist(), found.column.tolist(), found.channel.tolist(), strict=True))
        assert len(keys) == len(found.row)
        # Of every lens that sends light there is a brightest pixel, for its depth.
        assert ((found.number >= 0).any(axis=2) == (expected.sum(axis=2) > 0.02)).mean() > 0.97


@pytest.mark.slow
@pytest.mark.parametrize(("name", "subpixels"), [("print", False), ("slanted", True)])
def test_denoisers_get_mean_light_of_all_colors_and_the_sheets_pattern_returns(name, subpixels):
    display = DISPLAYS[name]
    found = RealEyeMap(display, (240, 150), subpixels=subpixels).pixels_for_eye(default_eye(display))
    values = np.random.default_rng(5).random((len(found.row), 3), dtype=np.float32)
    picture = found.arrange_for_denoiser(values)
    assert picture.shape[1] == (3 * 240 if subpixels else display.lens_grid.columns)
    assert found.arrange_denoised(picture) == pytest.approx(found.arrange(values), abs=1e-6)
    white = np.ones_like(values)
    even = found.arrange_for_denoiser(white)
    assert even[even > 0.5] == pytest.approx(1.0, abs=1e-5)
    assert (np.ptp(found.arrange(white)[75]) > 0.1) == subpixels


@pytest.mark.slow
def test_an_eye_that_gets_no_light_sees_black():
    display = DISPLAYS["print"]
    found = RealEyeMap(display, (40, 25), subpixels=True).pixels_for_eye((9000.0, 0.0, 300.0))
    assert len(found.row) >= 2
    assert found.arrange(np.ones((len(found.row), 3), np.float32)).max() <= 1
