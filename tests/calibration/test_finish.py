"""Marks in files: a picture read piece by piece gets the same as one that is whole in memory."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import tifffile

import lippmann.image.streamed
from lippmann.calibration.alignment_marks import Marks, marked_rows
from lippmann.calibration.finish import Finish, write_finished
from lippmann.display.formats.print_sheet import Print
from lippmann.errors import OutputError, UsageError
from lippmann.image import IntegralImage, read_picture
from lippmann.image.streamed import LargePicture, open_picture

DISPLAY = Print(ppi=360, size=(40, 90), lpi=30, viewing_distance=400).display()


@pytest.fixture
def image():
    size = DISPLAY.panel.height, DISPLAY.panel.width, 3
    return IntegralImage(np.random.default_rng(1).random(size, dtype=np.float32), DISPLAY)


@pytest.fixture
def opened(image, tmp_path, monkeypatch):
    """``opened(bits)``: the picture in a file, whole and piece by piece."""

    def both(bits):
        path = tmp_path / f"picture{bits}.tif"
        image.save(path, bits=bits)
        monkeypatch.setattr(lippmann.image.streamed, "LARGE", 1)
        large = open_picture(path)
        assert isinstance(large, LargePicture)
        return read_picture(path), large

    return both


@pytest.mark.slow
@pytest.mark.parametrize("bits", [8, pytest.param(16, marks=pytest.mark.long), 32])
def test_piece_by_piece_gives_the_same(opened, tmp_path, bits):
    whole, large = opened(bits)
    paths = tmp_path / "whole.tif", tmp_path / "large.tif"
    displays = [
        write_finished(picture, path, Finish(margin=8.0), bits=bits)
        for picture, path in zip((whole, large), paths, strict=True)
    ]
    assert displays[0] == displays[1] == Marks(DISPLAY, 8.0).sheet
    first, second = (read_picture(path) for path in paths)
    np.testing.assert_array_equal(first.pixels, second.pixels)
    assert first.stored == second.stored == whole.stored
    assert (first.display, first.provenance) == (second.display, second.provenance)
    with tifffile.TiffFile(paths[1]) as file:
        assert file.pages[0].tags["XResolution"].value == (360, 1)


def test_bands_fit_together(image):
    marks = Marks(DISPLAY, 8.0)
    every = Finish(margin=8.0).image(image).pixels
    rows = np.cumsum([0, 5, 107, 1, 3, 600, every.shape[0] - 716])
    asked = []

    def picture(first, last):
        assert 0 <= first < last <= DISPLAY.panel.height
        asked.append(last - first)
        return image.pixels[first:last]

    for first, last in pairwise(rows.tolist()):
        np.testing.assert_array_equal(marked_rows(marks, picture, first, last), every[first:last])
    assert sum(asked) == DISPLAY.panel.height


def test_large_pictures_become_tiff(opened, tmp_path):
    _, large = opened(8)
    with pytest.raises(OutputError, match="a picture of this size needs TIFF"):
        write_finished(large, tmp_path / "sheet.png", Finish(margin=8.0))
    with pytest.raises(UsageError, match="margin: 1 mm is out of range"):
        write_finished(large, tmp_path / "sheet.tif", Finish(margin=1.0))
    slanted = replace(large, display=replace(DISPLAY, sheet=None, lens_array=replace(DISPLAY.lens_array, slant=3.0)))
    with pytest.raises(UsageError, match="slanted lenses"):
        write_finished(slanted, tmp_path / "sheet.tif", Finish(margin=8.0))
    assert not list(tmp_path.glob("sheet*"))
