"""Radiance pictures: every variable that changes values, and every order of scan lines."""

import numpy as np
import pytest

from lippmann.codecs.radiance import read_header, read_radiance
from lippmann.errors import PictureError

#: A sky whose values shared exponents hold exactly; no two pixels are alike.
PIXELS = (np.arange(1, 25).reshape(2, 4, 3) / 32.0).astype(np.float32)


def coded(pixels):
    """Four bytes a pixel, as flat scan lines have them."""
    exponents = np.floor(np.log2(pixels.max(axis=-1))) + 1
    mantissas = np.floor(pixels / 2.0 ** exponents[..., None] * 256.0)
    return np.concatenate([mantissas, exponents[..., None] + 128], axis=-1).astype(np.uint8).tobytes()


def file_of(pixels, lines=(), size="-Y 2 +X 4", form="32-bit_rle_rgbe"):
    head = "\n".join(["#?RADIANCE", "# made for a test", f"FORMAT={form}", *lines, "", size])
    return head.encode() + b"\n" + coded(pixels)


def read(data):
    return read_radiance(data, read_header(data, "sky.hdr"), "sky.hdr")


def test_values():
    assert read(file_of(PIXELS)).tolist() == PIXELS.tolist()


def test_runs_of_pixels_as_older_programs_write_them():
    """1, 1, 1, n repeats the pixel before n times; of runs one after the other the next counts 256 times as much."""
    first, second = PIXELS[0, :1], PIXELS[1, :1]
    body = coded(first[None]) + bytes((1, 1, 1, 0x57, 1, 1, 1, 0x02)) + coded(second[None])
    data = file_of(PIXELS[:0], size="-Y 2 +X 301") + body + bytes((1, 1, 1, 1))
    found = read(data).reshape(-1, 3)
    assert found[:600].tolist() == np.repeat(first, 600, axis=0).tolist()
    assert found[600:].tolist() == np.repeat(second, 2, axis=0).tolist()
    with pytest.raises(PictureError, match="cannot be decoded"):
        read(data[:-4])
    with pytest.raises(PictureError, match="cannot be decoded"):
        read(file_of(PIXELS[:0], size="-Y 2 +X 301") + bytes((1, 1, 1, 9)))


@pytest.mark.parametrize("rows", "+-")
@pytest.mark.parametrize("columns", "+-")
@pytest.mark.parametrize("lines_first", "XY")
def test_all_orders_of_scan_lines(rows, columns, lines_first):
    stored = PIXELS[:: 1 if rows == "-" else -1, :: 1 if columns == "+" else -1]
    size = [f"{rows}Y 2", f"{columns}X 4"]
    if lines_first == "X":
        stored, size = stored.transpose(1, 0, 2), size[::-1]
    assert read(file_of(stored, size=" ".join(size))).tolist() == PIXELS.tolist()


def test_exposures_are_divided_out():
    lines = ["EXPOSURE=4", "COLORCORR=1 2 4", "EXPOSURE= 0.5 "]
    assert read(file_of(PIXELS * 2 * np.float32([1, 2, 4]), lines)) == pytest.approx(PIXELS, rel=2e-2)
    assert read(file_of(np.full_like(PIXELS, 0.5), lines))[0, 0].tolist() == [0.25, 0.125, 0.0625]


def test_xyz():
    """The format's own matrix, of "Radiance File Formats"."""
    matrix = np.array([[0.5141, 0.3239, 0.1620], [0.2651, 0.6702, 0.0647], [0.0241, 0.1229, 0.8530]])
    found = read(file_of(np.full((2, 4, 3), [1.0, 0.5, 0.5]) @ matrix.T, form="32-bit_rle_xyze"))
    assert found == pytest.approx(np.full((2, 4, 3), [1.0, 0.5, 0.5]), abs=0.01)


def test_primaries():
    own = "PRIMARIES=0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333"
    assert read(file_of(PIXELS, [own])).tolist() == PIXELS.tolist()
    assert read(file_of(PIXELS, ["PRIMARIES=0 0 0 0 0 0 0 0"])).tolist() == PIXELS.tolist()
    wide = "PRIMARIES=0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.3290"
    red = read(file_of(np.full((2, 4, 3), [1.0, 0.5, 0.5], np.float32), [wide]))[0, 0]
    assert red == pytest.approx([1.6605 - 0.3302, -0.1246 + 0.5623, -0.0182 + 0.5091], abs=2e-3)  # ITU-R BT.2087-0


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (file_of(PIXELS, size="-Y 2 +Y 4"), "does not say its size"),
        (file_of(PIXELS).split(b"\n\n")[0], "does not say its size"),
        (file_of(PIXELS, ["EXPOSURE=dark"]), r"EXPOSURE is 'dark', not 1 number\(s\)"),
        (file_of(PIXELS, ["COLORCORR=1 2"]), r"COLORCORR is '1 2', not 3 number\(s\)"),
        (file_of(PIXELS, ["EXPOSURE=0"]), "its exposure must be above 0"),
        (file_of(PIXELS, ["PIXASPECT=2"]), "its pixels are not square"),
        (file_of(PIXELS, ["PRIMARIES=0 0 0 0 0 0 0 1"]), "must not lie on a line"),
        (file_of(PIXELS, size="-Y 20000 +X 40000"), "hold no 40000x20000 pixels"),
        (file_of(PIXELS)[:-8], "cannot be decoded"),
    ],
)
def test_damaged_files(data, message):
    with pytest.raises(PictureError, match=message):
        read(data)
