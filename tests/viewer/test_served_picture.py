"""A file as the page shows it: what is refused at once, and many threads at a time."""

from __future__ import annotations

import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from lippmann.color.transfer import quantize
from lippmann.display import Display, LensArray, Panel
from lippmann.errors import PictureError
from lippmann.image import IntegralImage, read_picture, streamed
from lippmann.image.write import write_picture, write_plain_picture
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


WATCHED = """
import sys
from pathlib import Path
from lippmann.viewer.served_picture import PictureFile


def used(word):
    return int(next(line for line in open("/proc/self/status") if line.startswith(word)).split()[1]) * 1024


PictureFile(Path(sys.argv[2])).current()  # loads the decoders
open("/proc/self/clear_refs", "w").write("5")
before = used("VmRSS")
served = PictureFile(Path(sys.argv[1])).current()
print(used("VmRSS") - before, used("VmHWM") - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="the system does not tell a process's memory")
@pytest.mark.parametrize(
    ("name", "stored", "held", "read"),
    [
        pytest.param("p.png", "uint8", 3, 6, marks=pytest.mark.long),
        pytest.param("p.png", "uint16", 6, 12, marks=pytest.mark.long),
        ("p.exr", "float16", 12, 24),
        pytest.param("p.exr", "float32", 12, 24, marks=pytest.mark.long),
    ],
)
def test_the_server_takes_the_memory_that_is_documented(tmp_path, name, stored, held, read):
    side = 2000
    made = Display("big", Panel(side, side, 0.05), LensArray("square", 0.5), gap=1.0)
    noise = np.random.default_rng(2).random((side, side, 3), dtype=np.float32)
    write_picture(IntegralImage(noise, made, stored=stored), tmp_path / name)
    write_picture(IntegralImage(PIXELS, DISPLAY, stored=stored), tmp_path / f"small-{name}")
    said = subprocess.run(
        [sys.executable, "-c", WATCHED, str(tmp_path / name), str(tmp_path / f"small-{name}")],
        capture_output=True,
        text=True,
        check=True,
    )
    shown, peak = (int(word) / side**2 for word in said.stdout.split())
    slack = 4.0  # buffers of a file's own size, which the system takes back late
    assert 0.8 * held < shown < held + slack
    assert shown < peak < read + slack
