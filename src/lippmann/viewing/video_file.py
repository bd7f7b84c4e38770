"""Animation files: APNG, lossless with 8 bits, and MP4 (H.264)."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from lippmann.codecs.types import Pixels
from lippmann.color.transfer import Transfer, quantize
from lippmann.errors import OutputError
from lippmann.image.stored_values import FloatArray
from lippmann.runtime.atomic_write import replacing

#: Endings of the file names.
ANIMATIONS = (".png", ".apng", ".mp4")

#: Constant rate factor of H.264; 18 is considered visually lossless, lower is better.
_RATE_FACTOR = "16"

#: sRGB and BT.709 in the numbering of ITU-T H.273.
_BT709, _SRGB_TRANSFER, _LIMITED_RANGE = 1, 13, 1


def check_animation_path(path: Path) -> None:
    """Raise :class:`OutputError` unless the name ends in ``.png``, ``.apng`` or ``.mp4``."""
    if path.suffix.lower() not in ANIMATIONS:
        ending = f"the ending '{path.suffix}' is unknown" if path.suffix else "the name has no ending"
        raise OutputError(ending, where=str(path), rule=f"animations are {', '.join(ANIMATIONS)}")


def write_animation(
    frames: Iterable[FloatArray], path: Path, *, frames_per_second: float = 24.0, transfer: Transfer = "srgb"
) -> None:
    """Write frames as an animation.

    Parameters
    ----------
    frames:
        At least one frame ``(H, W, 3)`` of linear RGB; all have one size.
    path:
        The file: ``.png`` or ``.apng`` for APNG, which repeats forever, or ``.mp4``. H.264 needs even sizes: an odd
        last column or row is doubled.
    frames_per_second:
        Frame rate.
    transfer:
        Transfer function of the codes.

    Raises
    ------
    OutputError
        If the ending is unknown, or the file cannot be written.
    """
    check_animation_path(path)
    codes = (quantize(frame, 8, transfer) for frame in frames)
    with replacing(path) as temporary:
        if path.suffix.lower() == ".mp4":
            _write_mp4(codes, temporary, frames_per_second, path)
        else:
            _write_apng(codes, temporary, frames_per_second)


def _write_apng(frames: Iterator[Pixels], path: Path, frames_per_second: float) -> None:
    from PIL import Image

    # A list of all frames: Pillow iterates twice, which exhausts a generator.
    first, *others = [Image.fromarray(frame) for frame in frames]
    duration = 1000 / frames_per_second
    first.save(path, format="PNG", save_all=True, append_images=others, duration=duration, loop=0)


def _write_mp4(frames: Iterator[Pixels], path: Path, frames_per_second: float, place: Path) -> None:
    from fractions import Fraction

    import av

    first = next(frames)
    height, width = first.shape[:2]
    try:
        with av.open(str(path), "w", format="mp4") as container:
            rate = Fraction(frames_per_second).limit_denominator(1001)
            stream = container.add_stream("libx264", rate=rate, options={"crf": _RATE_FACTOR})
            stream.width, stream.height, stream.pix_fmt = width + width % 2, height + height % 2, "yuv420p"
            context = stream.codec_context
            context.color_primaries, context.colorspace = _BT709, _BT709
            context.color_trc, context.color_range = _SRGB_TRANSFER, _LIMITED_RANGE
            for codes in itertools.chain([first], frames):
                even = np.pad(codes, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
                frame = av.VideoFrame.from_ndarray(even, format="rgb24")
                frame = frame.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG")
                container.mux(stream.encode(frame))
            container.mux(stream.encode())
    except (av.error.FFmpegError, ValueError) as error:
        raise OutputError(f"cannot be written as MP4 ({error})", where=str(place)) from error
