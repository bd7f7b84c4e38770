"""Animation files: APNG, lossless with 8 bits, and MP4.

Players of quilts know the layout by the file's name, which ends in ``_qs8x6a0.75``: the vendor's convention. The same
layout lies in the file's own metadata, as the comment, so that it outlives another name.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from queue import Full, Queue
from typing import cast

from lippmann.codecs.types import Pixels
from lippmann.color.transfer import Transfer, quantize
from lippmann.errors import OutputError, UsageError
from lippmann.exchange.registry import EXPORTS, Film
from lippmann.image.stored_values import FloatArray
from lippmann.quilts.quilt import QuiltLayout
from lippmann.runtime.atomic_write import replacing
from lippmann.runtime.plugins import Plugin, function_of
from lippmann.runtime.thread_policy import run_behind
from lippmann.viewing.mp4_film import Codec, check_film, codec_for

#: Seconds after which a thread that waits for the film's writer looks whether it has failed.
_PLAYBACK = 0.1


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


def codec_of_film(
    path: Path, size: tuple[int, int], codec: Codec | None = None, *, exact: bool = False
) -> Codec | None:
    """The codec of a film of frames of this size, checked before the first is made; None for animations without one.

    Raises
    ------
    OutputError, UsageError
        As :func:`check_animation_path` and :func:`lippmann.viewing.mp4_film.check_film`.
    """
    check_animation_path(path, codec)
    if "codec" not in _film_of(path).value.options:
        return None
    chosen = codec_for(size, codec, exact=exact)
    check_film(path, size, chosen, exact=exact)
    return chosen


def write_animation(
    frames: Iterable[FloatArray],
    path: Path,
    *,
    frames_per_second: float = 24.0,
    transfer: Transfer = "srgb",
    codec: Codec | None = None,
) -> None:
    """Write frames as an animation.

    Parameters
    ----------
    frames:
        At least one frame ``(H, W, 3)`` of linear RGB; all have one size.
    path:
        The file: ``.png`` or ``.apng`` for APNG, which repeats forever, ``.mp4``, or an ending of a plugin's. MP4 needs
        even sizes: an odd last column or row is doubled.
    frames_per_second:
        Frame rate.
    transfer:
        Transfer function of the codes.
    codec:
        Of an MP4 file; None for ``h264``, or ``hevc`` where a side is longer than 4096. ``h264-rgb`` and ``vp9-rgb``
        keep each code as it is, and odd sizes.

    Raises
    ------
    OutputError
        If the ending is unknown, the codec is not installed, or the file cannot be written.
    UsageError
        If a codec is given, and the file is no MP4.
    """
    codes = (quantize(frame, 8, transfer) for frame in frames)
    write_codes(codes, path, frames_per_second=frames_per_second, codec=codec)


def write_codes(
    frames: Iterable[Pixels],
    path: Path,
    *,
    frames_per_second: float = 24.0,
    codec: Codec | None = None,
    quilt: QuiltLayout | None = None,
    has_depth: bool = False,
) -> None:
    """Write frames ``(H, W, 3)`` of 8-bit codes as an animation; parameters and errors as of :func:`write_animation`.

    The next frame is made while one is coded and written; no more are held. ``quilt`` is the layout of frames that are
    quilts: an MP4 file says it in its metadata, and views of odd sizes lose a column or row, so that they stay whole
    pixels. With ``has_depth`` a lossy codec loses next to nothing, about two codes at most.
    """
    check_animation_path(path, codec)
    film = _film_of(path)
    values = {"codec": codec, "quilt": quilt, "place": path, "has_depth": has_depth}
    chosen = {name: values[name] for name in film.value.options}
    write = function_of(film.value.write)
    with replacing(path) as temporary, film.guard(OutputError, str(path)):
        _beside(lambda taken: write(taken, temporary, frames_per_second, **chosen), frames)


def _beside(write: Callable[[Iterator[Pixels]], None], frames: Iterable[Pixels]) -> None:
    """Make ``frames`` in this thread, whose engine they may need, and ``write`` them in another."""
    waiting: Queue[Pixels | None] = Queue(maxsize=1)
    stopped = threading.Event()

    def taken() -> Iterator[Pixels]:
        while (frame := waiting.get()) is not None:
            yield frame
            del frame  # not held while waiting for the next
        if stopped.is_set():
            raise _StoppedError

    with ThreadPoolExecutor(1, "film", run_behind) as pool:
        writing = pool.submit(write, taken())

        def hand_over(frame: Pixels | None) -> None:
            while not writing.done():
                with suppress(Full):
                    waiting.put(frame, timeout=_PLAYBACK)
                    return

        try:
            for frame in frames:
                hand_over(frame)
                del frame  # while the next is made
                if writing.done():
                    break
        except BaseException:
            stopped.set()
            raise
        finally:
            hand_over(None)
        writing.result()


class _StoppedError(Exception):
    """The frames came to an end before their time."""


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
