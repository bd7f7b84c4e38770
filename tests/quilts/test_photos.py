"""Photographs as views: their order, their orientation, what of them is shown, and in which colours."""

from __future__ import annotations

import functools
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image, ImageCms

from lippmann.codecs.icc import read_profile
from lippmann.codecs.stereo_pairs import encode_jps
from lippmann.errors import PictureError, UsageError
from lippmann.quilts.photos import Shift, natural_order, quilt_of_pair, read_photos

PAPER = (100.0, 50.0)


def save(path, codes, **options):
    Image.fromarray(np.asarray(codes, dtype=np.uint8)).save(path, **options)
    return path


def ramp(width, height):
    """Red rises from left to right, green from top to bottom, linearly from 0 to 200 between the edges."""
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    return np.stack([200 * x, 200 * y, 0 * x], axis=-1)


def ends(view):
    """Red at the left and right end, green at the top and bottom, each extrapolated to the edge."""
    red, green = view[view.shape[0] // 2, :, 0].astype(float), view[:, view.shape[1] // 2, 1].astype(float)
    at_edges = []
    for line in (red, green):
        slope = (line[-5] - line[4]) / (len(line) - 9)
        at_edges += [line[4] - 4.5 * slope, line[-5] + 4.5 * slope]
    return at_edges


def test_numbers_in_names_count_as_numbers():
    names = ["frame10.jpg", "frame2.jpg", "Frame1.jpg", "a.jpg", "frame2b3.jpg", "frame2b20.jpg"]
    ordered = ["a.jpg", "Frame1.jpg", "frame2.jpg", "frame2b3.jpg", "frame2b20.jpg", "frame10.jpg"]
    assert [path.name for path in natural_order(map(Path, names))] == ordered


@pytest.mark.parametrize(
    ("fit", "expected"),
    # Photographs of 80 x 80 on paper of 2:1. Contained, half of the width stays paper.
    [("cover", (0, 200, 50, 150)), ("stretch", (0, 200, 0, 200))],
)
def test_fit(tmp_path, fit, expected):
    paths = [save(tmp_path / f"{k}.png", ramp(80, 80)) for k in range(2)]
    photos = read_photos(paths, (120, 60), PAPER, fit=fit)
    assert ends(photos.quilt.view_values(1)) == pytest.approx(expected, abs=2)
    assert photos.cropped == ((0, 0.5) if fit == "cover" else (0, 0))


def test_one_animation_is_its_frames(tmp_path):
    first, *others = [Image.new("RGB", (8, 4), (level,) * 3) for level in (30, 90, 160)]
    for name in ("a.gif", "a.webp", "a.png"):
        first.save(tmp_path / name, save_all=True, append_images=others, lossless=True)
        quilt = read_photos([tmp_path / name], (8, 4), PAPER).quilt
        assert [quilt.view_values(k)[2, 4, 0] for k in range(quilt.layout.views)] == [30, 90, 160]


def test_a_film_of_one_view_is_its_frames(tmp_path):
    with av.open(str(tmp_path / "a.mp4"), "w") as film:
        stream = film.add_stream("libx264", rate=24)
        stream.width, stream.height, stream.pix_fmt = 64, 32, "yuv420p"
        for level in (30, 90, 160):
            codes = np.full((32, 64, 3), level, np.uint8)
            film.mux(stream.encode(av.VideoFrame.from_ndarray(codes, format="rgb24")))
        film.mux(stream.encode())
    quilt = read_photos([tmp_path / "a.mp4"], (8, 4), PAPER).quilt
    assert [quilt.view_values(k)[2, 4, 0] for k in range(quilt.layout.views)] == pytest.approx([30, 90, 160], abs=3)
    with pytest.raises(PictureError, match=r"no stereo pair.*frames of a film are views for 'interlace'"):
        quilt_of_pair(tmp_path / "a.mp4")


def test_transparent_parts_show_white_paper(tmp_path):
    for channels in (2, 4):
        codes = np.full((4, 8, channels), 100)
        codes[:, 4:, -1], codes[:, :4, -1] = 255, 0
        paths = [save(tmp_path / f"{channels}{k}.png", codes) for k in range(2)]
        view = read_photos(paths, (8, 4), PAPER).quilt.view_values(1)
        assert (view[2, 0] == 255).all()
        assert (view[2, 7] == 100).all()


def test_a_halved_pair_keeps_the_proportions_of_its_pictures(tmp_path):
    view = np.full((30, 40, 3), 90, np.uint8)
    (tmp_path / "pair.jps").write_bytes(encode_jps(view, view, half=False))
    pair = quilt_of_pair(tmp_path / "pair.jps", half=True)
    assert (pair.view_size, pair.layout.aspect) == ((20, 30), pytest.approx(4 / 3))


def test_contain_leaves_white_paper_on_both_sides(tmp_path):
    paths = [save(tmp_path / f"{k}.png", ramp(80, 80)) for k in range(2)]
    view = read_photos(paths, (120, 60), PAPER, fit="contain").quilt.view_values(0)
    assert (view[:, :30] == 255).all()
    assert (view[:, 90:] == 255).all()
    assert ends(view[:, 30:90]) == pytest.approx((0, 200, 0, 200), abs=2)


@pytest.mark.parametrize("shift", [Shift(4, "px"), Shift(-4, "px"), Shift(5, "mm")])
@pytest.mark.parametrize("fit", ["cover", "stretch"])
def test_a_plane_that_moves_against_the_shift_stands_still(tmp_path, shift, fit):
    # On paper of 100 mm, 5 mm are a twentieth of the window, which is 80 px less two steps: 80/22 px.
    step = shift.amount if shift.unit == "px" else 80 / 22
    paths = []
    for number in range(3):
        moved = ramp(80, 40) - [200 * step * (1 - number) / 80, 0, -0.0]  # things lie step px farther left each time
        paths.append(save(tmp_path / f"{number}.png", np.clip(moved + 20, 0, 255)))
    photos = read_photos(paths, (200, 100), PAPER, fit=fit, shift=shift)
    reds = [photos.quilt.view_values(number)[20, 100, 0] for number in range(3)]
    assert np.ptp(np.asarray(reds, dtype=int)) <= 2
    assert photos.cropped[0] == pytest.approx(abs(step) * 2 / 80)


def test_a_shift_beyond_the_photographs_is_refused(tmp_path):
    paths = [save(tmp_path / f"{k}.png", ramp(80, 40)) for k in range(3)]
    with pytest.raises(UsageError, match="too far"):
        read_photos(paths, (20, 10), PAPER, shift=Shift(40, "px"))


def test_sizes_differ_only_where_a_fit_is_asked_for(tmp_path):
    paths = [save(tmp_path / "1.png", ramp(80, 40)), save(tmp_path / "2.png", ramp(160, 80))]
    with pytest.raises(PictureError, match=r"2\.png: has 160 x 80 pixels; 1\.png has 80 x 40"):
        read_photos(paths, (40, 20), PAPER)
    quilt = read_photos(paths, (40, 20), PAPER, fit="cover").quilt
    assert np.abs(quilt.view_values(0).astype(int) - quilt.view_values(1)).max() <= 3


def test_exif_orientation_is_obeyed(tmp_path):
    exif = Image.Exif()
    exif[0x112] = 6  # to be turned to the right: the camera stood upright
    lying = np.rot90(ramp(80, 40), 1)
    paths = [save(tmp_path / f"{k}.png", lying, exif=exif) for k in range(2)]
    assert ends(read_photos(paths, (80, 40), PAPER).quilt.view_values(0)) == pytest.approx((0, 200, 0, 200), abs=2)


def test_only_the_first_picture_of_a_file_is_shown_with_a_note(tmp_path):
    first, second = (Image.new("RGB", (80, 40), color) for color in ("red", "blue"))
    first.save(tmp_path / "1.webp", save_all=True, append_images=[second])
    photos = read_photos([tmp_path / "1.webp"] * 2, (20, 10), PAPER)
    assert photos.notes == ("1.webp: it holds 2 pictures: the first is shown",)


def test_greys_of_16_bits_are_not_clipped(tmp_path):
    Image.fromarray(np.full((40, 80), 32768, np.uint16)).save(tmp_path / "1.png")
    photos = read_photos([tmp_path / "1.png"] * 2, (20, 10), PAPER)
    assert (photos.quilt.values == 128).all()


# Once: a profile holds the second in which it was made.
@functools.cache
def profile(gamma):
    """An RGB profile with sRGB's primaries and the curve of a power."""
    data = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    for k in range(int.from_bytes(data[128:132], "big")):
        entry = 132 + 12 * k
        if data[entry : entry + 4] in (b"rTRC", b"gTRC", b"bTRC"):
            start = int.from_bytes(data[entry + 4 : entry + 8], "big")
            # A curve of type 0, Y = X^gamma, over sRGB's parametric one of type 3, which is longer.
            assert data[start : start + 4] == b"para"
            data[start + 8 : start + 10] = (0).to_bytes(2, "big")
            data[start + 12 : start + 16] = round(gamma * 65536).to_bytes(4, "big")
    return bytes(data)


def test_one_profile_is_kept_and_several_become_srgb(tmp_path):
    codes = np.full((40, 80, 3), 128)
    one = [save(tmp_path / f"{k}.png", codes, icc_profile=profile(1.0)) for k in range(2)]
    kept = read_photos(one, (20, 10), PAPER)
    assert kept.icc == profile(1.0)
    assert (kept.quilt.values == 128).all()
    mixed = read_photos([one[0], save(tmp_path / "plain.png", codes)], (20, 10), PAPER)
    assert mixed.icc == b""
    assert mixed.quilt.view_values(0)[0, 0] == pytest.approx(188, abs=1)  # linear 128/255 as sRGB
    assert (mixed.quilt.view_values(1) == 128).all()
    (tmp_path / "flat.icc").write_bytes(profile(1.0))
    asked = read_photos([tmp_path / "plain.png"] * 2, (20, 10), PAPER, profile=read_profile(tmp_path / "flat.icc"))
    assert asked.icc == profile(1.0)
    assert asked.quilt.values[0, 0] == pytest.approx(55, abs=1)  # sRGB 128/255 as linear light


def test_what_is_no_photograph_is_named(tmp_path):
    (tmp_path / "2.jpg").write_text("no picture")
    first = save(tmp_path / "1.jpg", ramp(80, 40))
    with pytest.raises(PictureError, match=r"2\.jpg: is no picture"):
        read_photos([first, tmp_path / "2.jpg"], (20, 10), PAPER)
    with pytest.raises(PictureError, match=r"3\.jpg: no such file"):
        read_photos([first, tmp_path / "3.jpg"], (20, 10), PAPER)
    with pytest.raises(UsageError, match="at least 2"):
        read_photos([first], (20, 10), PAPER)
