"""Pictures compared a few rows at a time get the figures that they get in one piece."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann.codecs import tiff
from lippmann.display import Display, LensArray, Panel
from lippmann.errors import PictureError
from lippmann.image import IntegralImage, streamed
from lippmann.image.streamed import LargePicture, open_picture
from lippmann.metrics import compare
from lippmann.metrics import large as quality_large
from lippmann.metrics import view_metrics as quality_views
from lippmann.metrics.large import compare_large

DISPLAYS = {
    "sheet": (Panel(60, 48, 0.25), LensArray("lenticular", 1.5)),
    "slanted": (Panel(61, 48, 0.25), LensArray("lenticular", 1.3, slant=12.0)),
    "square": (Panel(72, 66, 0.25), LensArray("square", 1.5)),
    "square, broken": (Panel(72, 66, 0.25), LensArray("square", 1.37)),
    "hexagonal": (Panel(72, 66, 0.25), LensArray("hexagonal", 1.5)),
    "one view": (Panel(40, 30, 0.25), LensArray("square", 0.25)),
}


@pytest.fixture(params=sorted(DISPLAYS))
def display(request):
    panel, lenses = DISPLAYS[request.param]
    return Display(name="test", panel=panel, lens_array=lenses, gap=6.8, aperture_distance=5.0)


@pytest.fixture
def pair(display, tmp_path, monkeypatch):
    """Two pictures that differ, each whole and as it is read piece by piece."""
    monkeypatch.setattr(streamed, "LARGE", 0)
    monkeypatch.setattr(tiff, "TILED_FROM", 0)
    monkeypatch.setattr(tiff, "TILE", 16)
    # Little at a time, so that there are many bands and lots.
    monkeypatch.setattr(quality_large, "_BLOCK", 500)
    monkeypatch.setattr(quality_views, "_BLOCK", 600)
    rng = np.random.default_rng(5)
    shape = (display.panel.height, display.panel.width, 3)
    waves = 0.4 + 0.2 * np.sin(np.arange(shape[0])[:, None, None] / 5 + np.arange(shape[1])[None, :, None] / 9)
    # Edges where bands of rows meet, and across.
    waves[16:24] += 0.3
    waves[:, 20:31] += 0.2
    first = np.broadcast_to(waves, shape).astype(np.float32)
    second = np.clip(first + rng.normal(0, 0.05, shape), 0, 1).astype(np.float32)
    found = []
    for name, pixels in (("a.tif", first), ("b.tif", second)):
        whole = IntegralImage(pixels, display)
        whole.save(tmp_path / name, bits=32)
        opened = open_picture(tmp_path / name)
        assert isinstance(opened, LargePicture)
        found.append((whole, opened))
    return tuple(zip(*found, strict=True))


def close(a, b):
    """Nested figures, equal to single precision, in which views are kept whole."""
    if isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            close(a[key], b[key])
    elif isinstance(a, list):
        assert len(a) == len(b)
        for one, other in zip(a, b, strict=True):
            close(one, other)
    elif isinstance(a, float):
        assert b == pytest.approx(a, rel=1e-5, abs=1e-9)
    else:
        assert a == b


def test_the_figures_are_the_same(pair):
    whole, opened = pair
    expected, found = compare(*whole), compare_large(*opened)
    close(expected.to_dict(), found.to_dict())
    for one, other in zip(expected.rows(), found.rows(), strict=True):
        close(one, other)


def test_a_picture_read_whole_can_be_compared_with_one_that_is_not(pair):
    whole, opened = pair
    close(compare(*whole).to_dict(), compare_large(whole[0], opened[1]).to_dict())


def test_equal_pictures_are_identical(pair):
    _, (first, _) = pair
    found = compare_large(first, first)
    assert found.identical
    assert found.to_dict()["psnr"] is None


def test_pictures_of_other_displays_are_refused(pair):
    _, (first, _) = pair
    with pytest.raises(PictureError, match="different displays"):
        compare_large(first, replace(first, display=replace(first.display, gap=7.5)))
