import dataclasses
import os
import threading
import weakref
from contextlib import suppress
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image, ImageSequence

from lippmann.color.transfer import quantize
from lippmann.errors import OutputError, UsageError
from lippmann.quilts.quilt import QuiltLayout
from lippmann.quilts.quilt_metadata import metadata_of_text
from lippmann.viewing import mp4_film, video_file
from lippmann.viewing.video_file import check_animation_path, write_animation, write_codes


def frames(count=5, height=24, width=32):
    """A bright column that moves to the right over a ramp."""
    base = np.linspace(0, 0.5, height * width * 3, dtype=np.float32).reshape(height, width, 3)
    for k in range(count):
        frame = base.copy()
        frame[:, 4 * k : 4 * k + 4] = (1, 0.2, 0)
        yield frame


@pytest.mark.parametrize("name", ["a.png", "a.apng"])
def test_apng_is_exact(tmp_path, name):
    write_animation(frames(), tmp_path / name, frames_per_second=20)
    with Image.open(tmp_path / name) as animation:
        assert animation.n_frames == 5
        assert animation.info["loop"] == 0
        for shown, frame in zip(ImageSequence.Iterator(animation), frames(), strict=True):
            assert shown.info["duration"] == 50
            np.testing.assert_array_equal(np.asarray(shown.convert("RGB")), quantize(frame, 8, "srgb"))


@pytest.mark.parametrize(
    ("codec", "name", "tag"),
    [(None, "h264", "avc1"), ("h264", "h264", "avc1"), ("hevc", "hevc", "hvc1"), ("av1", "av1", "av01")],
)
def test_mp4_is_close(tmp_path, capfd, codec, name, tag):
    write_animation(frames(7, 63, 49), tmp_path / "a.mp4", frames_per_second=25, codec=codec)
    assert capfd.readouterr() == ("", "")
    with av.open(str(tmp_path / "a.mp4")) as video:
        stream = video.streams.video[0]
        assert (stream.codec_context.codec.canonical_name, stream.codec_context.codec_tag) == (name, tag)
        assert stream.average_rate == 25
        shown = [frame.to_ndarray(format="rgb24", src_colorspace="ITU709") for frame in video.decode(stream)]
    assert len(shown) == 7
    for codes, frame in zip(shown, frames(7, 63, 49), strict=True):
        assert codes.shape == (64, 50, 3)
        difference = codes[:63, :49].astype(float) - quantize(frame, 8, "srgb")
        # Halved colour resolution blurs the edges of the column; the rest is near.
        assert np.median(np.abs(difference)) <= 3
        assert np.abs(difference.mean(axis=(0, 1))).max() < 4


@pytest.mark.parametrize("codec", ["h264", "hevc", "vp9", "av1"])
def test_depth_beside_colour_comes_back_within_its_code(tmp_path, codec):
    """Ramps and steps of grey; a step's own pixels may differ by a few codes more."""
    rows, columns = np.mgrid[:96, :128]
    depth = np.where((rows - 48) ** 2 + (columns - 64) ** 2 < 900, 230, 20 + columns)
    codes = np.repeat(depth[..., None], 3, axis=2).astype(np.uint8)
    shares = []
    for has_depth in (True, False):
        write_codes(iter([codes] * 3), tmp_path / "a.mp4", codec=codec, has_depth=has_depth)
        with av.open(str(tmp_path / "a.mp4")) as film:
            difference = [
                np.abs(frame.to_ndarray(format="rgb24").astype(int) - codes) for frame in film.decode(video=0)
            ]
        shares.append(np.mean(np.array(difference) <= 1))
    assert shares[0] > max(0.99, shares[1])


@pytest.mark.parametrize("codec", ["h264", "hevc", "av1"])
def test_a_film_of_quilts_says_its_layout(tmp_path, codec):
    layout = QuiltLayout(8, 6, 0.75)
    path = tmp_path / "film_qs8x6a0.75.mp4"
    write_codes((quantize(frame, 8, "srgb") for frame in frames()), path, codec=codec, quilt=layout)
    with av.open(str(path)) as video:
        assert video.metadata["title"] == "film_qs8x6a0.75"
        assert metadata_of_text(video.metadata["comment"], "film").layout == layout
    write_animation(frames(), tmp_path / "plain.mp4", codec=codec)
    with av.open(str(tmp_path / "plain.mp4")) as video:
        assert "comment" not in video.metadata


def test_views_of_a_film_of_quilts_are_whole_pixels(tmp_path):
    """5 x 3 views of 103 x 151 pixels, each of its own grey: their last column and row go."""
    layout = QuiltLayout(5, 3, 1.0)
    greys = np.linspace(0.05, 0.95, 15).reshape(3, 5)
    frame = np.repeat(np.kron(greys, np.ones((151, 103)))[..., None], 3, axis=2).astype(np.float32)
    path = tmp_path / "film_qs5x3a1.mp4"
    write_codes([quantize(frame, 8, "srgb")], path, quilt=layout)
    with av.open(str(path)) as video:
        codes = next(video.decode(video=0)).to_ndarray(format="rgb24")
    assert codes.shape == (450, 510, 3)
    tiles = codes.reshape(3, 150, 5, 102, 3).astype(float)
    expected = quantize(greys.astype(np.float32), 8, "srgb")
    assert np.abs(tiles[..., 0] - expected[:, None, :, None]).max() < 25
    assert np.abs(tiles[:, 4:-4, :, 4:-4, 0] - expected[:, None, :, None]).max() < 4


@pytest.mark.skipif(not hasattr(os, "sched_getscheduler"), reason="this system has no such scheduling policies")
@pytest.mark.parametrize("codec", ["h264", "hevc", "av1"])
def test_no_encoder_puts_the_process_into_real_time(tmp_path, codec):
    policies = []

    def watched():
        for frame in frames(40):
            for thread in os.listdir("/proc/self/task"):
                with suppress(ProcessLookupError):  # an encoder's, which ended meanwhile
                    policies.append(os.sched_getscheduler(int(thread)))
            yield frame

    before = os.sched_getscheduler(0)
    write_animation(watched(), tmp_path / "a.mp4", codec=codec)
    assert os.sched_getscheduler(0) == before
    assert set(policies) == {before}


def test_a_codec_that_cannot_be(tmp_path, monkeypatch):
    with pytest.raises(UsageError, match="codec: only MP4 has a choice of codecs"):
        write_animation(frames(), tmp_path / "a.png", codec="av1")
    encoder = mp4_film._Encoder("libnone", {}, "none", 4096)
    monkeypatch.setitem(mp4_film._ENCODERS, "av1", encoder)
    with pytest.raises(
        OutputError,
        match=r"a\.mp4: the codec av1 is not installed; PyAV as it is installed has no libnone; take h264 or hevc",
    ):
        write_animation(frames(), tmp_path / "a.mp4", codec="av1")
    # Where each pixel counts, and where a side is long, others are no help.
    exact = dataclasses.replace(mp4_film._ENCODERS["h264-rgb"], name="libnone")
    monkeypatch.setitem(mp4_film._ENCODERS, "h264-rgb", exact)
    with pytest.raises(OutputError, match=r"no libnone; take vp9-rgb$"):
        mp4_film.check_film(tmp_path / "a.mp4", (64, 64), "h264-rgb", exact=True)
    with pytest.raises(OutputError, match=r"no libnone; take hevc or vp9 or vp9-rgb$"):
        mp4_film.check_film(tmp_path / "a.mp4", (8192, 64), "h264-rgb")
    for name in mp4_film._ENCODERS:
        monkeypatch.setitem(mp4_film._ENCODERS, name, encoder)
    with pytest.raises(OutputError, match=r"no libnone; write an animation \(\.png\)"):
        write_animation(frames(), tmp_path / "a.mp4")
    assert os.listdir(tmp_path) == []


def test_one_frame_is_enough(tmp_path):
    for name in ("a.png", "a.mp4"):
        write_animation(frames(1), tmp_path / name)
        assert (tmp_path / name).stat().st_size > 100


def test_a_film_of_two_frames_has_its_times(tmp_path):
    # libx265 left the times of such a film as it found them: one in eight was refused.
    for _ in range(30):
        write_animation(frames(2), tmp_path / "a.mp4", frames_per_second=20, codec="hevc")
        with av.open(str(tmp_path / "a.mp4")) as film:
            assert [frame.time for frame in film.decode(video=0)] == [0.0, 0.05]


def test_places_that_cannot_be(tmp_path):
    for name, message in (
        ("a.gif", "unknown ending of an animation '.gif'; known are .png, .apng, .mp4"),
        ("a", "no ending"),
    ):
        with pytest.raises(OutputError, match=message):
            check_animation_path(tmp_path / name)
        with pytest.raises(OutputError, match=message):
            write_animation(frames(), tmp_path / name)
    with pytest.raises(OutputError, match="there is no folder"):
        write_animation(frames(), tmp_path / "missing" / "a.mp4")


@pytest.mark.parametrize("name", ["a.png", "a.mp4"])
def test_a_failure_in_the_middle_keeps_the_old_file(tmp_path, name):
    def failing():
        yield from frames(2)
        raise KeyboardInterrupt

    (tmp_path / name).write_bytes(b"the old one")
    with pytest.raises(KeyboardInterrupt):
        write_animation(failing(), tmp_path / name)
    assert (tmp_path / name).read_bytes() == b"the old one"
    assert os.listdir(tmp_path) == [name]


def shown_in(path):
    with av.open(str(path)) as film:
        return [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]


@pytest.mark.parametrize(("codec", "name"), [("h264-rgb", "h264"), ("vp9-rgb", "vp9")])
def test_native_pixels_come_back_code_for_code(tmp_path, codec, name):
    """Odd sizes too, and pure blue, which lossless 4:4:4 shows as 243."""
    rng = np.random.default_rng(1)
    made = [rng.integers(0, 256, (63, 49, 3), dtype=np.uint8) for _ in range(3)]
    made[1][:20] = (0, 0, 255)
    video_file.write_codes(made, tmp_path / "native.mp4", codec=codec)
    with av.open(str(tmp_path / "native.mp4")) as film:
        context = film.streams.video[0].codec_context
        assert (context.codec.canonical_name, context.pix_fmt) == (name, "gbrp")
    for shown, codes in zip(shown_in(tmp_path / "native.mp4"), made, strict=True):
        np.testing.assert_array_equal(shown, codes)


def test_a_long_side_is_coded_as_hevc_and_a_quilt_s_views_stay_whole(tmp_path):
    """7 views of 857 pixels: 5999 is odd, 7 x 856 is 5992."""
    frame = np.zeros((7 * 41, 5999, 3), np.uint8)
    video_file.write_codes([frame, frame], tmp_path / "a_qs7x7a1.77778.mp4", quilt=QuiltLayout(7, 7, 1.77778))
    with av.open(str(tmp_path / "a_qs7x7a1.77778.mp4")) as film:
        stream = film.streams.video[0]
        assert (stream.codec_context.codec.canonical_name, stream.width, stream.height) == ("hevc", 5992, 280)


@pytest.mark.parametrize(
    ("size", "codec", "exact", "message"),
    [
        ((5992, 5992), "h264", False, "a film of 5992 x 5992 pixels; h264 takes sides of at most 4096"),
        ((8192, 8194), None, False, "a film of 8192 x 8194 pixels; hevc takes sides of at most 8192"),
        ((16386, 64), None, True, "h264-rgb takes sides of at most 16384"),
        ((64, 64), "hevc", True, "hevc halves the resolution of colours; behind lenses each pixel counts"),
    ],
)
def test_sizes_that_no_encoder_takes_are_refused_beforehand(size, codec, exact, message):
    with pytest.raises((OutputError, UsageError), match=message):
        video_file.codec_of_film(Path("film.mp4"), size, codec, exact=exact)


@pytest.mark.parametrize("name", ["a.mp4", "a.png"])
def test_frames_are_taken_as_they_come(tmp_path, name):
    """No more than three frames exist at a time, however many there are: in the making, waiting, and being coded."""
    alive = set()

    def made():
        for number in range(12):
            frame = np.full((64, 64, 3), 20 * number, np.uint8)
            alive.add(number)
            weakref.finalize(frame, alive.discard, number)
            yield frame
            del frame
            assert len(alive) <= 3

    video_file.write_codes(made(), tmp_path / name)
    assert len(shown_in(tmp_path / name)) == 12


def test_a_frame_is_made_while_another_is_written(tmp_path, monkeypatch):
    """Neither waits for the other: each tells that it has begun, and waits until the other says so of a later frame."""
    begun = [threading.Event() for _ in range(5)]

    def written(frames, path, frames_per_second):
        for number, _ in enumerate(frames):
            assert begun[number + 1].wait(20)  # the next is in the making
        path.write_bytes(b"film")

    def made():
        for number in range(4):
            begun[number].set()
            yield np.zeros((8, 8, 3), np.uint8)
        begun[4].set()

    monkeypatch.setattr("lippmann.codecs.apng.write_apng", written)
    video_file.write_codes(made(), tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes() == b"film"


def test_no_frame_is_held_while_the_next_is_made(tmp_path):
    def codes():
        for number in range(3):
            frame = np.full((64, 64, 3), 40 * number, np.uint8)
            is_free = threading.Event()
            weakref.finalize(frame, is_free.set)
            yield frame
            del frame
            assert is_free.wait(20)

    video_file.write_codes(codes(), tmp_path / "a.mp4")


def test_a_writer_that_fails_ends_the_making(tmp_path, monkeypatch):
    def full(frames, path, frames_per_second):
        next(frames)
        raise OSError(28, "No space left on device")

    made = []
    monkeypatch.setattr("lippmann.codecs.apng.write_apng", full)
    frames = (made.append(k) or np.zeros((8, 8, 3), np.uint8) for k in range(100))
    with pytest.raises(OutputError, match=r"a\.png: cannot be written: no space is left"):
        video_file.write_codes(frames, tmp_path / "a.png")
    assert len(made) < 100
    assert os.listdir(tmp_path) == []
