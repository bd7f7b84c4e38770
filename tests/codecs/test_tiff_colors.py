"""Every PhotometricInterpretation, depth and order of planes of TIFF is shown in its colours, or refused by name."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageCms

from lippmann.codecs.tiff import TiffPicture
from lippmann.errors import PictureError

y, x = np.mgrid[:6, :8]
RGB = np.stack([30 * x + 20, 40 * y + 10, 0 * x + 90], axis=-1).astype(np.uint8)


def read(path, *, in_pieces=False):
    with path.open("rb") as file:
        picture = TiffPicture(file, path)
        values = picture.read()
        assert values.dtype.name == picture.dtype
        assert values.shape[:2] == (picture.height, picture.width)
        assert picture.in_pieces == in_pieces
        return values


def written(path, values, **options):
    tifffile.imwrite(path, values, **options)
    return path


def test_white_is_zero(tmp_path):
    for codes in (RGB[..., 0], RGB[..., 0].astype(np.uint16) * 257):
        path = written(tmp_path / "a.tif", ~codes, photometric="miniswhite")
        np.testing.assert_array_equal(read(path)[..., 0], codes)


def test_palettes(tmp_path):
    picture = Image.fromarray(RGB).quantize(12)
    picture.save(tmp_path / "a.tif")
    np.testing.assert_array_equal(read(tmp_path / "a.tif"), np.asarray(picture.convert("RGB")))
    table = np.arange(3 * 16, dtype=np.uint16).reshape(3, 16) * 5  # 8 bits where there is room for 16
    path = written(
        tmp_path / "b.tif", x.astype(np.uint8), photometric="palette", colormap=np.pad(table, ((0, 0), (0, 240)))
    )
    np.testing.assert_array_equal(read(path), np.moveaxis(table[:, x], 0, -1))


@pytest.mark.parametrize("bits", [8, 16])
def test_lab_is_that_of_little_cms(tmp_path, bits):
    """The colours that LittleCMS gives for L*a*b* of D50, through Pillow."""
    srgb, space = ImageCms.createProfile("sRGB"), ImageCms.createProfile("LAB", 5000)
    picture = ImageCms.profileToProfile(Image.fromarray(RGB), srgb, space, outputMode="LAB")
    expected = np.asarray(ImageCms.profileToProfile(picture, space, srgb, outputMode="RGB"))
    coded = np.asarray(picture)  # as TIFF's of 8 bits: a* and b* are signed bytes
    lightness, signed = coded[..., :1].astype(int), coded[..., 1:].view(np.int8).astype(int)
    if bits == 8:
        lab, icc_lab = coded, np.concatenate([lightness, signed + 128], axis=-1).astype(np.uint8)
    else:
        lab = np.concatenate([lightness * 257, signed * 256], axis=-1).astype(np.uint16)
        icc_lab = np.concatenate([lightness * 256, (signed + 128) * 256], axis=-1).astype(np.uint16)
    for name, values in (("cielab", lab), ("icclab", icc_lab)):
        codes = read(written(tmp_path / f"{name}.tif", values, photometric=name)) / (257 if bits == 16 else 1)
        assert np.median(np.abs(codes - expected)) < 0.6
        assert (
            np.abs(codes - RGB).max() < 6
        )  # whole numbers of L*, a* and b* are coarse, and LittleCMS's tables more so


def test_cmyk_in_jpeg(tmp_path):
    inks = np.tile(np.array([0, 160, 230, 20], np.uint8), (32, 32, 1))
    plain = read(written(tmp_path / "a.tif", inks, photometric="separated"))
    packed = read(written(tmp_path / "b.tif", inks, photometric="separated", compression="jpeg"))
    assert np.abs(packed.astype(int) - plain).max() <= 3


def test_cmyk(tmp_path):
    inks = Image.fromarray(RGB).convert("CMYK")
    inks.save(tmp_path / "a.tif")
    expected = np.asarray(inks.convert("RGB"))
    np.testing.assert_array_equal(read(tmp_path / "a.tif"), expected)
    written(tmp_path / "b.tif", np.asarray(inks).astype(np.uint16) * 257, photometric="separated")
    np.testing.assert_array_equal(read(tmp_path / "b.tif"), expected)


def test_other_colours_are_refused_by_name(tmp_path):
    written(tmp_path / "b.tif", RGB, photometric="logluv")
    with pytest.raises(PictureError, match=r"b\.tif: its colours are LOGLUV of 8 bits; grey, RGB.*convert it to RGB"):
        read(tmp_path / "b.tif")
    written(tmp_path / "c.tif", np.zeros((4, 4), np.float32), photometric="miniswhite")
    with pytest.raises(PictureError, match="white-is-zero floats"):
        read(tmp_path / "c.tif")


def test_ycbcr_of_jpeg(tmp_path):
    smooth = np.repeat(np.repeat(RGB, 16, axis=0), 16, axis=1)
    Image.fromarray(smooth).convert("YCbCr").save(tmp_path / "a.tif", compression="jpeg", quality=95)
    with tifffile.TiffFile(tmp_path / "a.tif") as file:
        assert file.pages[0].photometric == 6
    assert np.abs(read(tmp_path / "a.tif")[8::16, 8::16].astype(int) - RGB).max() < 12


@pytest.mark.parametrize("compression", ["raw", "tiff_lzw"])
def test_ycbcr_without_jpeg(tmp_path, compression):
    coded = Image.fromarray(RGB).convert("YCbCr")
    coded.save(tmp_path / "a.tif", compression=compression)
    assert np.abs(read(tmp_path / "a.tif").astype(int) - np.asarray(coded.convert("RGB"))).max() <= 1


def test_ycbcr_of_video(tmp_path):
    """Coefficients of Rec. 709 and codes from 16 to 235, about 128: white, black, red, the latter by hand."""
    codes = np.array([[[235, 128, 128], [16, 128, 128], [63, 102, 240]]], np.uint8)
    tags = [
        (529, 5, 3, [2126, 10000, 7152, 10000, 722, 10000], True),
        (530, 3, 2, [1, 1], True),
        (532, 5, 6, [16, 1, 235, 1, 128, 1, 240, 1, 128, 1, 240, 1], True),
    ]
    path = written(tmp_path / "a.tif", codes, photometric="rgb", extratags=tags)
    data = path.read_bytes()
    before, after = struct.pack("<HHII", 262, 3, 1, 2), struct.pack("<HHII", 262, 3, 1, 6)
    assert data.count(before) == 1
    path.write_bytes(data.replace(before, after))
    assert np.abs(read(path).astype(int) - [[[255, 255, 255], [0, 0, 0], [255, 0, 0]]]).max() <= 2


def test_subsampled_ycbcr_without_jpeg_is_named(tmp_path):
    Image.fromarray(RGB).convert("YCbCr").save(tmp_path / "a.tif")
    data = (tmp_path / "a.tif").read_bytes()
    plain = struct.pack("<HHIHH", 530, 3, 2, 1, 1)
    assert data.count(plain) == 1
    (tmp_path / "a.tif").write_bytes(data.replace(plain, struct.pack("<HHIHH", 530, 3, 2, 2, 2)))
    with pytest.raises(PictureError, match="its colours are subsampled YCbCr without JPEG of 8 bits"):
        read(tmp_path / "a.tif")


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_separate_planes(tmp_path, kind):
    values = RGB.astype(kind)
    path = written(tmp_path / "a.tif", np.moveaxis(values, -1, 0), photometric="rgb", planarconfig="separate")
    np.testing.assert_array_equal(read(path), values)


@pytest.mark.parametrize("bits", [1, 2, 4, 10, 12, 14])
def test_codes_of_any_depth_reach_from_black_to_white(tmp_path, bits):
    most, wide = 2**bits - 1, 255 if bits <= 8 else 65535
    values = np.array([[0, most // 2, most, 1]], np.uint8 if bits <= 8 else np.uint16)
    if bits == 1:
        path = written(tmp_path / "a.tif", values.astype(bool), photometric="minisblack")
    else:
        path = written(tmp_path / "a.tif", values, photometric="minisblack", bitspersample=bits)
    assert read(path)[..., 0] == pytest.approx(values / most * wide, abs=0.6)


def test_one_bit_of_a_fax(tmp_path):
    black = (x + y) % 3 == 0
    Image.fromarray(~black).save(tmp_path / "a.tif", compression="group4")
    np.testing.assert_array_equal(read(tmp_path / "a.tif")[..., 0], np.where(black, 0, 255))


@pytest.mark.parametrize("kind", [np.float16, np.float64])
def test_floats_of_other_sizes(tmp_path, kind):
    values = (RGB / 16).astype(kind)
    np.testing.assert_allclose(read(written(tmp_path / "a.tif", values, photometric="rgb")), values)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_orientation(tmp_path, orientation):
    path = written(tmp_path / "a.tif", RGB, photometric="rgb", extratags=[(274, 3, 1, orientation, True)])
    with Image.open(path) as picture:
        expected = np.asarray(picture.convert("RGB"))  # turned by Pillow
    np.testing.assert_array_equal(read(path, in_pieces=orientation == 1), expected)


def test_samples_that_are_no_alpha_are_left_out(tmp_path):
    four = np.concatenate([RGB, RGB[..., :1]], axis=-1)
    path = written(tmp_path / "a.tif", four, photometric="rgb", extrasamples=["unspecified"])
    np.testing.assert_array_equal(read(path), RGB)
    path = written(tmp_path / "b.tif", four, photometric="rgb", extrasamples=["unassalpha"])
    np.testing.assert_array_equal(read(path, in_pieces=True), four)


def test_stacks_of_layers_are_refused(tmp_path):
    path = written(tmp_path / "a.tif", np.zeros((2, 2, 40), np.uint8), photometric="minisblack", planarconfig="contig")
    with pytest.raises(PictureError, match=r"holds an array of shape \(2, 2, 40\); it must be one flat picture"):
        read(path)


def test_colours_multiplied_by_alpha(tmp_path):
    values = np.array([[[40, 20, 0, 100], [0, 0, 0, 0], [9, 8, 7, 255]]], np.uint8)
    path = written(tmp_path / "a.tif", values, photometric="rgb", extrasamples=["assocalpha"])
    assert read(path).tolist() == [[[102, 51, 0, 100], [0, 0, 0, 0], [9, 8, 7, 255]]]


def test_primaries_become_a_profile(tmp_path):
    places = [0.68, 0.32, 0.265, 0.69, 0.15, 0.06]
    tags = [
        (319, 5, 6, [number for place in places for number in (round(1000 * place), 1000)], True),
        (318, 5, 2, [3127, 10000, 3290, 10000], True),
    ]
    path = written(tmp_path / "a.tif", RGB, photometric="rgb", extratags=tags)
    profile = TiffPicture(io.BytesIO(path.read_bytes()), Path("a")).icc
    assert profile[16:20] == b"RGB "
    assert (
        TiffPicture(io.BytesIO(written(tmp_path / "b.tif", RGB, photometric="rgb").read_bytes()), Path("b")).icc == b""
    )
