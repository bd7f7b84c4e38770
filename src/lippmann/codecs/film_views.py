"""Views in films: of a spatial one (MV-HEVC, Rec. ITU-T H.265, annex G) the two of its first frame, else its frames."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from lippmann.codecs.photograph import Photograph
from lippmann.errors import PictureError
from lippmann.runtime.machine import check_input

#: A NAL unit of the base layer that begins with the message "three-dimensional reference displays information".
_DISPLAYS = b"\x4e\x01\xb0"
#: Most bytes of that message, and bytes of a pixel while it is decoded.
_MESSAGE, _BYTES_PER_PIXEL = 64, 12
#: Most frames that are taken for views: as many as a usual quilt has.
MOST_FRAMES = 48


def read_first_pair(path: Path) -> tuple[Photograph, Photograph] | None:
    """The left and the right view of a spatial film's first frame; None of a film of one view.

    The base layer is the left view, unless the film's message about reference displays (G.14.2.3) says that the right
    view has the smaller number.

    Raises
    ------
    PictureError
        The file is damaged or no film.
    MemoryLimitError
        Its pixels take more than the memory that is left.
    """
    frames: list[Any] = []
    first = b""
    with _opened(path, 2) as (film, stream):
        if stream.codec_context.name == "hevc":
            stream.codec_context.options = {"view_ids": "-1"}  # all, one after the other; FFmpeg before 7.1 knows one
        for packet in film.demux(stream):
            first = first or bytes(packet)
            frames += packet.decode()
            if len(frames) > 1:
                break
    if len(frames) < 2 or frames[0].pts != frames[1].pts:
        return None
    notes = ("of the film the first frame is read",)
    views = [Photograph.of_codes(frame.to_ndarray(format="rgb24"), b"", notes) for frame in frames[:2]]
    return (views[1], views[0]) if _right_view_is_first(first) else (views[0], views[1])


def read_frames(path: Path, most: int = MOST_FRAMES) -> list[Photograph]:
    """Frames of a film from its first to its last, evenly spaced and at most ``most``, as its rotation turns them.

    Raises
    ------
    PictureError
        The file is damaged or no film.
    MemoryLimitError
        Its pixels take more than the memory that is left.
    """
    count = count_frames(path)
    chosen = set(np.rint(np.linspace(0, count - 1, min(count, most))).tolist())
    notes = (f"of the film's {count} frames {len(chosen)} are shown, evenly spaced",) if len(chosen) < count else ()
    with _opened(path, len(chosen)) as (film, stream):
        decoded = islice(film.decode(stream), int(max(chosen, default=-1)) + 1)
        frames = [frame for number, frame in enumerate(decoded) if number in chosen]
    # PyAV before 14 does not tell the rotation.
    turns = [round(getattr(frame, "rotation", 0) / 90) for frame in frames]
    codes = [np.rot90(frame.to_ndarray(format="rgb24"), turn) for frame, turn in zip(frames, turns, strict=True)]
    return [Photograph.of_codes(each, b"", notes) for each in codes]


def count_frames(path: Path) -> int:
    """Number of a film's frames, none of which is decoded; errors as of :func:`read_frames`."""
    with _opened(path, 1) as (film, stream):
        return sum(packet.size > 0 for packet in film.demux(stream))


@contextmanager
def _opened(path: Path, frames: int) -> Iterator[tuple[Any, Any]]:
    """A film of PyAV and its stream of pictures, of which so many frames fit into memory."""
    import av

    try:
        with av.open(str(path)) as film:
            streams = [stream for stream in film.streams.video if stream.codec_context is not None]
            if not streams:  # FFmpeg knows none of their kinds
                raise PictureError("has no pictures that can be decoded", where=str(path), rule="a film")
            context = streams[0].codec_context
            check_input(frames * _BYTES_PER_PIXEL * context.width * context.height, "its frames", where=str(path))
            yield film, streams[0]
    except av.error.FFmpegError as error:
        raise PictureError(f"cannot be decoded ({error.strerror})", where=str(path), rule="a film") from None


def _right_view_is_first(packet: bytes) -> bool:
    place = packet.find(_DISPLAYS) + len(_DISPLAYS) + 1  # behind the message's size
    if place <= len(_DISPLAYS):
        return False
    message = packet[place : place + _MESSAGE].replace(b"\0\0\3", b"\0\0")
    bits = "".join(f"{byte:08b}" for byte in message)

    def number(place: int) -> tuple[int, int]:
        """An Exp-Golomb code (9.2), and the place behind it."""
        zeros = bits.index("1", place) - place
        end = place + 2 * zeros + 1
        return int(bits[place + zeros : end], 2) - 1, end

    try:
        _, place = number(0)  # precision of widths
        if bits[place] == "1":
            _, place = number(place + 1)  # and of viewing distances
        else:
            place += 1
        _, place = number(place)  # displays but one
        left, place = number(place)
        right, _ = number(place)
    except (ValueError, IndexError):
        return False
    return right < left
