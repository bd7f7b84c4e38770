"""Pictures written a few rows at a time are the files that are written in one piece."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.codecs import tiff
from lippmann.color.transfer import dequantize, quantize
from lippmann.errors import PictureError
from lippmann.image import IntegralImage, read_picture
from lippmann.image.write import can_be_banded, write_rows


def content(path):
    files = path.rglob("*") if path.is_dir() else [path]
    return {file.relative_to(path).as_posix(): file.read_bytes() for file in files if file.is_file()}


@pytest.mark.parametrize("name", ["a.tif", "a.zarr"])
@pytest.mark.parametrize("bits", [8, 16, 32])
def test_bands_make_the_same_file(display, tmp_path, monkeypatch, name, bits):
    monkeypatch.setattr(tiff, "TILE", 16)
    monkeypatch.setattr(tiff, "TILED_FROM", 0)
    shown = display("square", lenses=(9, 7), pixels=5)
    values = np.random.default_rng(0).uniform(0, 1.1, (35, 45, 3)).astype(np.float32)
    image = IntegralImage(values, shown)
    asked = []

    def rows(first, last):
        asked.append((first, last))
        return values[first:last]

    for folder in ("bands", "whole"):
        (tmp_path / folder).mkdir()
    write_rows(rows, image.metadata, tmp_path / "bands" / name, bits=bits)
    image.save(tmp_path / "whole" / name, bits=bits)
    assert content(tmp_path / "bands" / name) == content(tmp_path / "whole" / name)
    assert asked == [(0, 16), (16, 32), (32, 35)]
    stored = {8: "uint8", 16: "uint16", 32: "float32"}[bits]
    expected = values if bits == 32 else dequantize(quantize(values, bits, "srgb"), "srgb")
    written = read_picture(tmp_path / "bands" / name)
    np.testing.assert_array_equal(written.pixels, expected)
    assert written.stored == stored


def test_what_cannot_be_written_so_is_refused(display, tmp_path):
    image = IntegralImage(np.zeros((9, 12, 3), np.float32), display())
    with pytest.raises(PictureError, match="written whole"):
        write_rows(lambda first, last: image.rows(first, last), image.metadata, tmp_path / "a.png")
    with pytest.raises(PictureError, match="not finite"):
        write_rows(lambda first, last: image.rows(first, last) * np.nan, image.metadata, tmp_path / "a.tif")
    assert list(tmp_path.iterdir()) == []
    assert [can_be_banded(name) for name in ("png", "exr", "tiff", "zarr")] == [False, False, True, True]
