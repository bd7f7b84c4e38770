"""MP4 films: which encoders there are, the sizes that they and their players take, and the writing itself."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any, Literal

import numpy as np

from lippmann.codecs.types import Pixels
from lippmann.errors import OutputError, UsageError
from lippmann.quilts.quilt import QuiltLayout
from lippmann.quilts.quilt_metadata import layout_text
from lippmann.runtime.thread_policy import keep_policy

#: How the frames of an MP4 file are coded; docs/reference/films.md says who plays which.
Codec = Literal["h264", "hevc", "vp9", "av1", "h264-rgb", "vp9-rgb"]


@dataclass(frozen=True)
class _Encoder:
    """An encoder of FFmpeg.

    Attributes
    ----------
    name, options:
        Of the encoder.
    tag:
        The sample entry that names the codec in the file.
    widest:
        Most pixels of a side. Of lossy codecs, what the panels' players decode; of lossless ones, the encoder's limit.
    pixels:
        The order of its colours: halved colours, or red, green and blue as they are.
    """

    name: str
    options: dict[str, str]
    tag: str
    widest: int
    pixels: str = "yuv420p"

    @property
    def is_exact(self) -> bool:
        """Whether each code comes back as it was."""
        return self.pixels != "yuv420p"


#: libx265 prints on standard error.
_QUIET = "log-level=error"
#: Encoders look few frames ahead and keep few for reference: each takes 17 MB of a quilt of 3360 x 3360 pixels,
#: 100 MB of one of 8192 x 8192, several times over. libx265 has no B-frames: of a film of two frames it gave decoding
#: times that it never set.
_LEAN = {"rc-lookahead": "1", "refs": "1", "bf": "0", "thread_type": "slice"}
_LEAN_HEVC = f"{_QUIET}:rc-lookahead=1:ref=1:bframes=0:frame-threads=1"
_LEAN_VP9 = {"deadline": "good", "row-mt": "1", "lag-in-frames": "0"}
#: SVT-AV1's own groups of 32 frames take 1.9 GB of such quilts, groups of 4 without looking ahead 0.7 GB.
_LEAN_AV1 = {"svtav1-params": "lp=1:lookahead=0:hierarchical-levels=2"}
#: Constant rate factors near the one that is considered visually lossless (18 in H.264); lower is better. Apple's
#: players take HEVC as ``hvc1`` alone.
_ENCODERS: dict[Codec, _Encoder] = {
    "h264": _Encoder("libx264", {"crf": "16", "preset": "veryfast", **_LEAN}, "avc1", 4096),
    "hevc": _Encoder("libx265", {"crf": "18", "x265-params": _LEAN_HEVC}, "hvc1", 8192),
    "vp9": _Encoder("libvpx-vp9", {"crf": "20", "b": "0", "cpu-used": "4", **_LEAN_VP9}, "vp09", 8192),
    "av1": _Encoder("libsvtav1", {"crf": "20", "preset": "8", **_LEAN_AV1}, "av01", 8192),
    "h264-rgb": _Encoder("libx264rgb", {"qp": "0", "preset": "veryfast", **_LEAN}, "avc1", 16384, "rgb24"),
    "vp9-rgb": _Encoder("libvpx-vp9", {"lossless": "1", "cpu-used": "5", **_LEAN_VP9}, "vp09", 16384, "gbrp"),
}

#: Of films with depth beside colour: nearly without loss, as each step of depth moves a surface.
_DEPTH = {"crf": "1"}

#: sRGB and BT.709 in the numbering of ITU-T H.273; RGB as it is has the matrix 0 and the full range.
_BT709, _SRGB_TRANSFER, _LIMITED = 1, 13, 1
_IDENTITY, _FULL = 0, 2


def codec_for(size: tuple[int, int], codec: Codec | None, *, exact: bool = False) -> Codec:
    """The codec asked for; without one H.264, or HEVC where a side is longer than H.264's players take."""
    if codec is not None:
        return codec
    if exact:
        return "h264-rgb"
    return "h264" if max(size) <= _ENCODERS["h264"].widest else "hevc"


def most_pixels(codec: Codec) -> int:
    """The longest side of a film."""
    return _ENCODERS[codec].widest


def coded_size(size: tuple[int, int], codec: Codec, quilt: QuiltLayout) -> tuple[int, int]:
    """Width and height of coded quilts: where a side is odd and may not be, each view loses a pixel."""
    return size if _ENCODERS[codec].is_exact else _even_size(size, quilt)


def check_film(place: Path, size: tuple[int, int], codec: Codec, *, exact: bool = False) -> None:
    """Check before the first frame that a film of this size can be coded.

    Parameters
    ----------
    exact:
        Whether each pixel counts, as on a panel under lenses.

    Raises
    ------
    OutputError
        The encoder is not built in; or takes no such size.
    UsageError
        Each pixel counts, and the codec mixes colours of neighbours.
    """
    encoder = _ENCODERS[codec]
    if exact and not encoder.is_exact:
        raise UsageError(
            f"{codec} halves the resolution of colours",
            parameter="codec",
            rule="behind lenses each pixel counts",
            fix="take h264-rgb or vp9-rgb",
        )
    if not _is_built_in(encoder):
        rule = f"PyAV as it is installed has no {encoder.name}"
        usable = {name: each for name, each in _ENCODERS.items() if max(size) <= each.widest and each.is_exact >= exact}
        others = [name for name, each in usable.items() if _is_built_in(each)]
        fix = f"take {' or '.join(others)}" if others else "write an animation (.png)"
        raise OutputError(f"the codec {codec} is not installed", where=str(place), rule=rule, fix=fix)
    if max(size) > encoder.widest:
        raise OutputError(
            f"a film of {size[0]} x {size[1]} pixels",
            where=str(place),
            rule=f"{codec} takes sides of at most {encoder.widest}",
            fix="choose another codec, or make the frames smaller",
        )


def _is_built_in(encoder: _Encoder) -> bool:
    import av

    try:
        av.codec.Codec(encoder.name, "w")
    except av.codec.codec.UnknownCodecError:
        return False
    return True


def write_mp4(
    frames: Iterator[Pixels],
    path: Path,
    frames_per_second: float,
    *,
    place: Path,
    codec: Codec | None,
    quilt: QuiltLayout | None,
    has_depth: bool = False,
) -> None:
    """Write 8-bit frames as MP4; the file will be called ``place``."""
    from fractions import Fraction

    import av

    # SVT-AV1 prints its settings on standard error, unless told to print errors alone before it is first used.
    os.environ.setdefault("SVT_LOG", "1")

    rate = Fraction(frames_per_second).limit_denominator(1001)
    try:
        with av.open(str(path), "w", format="mp4") as container:
            container.metadata["title"] = place.stem
            if quilt is not None:
                container.metadata["comment"] = layout_text(quilt)
            stream: Any = None
            numbers = count()  # enumerate would hold a frame while the next is waited for
            for codes in frames:
                if stream is None:
                    size = codes.shape[1], codes.shape[0]
                    codec = codec_for(size, codec)
                    check_film(place, size, codec)
                    encoder = _ENCODERS[codec]
                    options = encoder.options | _DEPTH if has_depth and not encoder.is_exact else encoder.options
                    stream = container.add_stream(encoder.name, rate=rate, options=options)
                    frame = _frame(codes, encoder, quilt)
                    _open(stream.codec_context, encoder, (frame.width, frame.height))
                else:
                    frame = _frame(codes, encoder, quilt)
                frame.pts, frame.time_base = next(numbers), 1 / rate
                container.mux(stream.encode(frame))
                del frame, codes  # while the next is waited for
            container.mux(stream.encode())
    except (av.error.FFmpegError, ValueError) as error:
        if isinstance(error, OSError):  # such as a full disk
            raise
        raise OutputError(f"cannot be written as MP4 ({error})", where=str(place)) from error


def _open(context: Any, encoder: _Encoder, size: tuple[int, int]) -> None:
    """Open an encoder for frames of this size."""
    context.codec_tag = encoder.tag
    context.width, context.height = size
    context.pix_fmt = encoder.pixels
    context.color_primaries, context.color_trc = _BT709, _SRGB_TRANSFER
    context.colorspace, context.color_range = (_IDENTITY, _FULL) if encoder.is_exact else (_BT709, _LIMITED)
    with keep_policy():
        context.open()


def _frame(codes: Pixels, encoder: _Encoder, quilt: QuiltLayout | None) -> Any:
    """A frame as the encoder takes it."""
    import av

    codes = np.ascontiguousarray(codes if encoder.is_exact else _even(codes, quilt))
    frame = av.VideoFrame.from_numpy_buffer(codes, format="rgb24")  # the pixels themselves, no copy
    if encoder.is_exact:
        return frame.reformat(format=encoder.pixels)
    return frame.reformat(format=encoder.pixels, dst_colorspace="ITU709", dst_color_range="MPEG")


def _even(codes: Pixels, quilt: QuiltLayout | None) -> Pixels:
    """A frame of even sides."""
    height, width = codes.shape[:2]
    if not (width % 2 or height % 2):
        return codes
    if quilt is None or width % quilt.columns or height % quilt.rows:
        return np.pad(codes, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    views = codes.reshape(quilt.rows, height // quilt.rows, quilt.columns, width // quilt.columns, 3)
    whole = views[:, : views.shape[1] - height % 2, :, : views.shape[3] - width % 2]
    width, height = _even_size((width, height), quilt)
    return np.ascontiguousarray(whole).reshape(height, width, 3)


def _even_size(size: tuple[int, int], quilt: QuiltLayout) -> tuple[int, int]:
    width, height = size
    return width - width % 2 * quilt.columns, height - height % 2 * quilt.rows
