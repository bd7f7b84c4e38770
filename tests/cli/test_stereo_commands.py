"""``lippmann replay`` for two eyes: side by side, as an anaglyph, along a sweep and a head path."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from lippmann.image import read_picture
from lippmann.image.write import write_plain_picture
from lippmann.viewing.stereo import replay_stereo


def pixels(path):
    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB"))


@pytest.mark.parametrize(("sbs", "size"), [("full", (80, 40)), ("half", (40, 40))])
def test_side_by_side(lippmann, picture, tmp_path, sbs, size):
    out = tmp_path / "pair.png"
    words = ("replay", picture, "--sbs", sbs, "--eye", "5,0,700", "--eyes", 60, "--size", "40x40", "-o", out)
    done = lippmann(*words, "--json")
    assert done.code == 0
    assert (done.json["stereo"], done.json["eyes"]) == (sbs, 60)
    assert pixels(out).shape[1::-1] == size
    same = replay_stereo(read_picture(picture), (5, 0, 700), stereo=sbs, eyes=60, size=(40, 40))
    write_plain_picture(same, tmp_path / "same.png")
    np.testing.assert_array_equal(pixels(out), pixels(tmp_path / "same.png"))
    assert "by two eyes 60 mm apart" in lippmann(*words).out


def test_an_anaglyph_has_the_size_of_one_picture(lippmann, picture, tmp_path):
    out = tmp_path / "glasses.png"
    assert lippmann("replay", picture, "--anaglyph", "--size", "40x30", "-o", out).code == 0
    one = tmp_path / "one.png"
    assert lippmann("replay", picture, "--size", "40x30", "-o", one).code == 0
    assert pixels(out).shape == pixels(one).shape
    assert (pixels(out) != pixels(one)).any()


def test_pairs_along_a_sweep_and_a_head_path(lippmann, picture, tmp_path):
    out = tmp_path / "pairs.png"
    words = ("--sbs", "full", "--size", "20x10", "-o", out, "--json")
    done = lippmann("replay", picture, "--sweep", "--frames", 3, *words)
    assert done.json["frames"] == 3
    with Image.open(out) as animation:
        assert (animation.n_frames, animation.size) == (3, (40, 10))
    path = tmp_path / "path.csv"
    path.write_text("-20,0,700\n20,10,650\n")
    done = lippmann("replay", picture, "--path", path, *words)
    assert done.json["start"] == [-20, 0, 700]
    assert done.json["stop"] == [20, 10, 650]
    with Image.open(out) as animation:
        assert animation.n_frames == 2


@pytest.mark.parametrize(("codec", "name"), [("hevc", "hevc"), ("av1", "av1")])
def test_a_sweep_in_another_codec(lippmann, picture, tmp_path, codec, name):
    import av

    out = tmp_path / "pairs.mp4"
    words = ("--sweep", "--frames", 2, "--sbs", "half", "--size", "64x48", "-o", out)
    assert lippmann("replay", picture, "--codec", codec, *words).code == 0
    with av.open(str(out)) as video:
        assert video.streams.video[0].codec_context.codec.canonical_name == name


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--sbs", "full", "--anaglyph"), "--anaglyph: a picture is one or the other"),
        (("--eyes", "60"), "--eyes: there is one eye"),
        (("--anaglyph", "--eyes", "-1"), "--eyes: -1 mm is out of range"),
        (("--sbs", "wide"), "'wide'"),
        (("--codec", "av1"), "--codec: applies to an animation only"),
        (("--codec", "av1", "--sweep"), "--codec: only MP4 has a choice of codecs"),
        (("--path", "none.csv"), "none.csv: no such file"),
        (("--path", "none.csv", "--sweep"), "--path: the path says where the eye is"),
        (("--path", "none.csv", "--sweep-width", "9"), "--sweep-width: applies to a sweep only"),
        (("--frames", "9"), "--frames: applies to a sweep only"),
        (("--sweep", "--bits", "16"), "--bits: 16; animations have 8"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(lippmann, picture, tmp_path, words, said):
    done = lippmann("replay", picture, *words, "-o", tmp_path / "pair.png")
    assert done.code == 2
    assert said in done.err
    assert done.err.count("\n") == 1 or "'wide'" in said
    assert not (tmp_path / "pair.png").exists()


def test_colour_beside_depth(lippmann, picture, tmp_path):
    image = read_picture(picture)
    depth = np.full(image.pixels.shape[:2], -5.0, np.float32)
    depth[:, : depth.shape[1] // 2] = 8.0
    image.with_pixels(image.pixels, maps={"depth": depth}).save(tmp_path / "deep.exr")
    done = lippmann(
        "replay", tmp_path / "deep.exr", "--rgbd", "half", "--white", "far", "-o", tmp_path / "a.png", "--json"
    )
    assert done.code == 0, done.err
    assert done.json["output"] == str(tmp_path / "a_rgbd-half-far.png")
    codes = pixels(tmp_path / "a_rgbd-half-far.png")
    middle = codes[len(codes) // 2, codes.shape[1] // 2 :, 0]
    assert (middle[2], middle[-3]) == (0, 255)  # nearer on the left


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--rgbd", "full", "--sweep"), "--sweep: does not apply to --rgbd"),
        (("--white", "far"), "--white: applies to --rgbd only"),
        (("--rgbd", "full"), "teapot.png: has no depth; that is one of its layers"),
        (("--rgbd", "full", "-o", "a.exr"), "unknown ending '.exr'; known are .png, .tif, .tiff"),
        (("--rgbd", "depth", "--white", "far"), "--white: cannot be; depth alone is distance"),
        (("--rgbd", "half", "-o", "a_rgbd.png"), "the name says another form; this one's ends in _rgbd-half"),
    ],
)
def test_depth_that_cannot_be(lippmann, picture, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    done = lippmann("replay", picture, *words)
    assert done.code == 2
    assert message in done.err
    assert done.err.count("\n") == 1


def test_a_pair_goes_out_and_comes_back_in(lippmann, picture, tmp_path):
    """JPS and MPO of what two eyes see hold the same, and are two photographs of a print."""
    words = ("replay", picture, "--sbs", "full", "--eyes", 60, "--size", "40x40")
    assert lippmann(*words, "-o", tmp_path / "plain.png").code == 0
    left, right = np.split(pixels(tmp_path / "plain.png").astype(int), 2, axis=1)
    for name in ("pair.jps", "pair.mpo"):
        done = lippmann(*words, "-o", tmp_path / name)
        assert done.code == 0, done.err
    crossed = pixels(tmp_path / "pair.jps").astype(int)
    assert np.abs(crossed - np.concatenate([right, left], axis=1)).mean() < 3
    assert np.abs(pixels(tmp_path / "pair.mpo") - left).mean() < 3
    for name in ("pair.jps", "pair.mpo"):
        words = ("interlace", tmp_path / name, "--display", "seed-lenticular", "-o", tmp_path / f"{name}.png")
        done = lippmann(*words)
        assert done.code == 0, done.err
        assert "2 photographs" in done.out
    one, other = (pixels(tmp_path / f"pair.{kind}.png").astype(int) for kind in ("jps", "mpo"))
    assert np.abs(one - other).mean() < 3


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("-o", "a.jps"), "a.jps: is for two eyes"),
        (("--anaglyph", "-o", "a.mpo"), "'anaglyph' as .mpo; MPO files hold two whole pictures"),
        (("--sbs", "half", "-o", "a.mpo"), "'half' as .mpo; MPO files hold two whole pictures"),
    ],
)
def test_pairs_that_cannot_be(lippmann, picture, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    done = lippmann("replay", picture, "--size", "40x40", *words)
    assert done.code == 2
    assert message in done.err
    assert done.err.count("\n") == 1
    assert not list(tmp_path.iterdir())
