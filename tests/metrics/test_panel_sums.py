"""Pictures compared some rows at a time, in memory or from files, get the figures of whole arrays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann.codecs import tiff
from lippmann.display import Display, LensArray, Panel
from lippmann.errors import PictureError
from lippmann.image import IntegralImage, streamed
from lippmann.image.micro_images import Permutation
from lippmann.image.streamed import LargePicture, open_picture
from lippmann.metrics import bands, compare, find_silhouettes, paper_rmse, psnr, squared_errors, view_metrics
from lippmann.metrics.paper import paper_codes

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
    monkeypatch.setattr(bands, "_BLOCK", 500)
    monkeypatch.setattr(view_metrics, "_BLOCK", 600)
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


@pytest.mark.slow
def test_the_figures_are_the_same(pair, monkeypatch):
    whole, opened = pair
    found = compare(*opened)
    held = compare(*whole)
    monkeypatch.undo()
    expected = compare(*whole)  # in one band
    for one in (found, held):
        close(expected.to_dict(), one.to_dict())
        for row, other in zip(expected.rows(), one.rows(), strict=True):
            close(row, other)


def test_the_figures_are_those_of_whole_arrays(pair):
    (reference, test), opened = pair
    errors = squared_errors(reference, test)
    off = ~find_silhouettes(reference).mask
    cut = Permutation(reference.display)
    lenses = cut.mask, cut.split(errors), *(cut.split(paper_codes(one.pixels, "srgb")) for one in (reference, test))
    found = compare(*opened)
    assert found.mean_squared_error == pytest.approx(errors.mean(), rel=1e-5)
    assert found.silhouettes.share == pytest.approx(1 - off.mean())
    assert found.psnr_off_silhouettes == (pytest.approx(psnr(errors[off].mean()), rel=1e-5) if off.any() else None)
    for lens in np.ndindex(cut.mask.shape[:2]):
        present, own, one, other = (values[lens] for values in lenses)
        assert found.micro_image_pixels[lens] == present.sum()
        if present.any():
            assert found.micro_image_errors[lens] == pytest.approx(own[present].mean(), rel=1e-5)
            assert found.paper.rmse[lens] == pytest.approx(paper_rmse(one[present], other[present]))
        else:
            assert np.isnan(found.micro_image_errors[lens])


def test_silhouettes_by_depth_are_left_out_in_every_band(pair):
    (reference, test), (_, opened) = pair
    depth = np.zeros(reference.pixels.shape[:2], dtype=np.float32)
    depth[depth.shape[0] // 2 :] = -50.0
    depth[:, 7] = np.inf
    deep = replace(reference, maps={"depth": depth})
    found, off = compare(deep, opened), ~find_silhouettes(deep).mask
    assert found.silhouettes.source == "depth"
    assert found.silhouettes.share == pytest.approx(1 - off.mean())
    assert found.psnr_off_silhouettes == pytest.approx(psnr(squared_errors(deep, test)[off].mean()), rel=1e-5)


def test_a_picture_read_whole_can_be_compared_with_one_that_is_not(pair):
    whole, opened = pair
    close(compare(*whole).to_dict(), compare(whole[0], opened[1]).to_dict())


def test_the_errors_of_a_picture_on_disk_are_computed_when_asked_for(pair):
    whole, opened = pair
    np.testing.assert_allclose(compare(*opened).errors, squared_errors(*whole), rtol=1e-5, atol=1e-9)


def test_progress_rises_to_all_rows_of_both_parts(pair):
    seen = []
    compare(*pair[1], lambda report: seen.append((report.done, report.total)))
    total = 2 * pair[0][0].display.panel.height
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    assert seen[-1] == (total, total)


def test_equal_pictures_are_identical(pair):
    _, (first, _) = pair
    found = compare(first, first)
    assert found.identical
    assert found.to_dict()["psnr"] is None


def test_pictures_of_other_displays_are_refused(pair):
    _, (first, _) = pair
    with pytest.raises(PictureError, match="different displays"):
        compare(first, replace(first, display=replace(first.display, gap=7.5)))
