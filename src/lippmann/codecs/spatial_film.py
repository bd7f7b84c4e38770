"""Spatial films (MV-HEVC, Rec. ITU-T H.265, annex G): the two views of their first frame."""

from __future__ import annotations

from pathlib import Path

from lippmann.codecs.photograph import Photograph
from lippmann.errors import PictureError
from lippmann.runtime.machine import check_input

#: A NAL unit of the base layer that begins with the message "three-dimensional reference displays information".
_DISPLAYS = b"\x4e\x01\xb0"
#: Most bytes of that message, and bytes of a pixel while it is decoded.
_MESSAGE, _BYTES_PER_PIXEL = 64, 12


def read_first_pair(path: Path) -> tuple[Photograph, Photograph]:
    """The left and the right view of a film's first frame.

    The base layer is the left view, unless the film's message about reference displays (G.14.2.3) says that the right
    view has the smaller number.

    Raises
    ------
    PictureError
        The file is damaged, no film, or a film of one view.
    MemoryLimitError
        Its pixels take more than the memory that is left.
    """
    import av

    frames: list[av.VideoFrame] = []
    first = b""
    try:
        with av.open(str(path)) as film:
            for stream in film.streams.video[:1]:
                context = stream.codec_context
                if context is None:  # of a kind that FFmpeg does not know
                    break
                check_input(2 * _BYTES_PER_PIXEL * context.width * context.height, "a frame", where=str(path))
                if context.name == "hevc":
                    context.options = {"view_ids": "-1"}  # all, one after the other; FFmpeg before 7.1 knows one
                for packet in film.demux(stream):
                    first = first or bytes(packet)
                    frames += packet.decode()
                    if len(frames) > 1:
                        break
    except av.error.FFmpegError as error:
        raise PictureError(f"cannot be decoded ({error.strerror})", where=str(path), rule="a film") from None
    if len(frames) < 2 or frames[0].pts != frames[1].pts:
        raise PictureError(
            "is a film of one view",
            where=str(path),
            rule="of films a spatial one (MV-HEVC) is read, by FFmpeg 7.1 (PyAV 14) or newer",
            fix=f"write its frames as pictures first: ffmpeg -i {path.name} frame%03d.png",
        )
    notes = ("of the film the first frame is read",)
    views = [Photograph.of_codes(frame.to_ndarray(format="rgb24"), b"", notes) for frame in frames[:2]]
    return (views[1], views[0]) if _right_view_is_first(first) else (views[0], views[1])


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
