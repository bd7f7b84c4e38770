"""A file as the page shows it: what is refused at once, and many threads at a time."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from lippmann.color.transfer import quantize
from lippmann.display import Display, LensArray, Panel
from lippmann.errors import PictureError
from lippmann.image import IntegralImage, read_picture, streamed
from lippmann.image.write import write_plain_picture
from lippmann.viewer import served_picture
from lippmann.viewer.served_picture import PictureFile
from lippmann.viewer.tiles import Tiles

DISPLAY = Display(
    "d", Panel(20, 12, 0.1), LensArray("lenticular", 0.4), gap=1.0, viewing_distance=500.0, aperture_distance=5.0
)
PIXELS = np.random.default_rng(1).random((12, 20, 3), dtype=np.float32)


def test_a_picture_without_a_display_needs_one(tmp_path):
    path = tmp_path / "plain.png"
    write_plain_picture(PIXELS, path)
    with pytest.raises(PictureError, match=r"say display=\.\.\."):
        PictureFile(path)
    assert PictureFile(path, DISPLAY).current().tiles.columns == 1


@pytest.mark.parametrize("content", [None, b"", b"no picture", b"\x89PNG\r\n\x1a\n" + bytes(20)])
def test_what_is_no_picture_is_refused_at_once(tmp_path, content):
    path = tmp_path / "a.png"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(PictureError, match=r"a\.png"):
        PictureFile(path)


def test_many_threads_read_a_file_once(tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    IntegralImage(PIXELS, DISPLAY).save(path)
    read = []
    really = served_picture.picture_of_file

    def slowly(*arguments, **options):
        read.append(arguments)
        time.sleep(0.05)
        return really(*arguments, **options)

    monkeypatch.setattr(served_picture, "picture_of_file", slowly)
    file = PictureFile(path)
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda number: file.current() if number % 2 else file.load_once(), range(32)))
    assert len(read) == 1
    assert len({id(item) for item in found}) == 1


@pytest.mark.parametrize("bits", [8, 16, 32])
def test_a_large_picture_is_read_piece_by_piece(tmp_path, monkeypatch, bits):
    pytest.importorskip("zarr")
    monkeypatch.setattr(streamed, "LARGE", 100)
    path = tmp_path / "a.zarr"
    IntegralImage(PIXELS, DISPLAY).save(path, bits=bits)
    opened = streamed.open_picture(path, keeps_codes=True)
    assert isinstance(opened, streamed.LargePicture)
    expected = quantize(read_picture(path).pixels, 8, "srgb")
    np.testing.assert_array_equal(Tiles(opened, 7).codes("picture", 1, 1), expected[7:14, 7:14])
