import os

import av
import numpy as np
import pytest
from PIL import Image, ImageSequence

from lippmann.color.transfer import quantize
from lippmann.errors import OutputError, UsageError
from lippmann.quilts.quilt import QuiltLayout
from lippmann.quilts.quilt_metadata import metadata_of_text
from lippmann.viewing import video_file
from lippmann.viewing.video_file import check_animation_path, write_animation


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


@pytest.mark.parametrize("codec", ["h264", "hevc", "av1"])
def test_a_film_of_quilts_says_its_layout(tmp_path, codec):
    layout = QuiltLayout(8, 6, 0.75)
    path = tmp_path / "film_qs8x6a0.75.mp4"
    write_animation(frames(), path, codec=codec, quilt=layout)
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
    write_animation([frame], path, quilt=layout)
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
            policies.extend(os.sched_getscheduler(int(thread)) for thread in os.listdir("/proc/self/task"))
            yield frame

    before = os.sched_getscheduler(0)
    write_animation(watched(), tmp_path / "a.mp4", codec=codec)
    assert os.sched_getscheduler(0) == before
    assert set(policies) == {before}


def test_a_codec_that_cannot_be(tmp_path, monkeypatch):
    with pytest.raises(UsageError, match="codec: only MP4 has a choice of codecs"):
        write_animation(frames(), tmp_path / "a.png", codec="av1")
    encoder = video_file._Encoder("libnone", {}, "none")
    monkeypatch.setitem(video_file._ENCODERS, "av1", encoder)
    with pytest.raises(
        OutputError, match=r"a\.mp4: the codec is not installed; PyAV as it is installed has no libnone"
    ):
        write_animation(frames(), tmp_path / "a.mp4", codec="av1")
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
    with pytest.raises(OutputError, match="not found"):
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
