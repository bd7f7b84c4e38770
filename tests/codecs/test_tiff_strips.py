"""TIFF files written band by band; and the true resolution of all TIFF files."""

from __future__ import annotations

import numpy as np
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from lippmann.codecs.tiff import write_tiff
from lippmann.codecs.tiff_strips import write_tiff_bands


@pytest.mark.parametrize("shape", [(1, 1), (700, 900), (700, 900, 3), (3, 200_000)])
@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
def test_bands_make_the_picture(tmp_path, shape, dtype):
    values = np.random.default_rng(1).integers(0, 255, shape).astype(dtype)
    path, asked = tmp_path / "a.tif", []

    def band(first, last):
        asked.append((first, last))
        return values[first:last]

    write_tiff_bands(path, (shape[1], shape[0]), band, pixel_pitch=25.4 / 720, description="what it is")
    np.testing.assert_array_equal(tifffile.imread(path), values)
    with tifffile.TiffFile(path) as file:
        assert not file.is_bigtiff
        assert file.pages[0].tags["ImageDescription"].value == "what it is"
    assert asked[1:] == sorted(asked[1:])
    if dtype == "uint8":
        np.testing.assert_array_equal(np.asarray(Image.open(path)), values)


def test_a_print_beyond_four_gigabytes_is_a_bigtiff(tmp_path):
    """The pixels are not asked for before the file says of what kind it is."""

    class EnoughError(Exception):
        pass

    def band(first, last):
        if last > 1:
            raise EnoughError
        return np.zeros((last - first, 60_000, 3), dtype=np.uint8)

    path = tmp_path / "a.tif"
    with pytest.raises(EnoughError):
        write_tiff_bands(path, (60_000, 40_000), band, pixel_pitch=25.4 / 720)
    assert path.read_bytes()[:4] == b"II+\0"


@given(ppi=st.integers(10, 20_000))
@settings(deadline=None, max_examples=20)
def test_whole_resolutions_are_exact(tmp_path_factory, ppi):
    path = tmp_path_factory.getbasetemp() / "resolution.tif"
    pixel = 25.4 / ppi
    for write in (
        lambda: write_tiff(path, np.zeros((2, 2, 3), np.uint8), description="", pixel_pitch=pixel),
        lambda: write_tiff_bands(path, (2, 2), lambda a, b: np.zeros((b - a, 2), np.uint8), pixel_pitch=pixel),
    ):
        write()
        with tifffile.TiffFile(path) as file:
            tags = file.pages[0].tags
            assert (tags["XResolution"].value, tags["YResolution"].value) == ((ppi, 1), (ppi, 1))
            assert tags["ResolutionUnit"].value == 2  # inch
        with Image.open(path) as picture:
            assert picture.info["dpi"] == (ppi, ppi)


@pytest.mark.parametrize(("ppi", "exact"), [(609.6, (3048, 5)), (720.5, (1441, 2)), (282.4, (1412, 5))])
def test_broken_resolutions_are_exact_too(tmp_path, ppi, exact):
    path = tmp_path / "a.tif"
    write_tiff_bands(path, (2, 2), lambda a, b: np.zeros((b - a, 2), np.uint8), pixel_pitch=25.4 / ppi)
    with tifffile.TiffFile(path) as file:
        assert file.pages[0].tags["XResolution"].value == exact
