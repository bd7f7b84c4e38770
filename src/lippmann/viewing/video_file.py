"""Animation files: APNG, lossless with 8 bits, and MP4 (H.264, HEVC or AV1).

Players of quilts know the layout by the file's name, which ends in ``_qs8x6a0.75``: the vendor's convention. The same
layout lies in the file's own metadata, as the comment, so that it outlives another name.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, cast

import numpy as np

from lippmann.codecs.types import Pixels
from lippmann.color.transfer import Transfer, quantize
from lippmann.errors import OutputError, UsageError
from lippmann.exchange.registry import EXPORTS, Film
from lippmann.image.stored_values import FloatArray
from lippmann.quilts.quilt import QuiltLayout
from lippmann.quilts.quilt_metadata import layout_text
from lippmann.runtime.atomic_write import replacing
from lippmann.runtime.plugins import Plugin, function_of
from lippmann.runtime.thread_policy import kept_policy

#: How the frames of an MP4 file are coded. H.264 plays everywhere; HEVC and AV1 make smaller files.
Codec = Literal["h264", "hevc", "av1"]


@dataclass(frozen=True)
class _Encoder:
    """An encoder of FFmpeg, its options, and the sample entry that names the codec in the file.

    ``of_few`` are options of a film of fewer than :data:`_REORDERED` frames, beside the others.
    """

    name: str
    options: dict[str, str]
    tag: str
    of_few: dict[str, str] = field(default_factory=dict)


#: Frames that libx265 puts into another order: of a film of two it gives decoding times that it never set, and an MP4
#: file holds none of those.
_REORDERED = 3


#: libx265 prints on standard error.
_QUIET = "log-level=error"
#: Constant rate factors near the one that is considered visually lossless (18 in H.264); lower is better. Apple's
#: players take HEVC as ``hvc1`` alone.
_ENCODERS: dict[Codec, _Encoder] = {
    "h264": _Encoder("libx264", {"crf": "16"}, "avc1"),
    "hevc": _Encoder("libx265", {"crf": "18", "x265-params": _QUIET}, "hvc1", {"x265-params": f"{_QUIET}:bframes=0"}),
    "av1": _Encoder("libsvtav1", {"crf": "20", "preset": "8"}, "av01"),
}

#: sRGB and BT.709 in the numbering of ITU-T H.273.
_BT709, _SRGB_TRANSFER, _LIMITED_RANGE = 1, 13, 1


def check_animation_path(path: Path, codec: Codec | None = None) -> None:
    """Check the name of an animation before its frames are made.

    Raises
    ------
    OutputError
        If the name does not end in ``.png``, ``.apng`` or ``.mp4``.
    UsageError
        If a codec is asked for, and the file is no MP4.
    """
    if "codec" not in _film_of(path).value.options and codec is not None:
        raise UsageError(
            "only MP4 has a choice of codecs", parameter="codec", fix="name the file .mp4, or leave it out"
        )


def write_animation(
    frames: Iterable[FloatArray],
    path: Path,
    *,
    frames_per_second: float = 24.0,
    transfer: Transfer = "srgb",
    codec: Codec | None = None,
    quilt: QuiltLayout | None = None,
) -> None:
    """Write frames as an animation.

    Parameters
    ----------
    frames:
        At least one frame ``(H, W, 3)`` of linear RGB; all have one size.
    path:
        The file: ``.png`` or ``.apng`` for APNG, which repeats forever, ``.mp4``, or an ending of a plugin's. MP4 needs
        even sizes: an odd last column or row is doubled; of quilts, each view loses one, so that views stay whole
        pixels.
    frames_per_second:
        Frame rate.
    transfer:
        Transfer function of the codes.
    codec:
        ``h264``, ``hevc`` or ``av1``, of an MP4 file; ``h264`` if None.
    quilt:
        Layout of the frames if they are quilts; an MP4 file says it in its metadata.

    Raises
    ------
    OutputError
        If the ending is unknown, the codec is not installed, or the file cannot be written.
    UsageError
        If a codec is given, and the file is no MP4.
    """
    check_animation_path(path, codec)
    film = _film_of(path)
    codes = (quantize(frame, 8, transfer) for frame in frames)
    values = {"codec": codec, "quilt": quilt, "place": path}
    chosen = {name: values[name] for name in film.value.options}
    with replacing(path) as temporary, film.guarded(OutputError, str(path)):
        function_of(film.value.write)(codes, temporary, frames_per_second, **chosen)


def is_film(path: Path) -> bool:
    """Whether a file's ending is that of films."""
    return bool(path.suffix) and EXPORTS.find(path.suffix.lower()) is not None


def film_suffixes() -> list[str]:
    """Endings of the names of films, those of plugins too."""
    return [each for each in EXPORTS.claims() if each.startswith(".")]


def _film_of(path: Path) -> Plugin[Film]:
    if not is_film(path):
        raise OutputError.unknown(
            "ending of an animation", path.suffix, film_suffixes(), where=str(path), fix=EXPORTS.problems
        )
    return cast("Plugin[Film]", EXPORTS.find(path.suffix.lower()))


def write_apng(frames: Iterator[Pixels], path: Path, frames_per_second: float) -> None:
    """Write 8-bit frames as a lossless animation that repeats forever."""
    from PIL import Image

    # A list of all frames: Pillow iterates twice, which exhausts a generator.
    first, *others = [Image.fromarray(frame) for frame in frames]
    duration = 1000 / frames_per_second
    first.save(path, format="PNG", save_all=True, append_images=others, duration=duration, loop=0)


def write_mp4(
    frames: Iterator[Pixels],
    path: Path,
    frames_per_second: float,
    *,
    place: Path,
    codec: Codec | None,
    quilt: QuiltLayout | None,
) -> None:
    """Write 8-bit frames as MP4; the file will be called ``place``."""
    from fractions import Fraction

    import av

    # SVT-AV1 prints its settings on standard error, unless told to print errors alone before it is first used.
    os.environ.setdefault("SVT_LOG", "1")

    encoder = _ENCODERS[codec or "h264"]
    frames = (_even(codes, quilt) for codes in frames)
    head = list(itertools.islice(frames, _REORDERED))
    height, width = head[0].shape[:2]
    options = encoder.options | (encoder.of_few if len(head) < _REORDERED else {})
    try:
        with av.open(str(path), "w", format="mp4") as container:
            rate = Fraction(frames_per_second).limit_denominator(1001)
            container.metadata["title"] = place.stem
            if quilt is not None:
                container.metadata["comment"] = layout_text(quilt)
            stream = container.add_stream(encoder.name, rate=rate, options=options)
            stream.codec_context.codec_tag = encoder.tag
            stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
            context = stream.codec_context
            context.color_primaries, context.colorspace = _BT709, _BT709
            context.color_trc, context.color_range = _SRGB_TRANSFER, _LIMITED_RANGE
            with kept_policy():
                context.open()
            for number, codes in enumerate(itertools.chain(head, frames)):
                frame = av.VideoFrame.from_ndarray(codes, format="rgb24")
                frame = frame.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG")
                frame.pts, frame.time_base = number, 1 / rate
                container.mux(stream.encode(frame))
            container.mux(stream.encode())
    except av.codec.codec.UnknownCodecError:
        rule = f"PyAV as it is installed has no {encoder.name}"
        raise OutputError("the codec is not installed", where=str(place), rule=rule, fix="write H.264") from None
    except (av.error.FFmpegError, ValueError) as error:
        if isinstance(error, OSError):  # such as a full disk
            raise
        raise OutputError(f"cannot be written as MP4 ({error})", where=str(place)) from error


def _even(codes: Pixels, quilt: QuiltLayout | None) -> Pixels:
    """A frame of even sides."""
    height, width = codes.shape[:2]
    if quilt is None or width % quilt.columns or height % quilt.rows:
        return np.pad(codes, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    views = codes.reshape(quilt.rows, height // quilt.rows, quilt.columns, width // quilt.columns, 3)
    whole = views[:, : views.shape[1] - height % 2, :, : views.shape[3] - width % 2]
    return np.ascontiguousarray(whole).reshape(height - height % 2 * quilt.rows, width - width % 2 * quilt.columns, 3)
