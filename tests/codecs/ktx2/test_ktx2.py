"""Pictures in KTX 2.0 files, held against the texels that the reference transcoder makes of them."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lippmann.codecs.ktx2 import Ktx2Error, decode_ktx2
from lippmann.codecs.ktx2.etc1s import Codebooks, DamagedError
from lippmann.codecs.ktx2.uastc import decode_uastc

DATA = Path(__file__).parent / "data"
NAMES = ("etc1s_rgb", "etc1s_rgba", "uastc_rgb", "uastc_rgba", "uastc_modes")
LEVEL, SCHEME, WIDTH, HEIGHT = 80, 44, 20, 24


def file(name):
    return bytearray((DATA / f"{name}.ktx2").read_bytes())


def put(data, at, form, *values):
    struct.pack_into(form, data, at, *values)
    return bytes(data)


@pytest.mark.long_cases("uastc_rgb", "uastc_rgba")
@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_texels_are_those_of_the_reference_transcoder(name):
    expected = np.asarray(Image.open(DATA / f"{name}.png"))
    assert np.array_equal(decode_ktx2(bytes(file(name))), expected)


def test_zlib_is_decompressed():
    data = file("uastc_rgb")
    offset, size, _ = struct.unpack_from("<3Q", data, LEVEL)
    packed = zlib.compress(data[offset : offset + size])
    put(data, SCHEME, "<I", 3)
    put(data, LEVEL, "<3Q", len(data), len(packed), size)
    assert np.array_equal(decode_ktx2(bytes(data) + packed), decode_ktx2(bytes(file("uastc_rgb"))))


@pytest.mark.parametrize(
    ("name", "at", "form", "values", "words"),
    [
        ("uastc_rgb", 0, "<B", (0,), "does not begin as a KTX 2.0 file"),
        ("uastc_rgb", WIDTH, "<2I", (0, 60), "not one picture of two dimensions"),
        ("uastc_rgb", 28, "<I", (7,), "not one picture of two dimensions"),
        ("uastc_rgb", 36, "<I", (6,), "not one picture of two dimensions"),
        ("uastc_rgb", WIDTH, "<2I", (70000, 70000), "4900000000 are more than"),
        ("uastc_rgb", WIDTH, "<2I", (128, 60), "blocks are not as many"),
        ("uastc_rgb", SCHEME, "<I", (9,), "compression 9"),
        ("uastc_rgb", SCHEME, "<I", (1,), "UASTC texels in BasisLZ"),
        ("uastc_rgb", SCHEME, "<I", (2,), "cannot be decompressed"),
        ("uastc_rgb", SCHEME, "<I", (3,), "cannot be decompressed"),
        ("uastc_rgba", LEVEL + 16, "<Q", (1 << 40,), "blocks are not as many"),
        ("uastc_rgb", LEVEL, "<Q", (1 << 60,), "cut short"),
        ("uastc_rgb", 48, "<2I", (1 << 30, 44), "cut short"),
        ("uastc_rgb", 52, "<I", (8,), "does not describe its texels"),
        ("etc1s_rgb", SCHEME, "<I", (0,), "not compressed by BasisLZ"),
        ("etc1s_rgb", 64, "<2Q", (0, 0), "cut short"),
    ],
)
def test_headers_that_lie_are_refused(name, at, form, values, words):
    data = file(name)
    if words.startswith("4900000000"):
        words = "70000x70000 texels are more than 178956970"
    with pytest.raises(Ktx2Error, match=words):
        decode_ktx2(put(data, at, form, *values))


def test_other_kinds_of_texels_are_named():
    data = file("uastc_rgb")
    (descriptor,) = struct.unpack_from("<I", data, 48)
    data[descriptor + 12] = 134
    with pytest.raises(Ktx2Error, match="color model 134; ETC1S and UASTC are understood"):
        decode_ktx2(bytes(data))


def test_frames_of_videos_are_refused():
    data = file("etc1s_rgb")
    (start,) = struct.unpack_from("<Q", data, 64)
    with pytest.raises(Ktx2Error, match="a frame of a video"):
        decode_ktx2(put(data, start + 20, "<I", 2))


def test_blocks_of_no_mode_are_refused():
    assert decode_uastc(bytes([0x45] + [0] * 15), 1, 1) is None
    two_subsets_of_pattern_31 = (31 << 20 | 0x1D).to_bytes(16, "little")
    assert decode_uastc(two_subsets_of_pattern_31, 1, 1) is None
    assert decode_uastc((29 << 20 | 0x1D).to_bytes(16, "little"), 1, 1) is not None


def test_empty_codebooks_are_refused():
    with pytest.raises(DamagedError, match="codebooks are empty"):
        Codebooks.read(0, 1, b"", b"", b"")


@pytest.mark.long_cases("etc1s_rgba")
@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_damaged_files_end_in_a_line_or_a_picture(name):
    """Bytes changed at random, and ends cut off; kernels without bounds would die of an index too large."""
    rng = np.random.default_rng(11)
    whole = file(name)
    ends = 0
    for _ in range(400):
        data = bytearray(whole)
        for place in rng.integers(0, len(data), rng.integers(1, 6)):
            data[place] = rng.integers(256)
        # A part of the changes beyond the headers, where the bits of the codes are.
        for place in rng.integers(min(200, len(data) - 1), len(data), 3):
            data[place] ^= 1 << rng.integers(8)
        for made in (bytes(data), bytes(data[: rng.integers(len(data))])):
            try:
                decode_ktx2(made)
            except Ktx2Error:
                ends += 1
    assert ends > 300
