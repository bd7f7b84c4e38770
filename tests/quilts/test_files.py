"""Quilts as files and as folders of views."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image, features

from lippmann.codecs.icc import rgb_profile
from lippmann.color.primaries import REC709
from lippmann.errors import OutputError, PictureError
from lippmann.image import PictureFile, encoding
from lippmann.quilts import files as quilt_files
from lippmann.quilts.files import ending_of_views, is_quilt, read_film, read_quilt, read_views, write_quilt, write_views
from lippmann.quilts.quilt import Quilt, QuiltLayout
from lippmann.viewing.stereo import write_pair

LAYOUT = QuiltLayout(8, 6, 0.75)
SIZE = (48, 64)


def codes_of(number, size=SIZE):
    """A view of 8-bit codes unlike all others; the corners tell it from its mirror images."""
    picture = np.random.default_rng(number).integers(0, 256, (size[1], size[0], 3)).astype(np.uint8)
    picture[:4, :4] = (number, 0, 255)
    return picture


@pytest.fixture
def folder(tmp_path):
    """48 views, numbered from 0."""
    made = tmp_path / "views"
    made.mkdir()
    for number in range(LAYOUT.views):
        Image.fromarray(codes_of(number)).save(made / f"shot2_{number:03}.png")
    return made


def test_the_leftmost_view_is_at_the_bottom_left(folder, tmp_path):
    path = tmp_path / "teapot_qs8x6a0.75.png"
    write_quilt(read_views(folder, LAYOUT), path)
    written = np.asarray(Image.open(path))
    assert written.shape == (6 * 64, 8 * 48, 3)
    assert written.dtype == np.uint8
    np.testing.assert_array_equal(written[-64:, :48], codes_of(0))
    np.testing.assert_array_equal(written[-64:, 48:96], codes_of(1))
    np.testing.assert_array_equal(written[-128:-64, :48], codes_of(8))
    np.testing.assert_array_equal(written[:64, -48:], codes_of(47))


def test_round_trips_are_exact(folder, tmp_path):
    path = tmp_path / "a_qs8x6a0.75.png"
    write_quilt(read_views(folder, LAYOUT), path)
    write_views(read_quilt(path), tmp_path / "again")
    for number in range(LAYOUT.views):
        again = np.asarray(Image.open(tmp_path / "again" / f"view_{number:02}.png"))
        np.testing.assert_array_equal(again, codes_of(number))
    write_quilt(read_views(tmp_path / "again", LAYOUT), tmp_path / "b_qs8x6a0.75.png")
    np.testing.assert_array_equal(Image.open(tmp_path / "b_qs8x6a0.75.png"), Image.open(path))


@pytest.mark.parametrize("ending", [".exr", ".tif"])
def test_values_stay_what_they_are_in_other_formats(tmp_path, ending):
    pixels = np.random.default_rng(0).uniform(0, 3, (256, 256, 3)).astype(np.float32)
    bits = 32
    path = tmp_path / f"x_qs4x2{ending}"
    write_quilt(Quilt(pixels, QuiltLayout(4, 2, None)), path, bits=bits)
    read = read_quilt(path)
    np.testing.assert_array_equal(read.pixels, pixels)
    write_views(read, tmp_path / "views")
    np.testing.assert_array_equal(read_views(tmp_path / "views", QuiltLayout(4, 2, None)).pixels, pixels)


def test_jpegs_of_others_are_read(tmp_path):
    path = tmp_path / "x_qs4x2a2.jpg"
    Image.new("RGB", (512, 256), (200, 100, 50)).save(path, quality=95)
    quilt = read_quilt(path)
    assert quilt.stored == "uint8"
    assert quilt.pixels[0, 0] == pytest.approx([0.578, 0.127, 0.032], abs=0.02)


@pytest.mark.skipif(not features.check("avif"), reason="this Pillow reads no AVIF")
def test_what_a_decoder_says_of_damage_is_one_line(tmp_path):
    path = tmp_path / "x_qs4x2a2.avif"
    Image.new("RGB", (512, 256), (200, 100, 50)).save(path)
    data = path.read_bytes()
    start = data.index(b"mdat") + 4
    path.write_bytes(data[:start] + bytes(len(data) - start))
    with pytest.raises(PictureError, match=r"x_qs4x2a2\.avif: cannot be read \(.*[Dd]ecod"):
        read_quilt(path)
    path.write_bytes(b"no picture")
    with pytest.raises(PictureError, match=r"x_qs4x2a2\.avif: is no picture that is read here; PNG, JPEG"):
        read_quilt(path)


@pytest.mark.parametrize(
    ("mode", "color", "code"),
    [("RGBA", (200, 100, 50, 255), 100), ("L", 100, 100), ("P", 3, 7), ("I;16", 25700, 25700)],
)
def test_kinds_of_pixels(tmp_path, mode, color, code):
    picture = Image.new(mode, (512, 256), color)
    if mode == "P":
        picture.putpalette([7] * 768)
    picture.save(tmp_path / "x_qs4x2a2.png")
    assert read_quilt(tmp_path / "x_qs4x2a2.png").values[0, 0, 1] == code


@pytest.mark.parametrize("ending", ["png", "webp", "tga"])
def test_transparent_parts_lie_on_black(tmp_path, ending):
    picture = Image.new("RGBA", (512, 256), (200, 100, 50, 51))
    picture.paste((200, 100, 50, 255), (0, 0, 256, 256))
    picture.save(tmp_path / f"x_qs4x2a2.{ending}", lossless=True)
    values = read_quilt(tmp_path / f"x_qs4x2a2.{ending}").values
    assert values[0, [0, 256]].tolist() == [[200, 100, 50], [40, 20, 10]]


def test_frames_of_a_film_become_a_quilt(tmp_path):
    path = tmp_path / "orbit.mp4"
    with av.open(str(path), "w") as film:
        stream = film.add_stream("libx264", rate=24)
        stream.width, stream.height, stream.pix_fmt = 96, 128, "yuv420p"
        for number in range(13):
            codes = np.full((128, 96, 3), 20 * number, np.uint8)
            film.mux(stream.encode(av.VideoFrame.from_ndarray(codes, format="rgb24")))
        film.mux(stream.encode())
    assert ending_of_views(path) == "_qs4x3a0.75"  # one of the thirteen is left out
    quilt = read_film(path, QuiltLayout(2, 2, 0.75))
    assert [int(quilt.view_values(number)[60, 40, 0]) for number in range(4)] == pytest.approx([0, 80, 160, 240], abs=3)
    assert quilt.notes == ("of the film's 13 frames 4 are shown, evenly spaced",)
    with pytest.raises(PictureError, match=r"orbit.mp4: it holds 13 frames; 8x6 views are 48"):
        read_film(path, QuiltLayout(8, 6, 0.75))


def test_other_formats_are_named(tmp_path):
    Image.new("RGB", (512, 256)).save(tmp_path / "x_qs4x2a2.jp2")
    with pytest.raises(PictureError, match=r"unknown ending '\.jp2'"):
        read_quilt(tmp_path / "x_qs4x2a2.jp2")
    with pytest.raises(PictureError, match="views: no such file"):
        read_quilt(tmp_path / "views")
    with pytest.raises(PictureError, match="is a film; pictures are read; take a quilt out of it"):
        read_quilt(tmp_path / "x_qs4x2a2.m4v")


@pytest.mark.parametrize("ending", ["bmp", "ppm", "gif", "tga"])
def test_quilts_of_older_formats_are_read(tmp_path, ending):
    codes = np.random.default_rng(1).choice(np.array([0, 90, 255], np.uint8), (256, 512, 3))
    Image.fromarray(codes).save(tmp_path / f"x_qs4x2a2.{ending}")
    np.testing.assert_array_equal(read_quilt(tmp_path / f"x_qs4x2a2.{ending}").values, codes)


def test_four_views_of_leia_begin_at_the_top_left(tmp_path):
    picture = Image.new("RGB", (512, 256))
    for number in range(4):
        picture.paste((number, 0, 0), (number % 2 * 256, number // 2 * 128, 512, 256))
    picture.save(tmp_path / "photo_2x2.png")
    quilt = read_quilt(tmp_path / "photo_2x2.png")
    assert is_quilt(tmp_path / "photo_2x2.png")
    assert quilt.layout == (2, 2, 2.0)
    assert [quilt.view_values(number)[0, 0, 0] for number in range(4)] == [0, 1, 2, 3]
    asked = read_quilt(tmp_path / "photo_2x2.png", QuiltLayout(2, 2, 2.0))
    assert [asked.view_values(number)[0, 0, 0] for number in range(4)] == [2, 3, 0, 1]
    pair = read_quilt(tmp_path / "photo_2x2.png", QuiltLayout(1, 2, None))  # one above the other, the left one on top
    assert [pair.view_values(number)[0, 0, 0] for number in range(2)] == [0, 2]


def test_webp_quilts_are_read(tmp_path):
    codes = np.random.default_rng(1).integers(0, 256, (256, 512, 3)).astype(np.uint8)
    Image.fromarray(codes).save(tmp_path / "x_qs4x2a2.webp", lossless=True)
    np.testing.assert_array_equal(read_quilt(tmp_path / "x_qs4x2a2.webp").values, codes)


def test_a_quilt_that_lies_on_its_side_is_turned_upright(tmp_path):
    exif = Image.Exif()
    exif[0x0112] = 6
    codes = np.random.default_rng(1).integers(0, 256, (256, 512, 3)).astype(np.uint8)
    Image.fromarray(np.rot90(codes).copy()).save(tmp_path / "x_qs4x2a2.png", exif=exif)
    np.testing.assert_array_equal(read_quilt(tmp_path / "x_qs4x2a2.png").values, codes)


def test_jpegs_are_not_written(folder, tmp_path):
    with pytest.raises(OutputError, match=r"unknown ending '\.jpg'"):
        write_quilt(read_views(folder, LAYOUT), tmp_path / "x_qs8x6a0.75.jpg")


def test_a_file_whose_size_disagrees_with_its_name_is_refused(tmp_path):
    path = tmp_path / "x_qs8x6a0.75.png"
    Image.new("RGB", (400, 388)).save(path)
    with pytest.raises(PictureError, match=r"x_qs8x6a0\.75\.png: it is 388 pixels high"):
        read_quilt(path)


def test_a_size_that_disagrees_is_refused_before_the_pixels_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr(PictureFile, "decode", None)
    for ending in ("png", "jpg", "tif"):
        path = tmp_path / f"x_qs8x6a0.75.{ending}"
        Image.new("RGB", (400, 388)).save(path)
        with pytest.raises(PictureError, match="it is 388 pixels high"):
            read_quilt(path)


@pytest.mark.parametrize(("bits", "stored"), [(8, "uint8"), (16, "uint16"), (32, "float32")])
def test_a_quilt_is_held_as_it_is_stored(tmp_path, bits, stored):
    pixels = np.random.default_rng(1).uniform(0, 1, (256, 256, 3)).astype(np.float32)
    path = tmp_path / "x_qs4x2.tif"
    write_quilt(Quilt(pixels, QuiltLayout(4, 2, None)), path, bits=bits)
    quilt = read_quilt(path)
    assert (quilt.values.dtype, quilt.stored) == (stored, stored)
    np.testing.assert_allclose(quilt.pixels, pixels, atol=2.0 / 2**bits)
    write_views(quilt, tmp_path / "views", format="tiff", bits=bits)
    packed = read_views(tmp_path / "views", quilt.layout)
    assert packed.values.dtype == stored
    np.testing.assert_array_equal(packed.values, quilt.values)


@pytest.mark.parametrize("deep_view", [0, 5, 47])
def test_views_of_several_depths_become_linear(folder, deep_view):
    deep = encoding.stored_values(np.full((64, 48, 3), 0.25, np.float32), "uint16", "srgb")
    encoding.encode_values(folder / f"shot2_{deep_view:03}.png", "png", {"": deep}, transfer="srgb")
    quilt = read_views(folder, LAYOUT)
    assert (quilt.values.dtype, quilt.stored) == ("float32", "float32")
    for number in range(LAYOUT.views):
        expected = 0.25 if number == deep_view else encoding.linear_values(codes_of(number), "srgb")
        np.testing.assert_allclose(quilt.view(number), expected, atol=1e-4 if number == deep_view else 0)


@pytest.mark.parametrize("ending", [".png", ".jpg", ".tif"])
def test_views_that_lie_are_turned_upright(tmp_path, ending):
    exif = Image.Exif()
    exif[0x112] = 6
    upright = np.zeros((32, 48, 3), np.uint8)
    upright[:16] = 40, 80, 230
    for number in range(2):
        Image.fromarray(np.rot90(upright).copy()).save(tmp_path / f"v{number}{ending}", exif=exif, quality=95)
    quilt = read_views(tmp_path)
    assert quilt.view_size == (48, 32)
    assert np.abs(quilt.view_values(1).astype(int) - upright).max() < 40
    assert np.abs(quilt.view_values(1).astype(int) - upright)[:12].max() < 8


def test_what_views_hold_and_do_not_show_is_noted(tmp_path):
    for number in range(3):
        Image.new("RGB", (8, 8)).save(tmp_path / f"v{number}.jpg", dpi=(100, 200 if number else 100))
    assert read_views(tmp_path).notes == ("v1.jpg: its pixels are 2 times as wide as high: they are shown square",)


def test_views_of_another_colour_space_become_srgb(tmp_path):
    linear = rgb_profile(REC709, 1.0)
    for number, options in enumerate(({"icc_profile": linear}, {})):
        Image.new("RGB", (8, 8), (128, 128, 128)).save(tmp_path / f"v{number}.png", **options)
    quilt = read_views(tmp_path)
    assert quilt.view_values(0)[0, 0] == pytest.approx(188, abs=1)
    assert (quilt.view_values(1) == 128).all()


@pytest.mark.parametrize("ending", [".png", ".jpg", ".tif"])
def test_every_view_is_opened_once(tmp_path, monkeypatch, ending):
    made = tmp_path / "views"
    made.mkdir()
    for number in range(3):
        Image.fromarray(codes_of(number)).save(made / f"{number}{ending}")
    opened = []

    def counted(function):
        return lambda *given: (
            opened.append(next(one.name for one in given if isinstance(one, Path))),
            function(*given),
        )[1]

    monkeypatch.setattr(quilt_files, "open_file", counted(quilt_files.open_file))
    monkeypatch.setattr(quilt_files, "open_photograph", counted(quilt_files.open_photograph))
    assert read_views(made).layout.views == 3
    assert opened == [f"{number}{ending}" for number in range(3)]


def test_more_than_can_be_held_is_refused_before_it_is_read(folder, monkeypatch):
    monkeypatch.setattr(quilt_files, "MOST_PIXELS", 48 * 64 * 47)
    monkeypatch.setattr(PictureFile, "decode", None)
    with pytest.raises(PictureError, match="it holds 48 views of 48 x 64 pixels; together they have at most 144384"):
        read_views(folder)


def test_values_that_are_not_finite_are_not_written(tmp_path):
    quilt = Quilt(np.full((384, 384, 3), np.nan, dtype=np.float32), LAYOUT)
    with pytest.raises(PictureError, match="not finite"):
        write_quilt(quilt, tmp_path / "x_qs8x6a0.75.png")


def test_a_quilt_is_not_written_under_another_s_name(tmp_path):
    quilt = Quilt(np.zeros((384, 384, 3), dtype=np.float32), LAYOUT)
    with pytest.raises(PictureError, match="the name says 6x8; the quilt has 8x6 views"):
        write_quilt(quilt, tmp_path / "x_qs6x8a0.75.png")


# ---- Folders ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("first", "notes"), [(1, ()), (1021, ("views are numbered from 1021: that is the leftmost",))])
def test_views_may_be_numbered_from_any_number(first, notes, folder, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    (other / "notes.txt").write_text("no view")
    for number in range(LAYOUT.views):
        (folder / f"shot2_{number:03}.png").rename(other / f"v{number + first}.png")
    np.testing.assert_array_equal(
        read_views(other, LAYOUT).view(11), read_views(other).view(11), "in a grid and in a row"
    )
    assert read_views(other).layout == (48, 1, None)
    assert read_views(other).notes == notes
    write_views(read_views(other), tmp_path / "out")
    np.testing.assert_array_equal(Image.open(tmp_path / "out" / "view_11.png"), codes_of(11))


def test_of_a_grid_of_cameras_the_middle_row_is_taken(tmp_path):
    for row in range(3):
        for column in range(4):
            Image.new("RGB", (8, 8), (row, column, 0)).save(tmp_path / f"out_{row:02}_{column:02}.png")
    Image.new("RGB", (512, 256)).save(tmp_path / "all_qs4x3a1.png")  # no view
    found = read_views(tmp_path)
    assert [tuple(found.view_values(view)[0, 0]) for view in range(4)] == [(1, column, 0) for column in range(4)]
    assert found.notes == ("of 3 rows of cameras the middle one is taken: the views of a quilt stand side by side",)


def test_an_absent_view_is_named(folder):
    (folder / "shot2_017.png").unlink()
    with pytest.raises(PictureError, match="view 17 is missing; views run to 47"):
        read_views(folder)


def test_a_missing_end_is_counted(folder):
    (folder / "shot2_047.png").unlink()
    with pytest.raises(PictureError, match="it holds 47 views; 8x6 views are 48"):
        read_views(folder, LAYOUT)


def test_a_view_of_another_size_is_named(folder):
    Image.fromarray(codes_of(5, (48, 63))).save(folder / "shot2_005.png")
    with pytest.raises(PictureError, match=r"shot2_005\.png: has 48 x 63 pixels.*has 48 x 64"):
        read_views(folder, LAYOUT)


def test_a_damaged_view_is_named(folder):
    (folder / "shot2_005.png").write_bytes(b"no picture")
    with pytest.raises(PictureError, match=r"shot2_005\.png"):
        read_views(folder, LAYOUT)
    (folder / "shot2_005.png").rename(folder / "shot2_005.jpg")
    with pytest.raises(PictureError, match=r"shot2_005\.jpg: is no picture"):
        read_views(folder, LAYOUT)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ([], "there are no views"),
        (["a.png"], "the name has no number"),
        (["a_0.png", "b_0.png"], r"b_0\.png: is the same view as a_0\.png"),
        (["a_0.png", "lippmann.json"], "a folder of integral views"),
    ],
)
def test_folders_that_leave_the_order_open_are_refused(names, said, tmp_path):
    for name in names:
        (tmp_path / name).write_bytes(b"")
    with pytest.raises(PictureError, match=said):
        read_views(tmp_path)


def test_an_absent_folder_is_said(tmp_path):
    with pytest.raises(PictureError, match="absent: no such file"):
        read_views(tmp_path / "absent")


def test_unknown_formats_are_refused(folder, tmp_path):
    quilt = read_views(folder, LAYOUT)
    with pytest.raises(OutputError, match="unknown format 'jpeg'"):
        write_views(quilt, tmp_path / "out", format="jpeg")
    assert not (tmp_path / "out").exists()


def test_large_jpegs_are_read_without_a_warning(tmp_path, monkeypatch):
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 10_000)
    path = tmp_path / "x_qs4x2a2.jpg"
    Image.new("RGB", (512, 256)).save(path)
    assert read_quilt(path).view_size == (128, 128)
    assert Image.MAX_IMAGE_PIXELS == 10_000


@pytest.fixture
def pair(tmp_path):
    """A stereo pair that Pillow wrote, and its left and right view."""
    views = np.kron(np.random.default_rng(5).integers(0, 256, (2, 32, 40, 3)), np.ones((1, 8, 8, 1))).astype(np.uint8)
    left, right = (Image.fromarray(view) for view in views)
    path = tmp_path / "pair.mpo"
    left.save(path, save_all=True, append_images=[right], quality=95, subsampling=0)
    return path, views


def test_a_pair_in_one_file_is_a_quilt_of_two_views(pair):
    path, views = pair
    assert is_quilt(path)
    quilt = read_quilt(path)
    assert quilt.layout == QuiltLayout(2, 1, None)
    for number, view in enumerate(views):
        assert np.abs(quilt.view_values(number).astype(int) - view).mean() < 4


def test_a_crossed_pair_is_turned_round(pair, tmp_path):
    _, views = pair
    codes = np.concatenate(list(views), axis=1) / np.float32(255)
    write_pair(codes.astype(np.float32), tmp_path / "pair.jps", "full", "linear")
    quilt = read_quilt(tmp_path / "pair.jps")
    # The file itself has the right eye's picture on the left.
    crossed = np.asarray(Image.open(tmp_path / "pair.jps"))
    assert np.abs(crossed[:, :320].astype(int) - views[1]).mean() < 4
    assert np.abs(quilt.view_values(0).astype(int) - views[0]).mean() < 4


def test_two_pictures_that_nothing_calls_a_pair_are_none(tmp_path):
    pillow_heif = pytest.importorskip("pillow_heif")
    file = pillow_heif.from_pillow(Image.new("RGB", (320, 256)))
    file.add_from_pillow(Image.new("RGB", (320, 256)))
    file.save(tmp_path / "two.heic")
    with pytest.raises(PictureError, match=r"two\.heic: holds no stereo pair; a pair is two views"):
        read_quilt(tmp_path / "two.heic")
