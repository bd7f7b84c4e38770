"""Stereo pairs: what two eyes see, side by side for stereoscopic and tracked monitors, or as an anaglyph.

The left eye's picture is on the left half, uncrossed. Both pictures have the frame of a replay, the panel's rectangle
in the lens plane: points of that plane have the same place in both (zero disparity), points in front of it lie farther
right for the left eye than for the right one (crossed disparity).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from lippmann.codecs.stereo_pairs import encode_jps, encode_mpo
from lippmann.color.transfer import Transfer, quantize
from lippmann.display.stereo import EYE_DISTANCE
from lippmann.errors import UsageError
from lippmann.image.integral_image import Picture
from lippmann.image.stored_values import FloatArray
from lippmann.options.option import checked
from lippmann.runtime.atomic_write import replacing
from lippmann.runtime.regular_file import check_kind, unreadable
from lippmann.viewing.replay import Eye, Filter, check_eye, default_eye, replay

#: How a pair becomes one picture: side by side at full or half width, or for red-cyan glasses.
Stereo = Literal["full", "half", "anaglyph"]

#: Largest distance between two eyes, mm: wide bases are used for distant scenes.
WIDEST_EYES = 1000.0

#: Most positions of a head path, and most bytes of its file.
MOST_POSITIONS = 100_000
MOST_BYTES = 1 << 24

#: Least-squares projection for red-cyan glasses, for the left and the right picture in linear RGB: E. Dubois, "A
#: projection method to generate anaglyph stereo images", Proc. ICASSP (2001); the numbers for a display with sRGB's
#: primaries are those of D. F. McAllister, Y. Zhou and S. Sullivan, "Methods for computing color anaglyphs", Proc. SPIE
#: 7524 (2010), also from W. R. Sanders and D. F. McAllister (2003).
DUBOIS_LEFT = np.array(
    [
        [0.4561, 0.500484, 0.176381],
        [-0.0400822, -0.0378246, -0.0157589],
        [-0.0152161, -0.0205971, -0.00546856],
    ],
    dtype=np.float32,
)
DUBOIS_RIGHT = np.array(
    [
        [-0.0434706, -0.0879388, -0.00155529],
        [0.378476, 0.73364, -0.0184503],
        [-0.0721527, -0.112961, 1.2264],
    ],
    dtype=np.float32,
)


@checked
def replay_stereo(
    image: Picture,
    head: Eye | None = None,
    *,
    stereo: Stereo = "full",
    eyes: float = EYE_DISTANCE,
    size: tuple[int, int] | None = None,
    filter: Filter = "nearest",
) -> FloatArray:
    """Picture of what two eyes see through the lenses.

    Parameters
    ----------
    image:
        The native picture.
    head:
        Position ``(x, y, z)`` between the eyes in the display frame in mm, z > 0. None: the centre of the viewing zone.
    stereo:
        ``full``: both pictures side by side. ``half``: the same, each at half its width. ``anaglyph``: one picture for
        red-cyan glasses.
    eyes:
        Distance between the eyes in mm, above 0 and at most 1000.
    size:
        Width and height of one eye's picture in pixels, 1 to 65535. None: the panel's, at most 2048 wide.
    filter:
        As for :func:`~lippmann.viewing.replay.replay`.

    Returns
    -------
    ``(height, width, 3)`` float32 linear RGB: twice the width of one eye's picture for ``full``.

    Raises
    ------
    UsageError
        If a value is out of range, or ``stereo`` is unknown.

    Examples
    --------
    >>> import numpy as np
    >>> display = lippmann.load_display("mla-square")
    >>> image = lippmann.IntegralImage(np.zeros((510, 510, 3), dtype=np.float32), display)
    >>> lippmann.replay_stereo(image, (0.0, 0.0, 300.0), stereo="full", size=(34, 34)).shape
    (34, 68, 3)
    """
    head = default_eye(image.display) if head is None else head
    return stereo_pair(lambda eye: replay(image, eye, size=size, filter=filter), head, stereo, eyes)


def stereo_pair(see: Callable[[Eye], FloatArray], head: Eye, stereo: Stereo, eyes: float = EYE_DISTANCE) -> FloatArray:
    """One picture of the two that ``see`` gives for the eyes of a head; parameters and errors as above."""
    if stereo not in get_args(Stereo):
        raise UsageError.unknown("form", stereo, get_args(Stereo), parameter="stereo")
    left, right = (see(eye) for eye in eyes_of(head, eyes))
    return anaglyph(left, right) if stereo == "anaglyph" else side_by_side(left, right, half=stereo == "half")


def eyes_of(head: Eye, eyes: float = EYE_DISTANCE) -> tuple[Eye, Eye]:
    """Positions of the left and the right eye of an upright head that faces the display; errors as above."""
    if not (math.isfinite(eyes) and 0 < eyes <= WIDEST_EYES):
        rule = f"it must be above 0 and at most {WIDEST_EYES:g} mm"
        raise UsageError(f"{eyes:g} mm is out of range", parameter="eyes", rule=rule)
    x, y, z = check_eye(head)
    return (x - eyes / 2, y, z), (x + eyes / 2, y, z)


def write_pair(pair: FloatArray, path: Path, stereo: Stereo, transfer: Transfer) -> None:
    """Write a :func:`stereo_pair`, the left eye's picture on its left, as JPS or MPO by the file's ending.

    Raises
    ------
    UsageError
        It is no pair, or halved, which MPO files cannot say.
    OutputError
        The file cannot be written.
    """
    is_jps = path.suffix.lower() == ".jps"
    if stereo == "anaglyph" or (stereo == "half" and not is_jps):
        rule = "MPO files hold two whole pictures, JPS files two beside each other"
        raise UsageError(f"'{stereo}' as {path.suffix}", parameter="stereo", rule=rule, fix="take the full width")
    left, right = np.split(quantize(pair, 8, transfer), 2, axis=1)
    data = encode_jps(left, right, half=stereo == "half") if is_jps else encode_mpo(left, right)
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def side_by_side(left: FloatArray, right: FloatArray, *, half: bool = False) -> FloatArray:
    """Two pictures ``(height, width, 3)`` next to each other, the left eye's on the left.

    With ``half`` each column is the mean of what it covers of a picture, in linear light, and the result has the width
    of one picture, rounded up to an even number.
    """
    if half:
        left, right = half_width(left), half_width(right)
    return np.concatenate([left, right], axis=1)


def anaglyph(left: FloatArray, right: FloatArray) -> FloatArray:
    """Red-cyan anaglyph of two pictures in linear RGB, red glass on the left, by Dubois' least-squares projection."""
    pair = np.clip(left, 0, 1) @ DUBOIS_LEFT.T + np.clip(right, 0, 1) @ DUBOIS_RIGHT.T
    mixed: FloatArray = np.clip(pair, 0, 1).astype(np.float32)
    return mixed


def head_path(file: Path) -> list[Eye]:
    """Positions of a head from a text file: ``X,Y,Z`` in mm on each line; empty lines and ``#`` lines are skipped.

    Raises
    ------
    UsageError
        If the file cannot be read, a line is no position in front of the lens plane, or there are none or too many.
    """
    places: list[Eye] = []
    check_kind(file, UsageError)
    try:
        if file.stat().st_size > MOST_BYTES:
            raise UsageError("is too large", where=str(file), rule=f"at most {MOST_BYTES} bytes")
        with file.open(encoding="utf-8") as lines:
            for number, line in enumerate(lines, 1):
                text = line.strip()
                if not text or text.startswith("#"):
                    continue
                places.append(_position(text, f"{file}:{number}"))
                if len(places) > MOST_POSITIONS:
                    raise UsageError("too many positions", where=str(file), rule=f"at most {MOST_POSITIONS}")
    except UnicodeDecodeError:
        raise UsageError("is no text", where=str(file), rule="X,Y,Z in mm on each line") from None
    except OSError as error:
        raise unreadable(Path(file), error, UsageError, rule="X,Y,Z in mm on each line") from None
    if not places:
        raise UsageError("there is no position in it", where=str(file), rule="X,Y,Z in mm on each line")
    return places


def _position(text: str, where: str) -> Eye:
    rule = "each line is X,Y,Z in mm, z above 0"
    try:
        x, y, z = (float(part) for part in text.split(","))
        return check_eye((x, y, z))
    except (ValueError, UsageError):
        raise UsageError(f"'{text[:40]}' is no position", where=where, rule=rule) from None


def half_width(pixels: FloatArray) -> FloatArray:
    """Half the columns of linear light, the last one doubled where their number is odd: each the mean of two."""
    even = np.concatenate([pixels, pixels[:, -1:]], axis=1) if pixels.shape[1] % 2 else pixels
    return ((even[:, 0::2] + even[:, 1::2]) / 2).astype(np.float32)
