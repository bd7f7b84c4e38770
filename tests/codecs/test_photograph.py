"""Photographs of every format come upright and in a known colour space."""

from __future__ import annotations

import io
import struct
import zlib
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
from PIL import Image, ImageCms, features

from lippmann.codecs import photograph, png
from lippmann.codecs.avif_colors import code_points
from lippmann.codecs.icc import rgb_profile
from lippmann.codecs.photograph import open_photograph
from lippmann.codecs.png import encode_png
from lippmann.errors import PictureError

#: Blue above green, red at the left: 12 wide, 16 high.
UPRIGHT = np.zeros((16, 12, 3), np.uint8)
UPRIGHT[:8], UPRIGHT[8:], UPRIGHT[:, :4] = (40, 80, 230), (40, 170, 60), (220, 40, 40)


def codes_of(data, *, srgb=True):
    with open_photograph(io.BytesIO(data), Path("a")) as opened:
        codes = opened.srgb_codes() if srgb else opened.codes()
        assert opened.size == codes.shape[1::-1]
        return codes


def encoded(picture, kind, **options):
    stream = io.BytesIO()
    picture.save(stream, kind, **options)
    return stream.getvalue()


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "TIFF", "WEBP", "AVIF"])
@pytest.mark.parametrize(("orientation", "turns"), [(1, 0), (3, 2), (6, 1), (8, 3)])
def test_every_format_is_turned_upright(kind, orientation, turns):
    Image.init()
    if kind not in Image.SAVE:
        pytest.skip(f"this Pillow does not write {kind}")
    exif = Image.Exif()
    exif[0x112] = orientation
    big = np.repeat(np.repeat(UPRIGHT, 8, axis=0), 8, axis=1)
    stored = Image.fromarray(np.rot90(big, turns).copy())
    codes = codes_of(encoded(stored, kind, exif=exif, **({"quality": 95} if kind in ("JPEG", "WEBP", "AVIF") else {})))
    assert np.abs(codes[4::8, 4::8].astype(int) - UPRIGHT).max() <= 8


@pytest.mark.parametrize("kind", ["PNG", "TIFF"])
def test_greys_of_16_bits_are_not_clipped(kind):
    codes = codes_of(encoded(Image.fromarray(np.array([[0, 300, 65535]], np.uint16)), kind))
    assert codes.dtype == np.uint16
    assert codes[..., 0].tolist() == [[0, 300, 65535]]


def with_chunks(png, *chunks):
    """A PNG with chunks after its header."""
    extra = b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in chunks
    )
    return png[:33] + extra + png[33:]


P3 = (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290)
GAMA_LINEAR = (b"gAMA", struct.pack(">I", 100_000))
CHRM_P3 = (b"cHRM", struct.pack(">8I", *(round(100_000 * number) for number in (*P3[6:], *P3[:6]))))
SRGB_CHUNK = (b"sRGB", b"\0")
CICP_P3 = (b"cICP", bytes([12, 13, 0, 1]))
SRGB_PLACES = {"whitepoint": (0.3127, 0.3290, 1.0), "primaries": (0.64, 0.33, 1.0, 0.30, 0.60, 1.0, 0.15, 0.06, 1.0)}
LINEAR = bytes(imagecodecs.cms_profile("rgb", gamma=1.0, **SRGB_PLACES))
ICC_LINEAR = (b"iCCP", b"p\0\0" + zlib.compress(LINEAR))
#: P3's (90, 128, 150) in sRGB, by the matrix of CSS Color 4.
OF_P3 = (78, 129, 152)


@pytest.mark.parametrize(
    ("chunks", "expected"),
    [
        ([], (90, 128, 150)),
        ([(b"gAMA", struct.pack(">I", 45_455))], (90, 128, 150)),  # what is written for sRGB
        ([GAMA_LINEAR], (160, 188, 201)),
        ([SRGB_CHUNK, GAMA_LINEAR], (90, 128, 150)),
        ([(b"sBIT", bytes([5, 6, 5]))], (90, 128, 150)),  # codes reach over the whole range all the same
        ([ICC_LINEAR, SRGB_CHUNK], (160, 188, 201)),
        ([CICP_P3, ICC_LINEAR], OF_P3),
        ([CHRM_P3], OF_P3),
        ([(b"cICP", bytes([1, 13, 0, 1])), ICC_LINEAR], (90, 128, 150)),
    ],
)
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_colours_of_a_png_are_those_of_the_first_chunk_that_counts(chunks, expected, kind):
    step = 257 if kind is np.uint16 else 1
    plain = encode_png(np.full((2, 2, 3), np.array([90, 128, 150]) * step, kind), text={}, srgb=False)
    codes = codes_of(with_chunks(plain, *chunks))
    assert codes.dtype == kind
    assert codes[0, 0] / step == pytest.approx(expected, abs=1.1)


def test_colours_beyond_a_display_are_named():
    plain = encode_png(np.zeros((2, 2, 3), np.uint8), text={}, srgb=False)
    with pytest.raises(PictureError, match="a: its colours are HLG"):
        codes_of(with_chunks(plain, (b"cICP", bytes([9, 18, 0, 1]))))


def avif(primaries, transfer, **options):
    """A picture of (90, 128, 150) whose box of colours says so; Pillow writes 1, 13."""
    data = bytearray(
        encoded(Image.new("RGB", (16, 16), (90, 128, 150)), "AVIF", quality=100, subsampling="4:4:4", **options)
    )
    place = data.find(b"nclx") + 4
    assert struct.unpack(">HH", data[place : place + 4]) == (1, 13)
    data[place : place + 4] = struct.pack(">HH", primaries, transfer)
    return bytes(data)


@pytest.mark.skipif(not features.check("avif"), reason="this Pillow has no AVIF")
@pytest.mark.parametrize(
    ("points", "expected"), [((1, 13), (90, 128, 150)), ((2, 2), (90, 128, 150)), ((12, 13), OF_P3)]
)
def test_colours_of_an_avif_are_those_of_its_code_points(points, expected):
    assert codes_of(avif(*points))[8, 8] == pytest.approx(expected, abs=2)


@pytest.mark.skipif(not features.check("avif"), reason="this Pillow has no AVIF")
def test_code_points_of_an_avif_beyond_a_display_are_named():
    with pytest.raises(PictureError, match="a: its colours are PQ"):
        codes_of(avif(9, 16))
    data = avif(9, 16)
    for cut in range(0, data.find(b"mdat"), 7):  # damaged boxes end in a picture or an error of Pillow's
        code_points(io.BytesIO(data[:cut]))


def test_codes_of_a_narrow_range_are_named():
    plain = encode_png(np.zeros((2, 2, 3), np.uint8), text={}, srgb=False)
    with pytest.raises(PictureError, match="a: its codes have a narrow range"):
        codes_of(with_chunks(plain, (b"cICP", bytes([1, 13, 0, 0]))))


def test_a_camera_that_says_adobe_rgb():
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA001] = 0xFFFF
    exif.get_ifd(0x8769)[0xA005] = {1: "R03"}
    picture = Image.new("RGB", (16, 16), (90, 128, 150))
    codes = codes_of(encoded(picture, "JPEG", quality=100, exif=exif.tobytes()))
    profile = ImageCms.ImageCmsProfile(io.BytesIO(bytes(imagecodecs.cms_profile("adobergb"))))
    expected = ImageCms.profileToProfile(picture, profile, ImageCms.createProfile("sRGB"), outputMode="RGB")
    assert np.abs(codes[8, 8].astype(int) - expected.getpixel((8, 8))).max() <= 2
    assert np.abs(codes[8, 8].astype(int) - [90, 128, 150]).max() > 10


def test_greys_with_a_profile_of_their_own():
    profile = bytes(imagecodecs.cms_profile("gray", gamma=1.0))
    codes = codes_of(encoded(Image.new("L", (4, 4), 128), "JPEG", icc_profile=profile, quality=100), srgb=False)
    assert codes[0, 0] == pytest.approx((188, 188, 188), abs=1)


def test_cmyk_without_a_profile_is_read_as_pillow_reads_it():
    picture = Image.new("CMYK", (8, 8), (0, 128, 255, 0))
    codes = codes_of(encoded(picture, "JPEG", quality=100))
    assert np.abs(codes.astype(int) - np.asarray(picture.convert("RGB"))).max() <= 3


def test_a_profile_for_other_colours_does_not_count():
    gray = bytes(imagecodecs.cms_profile("gray", gamma=1.0))
    codes = codes_of(encoded(Image.new("RGB", (4, 4), (128, 128, 128)), "PNG", icc_profile=gray))
    assert (codes == 128).all()


def test_a_damaged_profile_is_named():
    profile = bytearray(rgb_profile(P3))
    del profile[200:]
    with pytest.raises(PictureError, match="colours cannot be converted"):
        codes_of(encoded(Image.new("RGB", (4, 4)), "PNG", icc_profile=bytes(profile)))


def test_a_picture_that_its_file_cannot_hold_is_refused_before_memory_is_given():
    for picture in (Image.new("RGB", (4, 4)), Image.new("1", (4, 4))):
        data = bytearray(encoded(picture, "TIFF"))
        with Image.open(io.BytesIO(data)) as opened:
            entry = data.index(struct.pack("<HHL", 256, opened.tag_v2.tagtype[256], 1))
        kind = struct.unpack_from("<H", data, entry + 2)[0]
        struct.pack_into("<H" if kind == 3 else "<L", data, entry + 8, 60000)
        struct.pack_into("<H" if kind == 3 else "<L", data, entry + 20, 60000)
        with pytest.raises(PictureError, match="claims 60000 x 60000 pixels but has only"):
            codes_of(bytes(data))


@pytest.mark.filterwarnings("error")
def test_damaged_exif_is_passed_over_without_a_warning():
    data = encoded(Image.new("RGB", (8, 8), (9, 90, 200)), "JPEG", exif=b"Exif\0\0MM\0*\0\0\0\xff")
    assert codes_of(data).shape == (8, 8, 3)


def test_a_png_asks_for_memory_and_reads_its_header_once(monkeypatch):
    calls = []
    header = png.png_header
    monkeypatch.setattr(png, "png_header", lambda *given: calls.append("header") or header(*given))
    for module in (photograph, png):
        monkeypatch.setattr(module, "check_input", lambda size, *_, **__: calls.append(size))
    np.testing.assert_array_equal(codes_of(encode_png(UPRIGHT, text={})), UPRIGHT)
    assert calls == ["header", 8 * UPRIGHT.shape[0] * UPRIGHT.shape[1]]
