"""The flat grid of pixels behind the lenses."""

from __future__ import annotations

from dataclasses import dataclass

from lippmann.display.checks import finite, positive, whole_count
from lippmann.display.ops import Array, ArrayOps
from lippmann.errors import DisplayError

Offset = tuple[float, float]
SubpixelOffsets = tuple[Offset, Offset, Offset]

#: A plain RGB stripe: three sub-pixels side by side, each a third of a pixel wide.
RGB_STRIPE: SubpixelOffsets = ((-1 / 3, 0.0), (0.0, 0.0), (1 / 3, 0.0))


@dataclass(frozen=True)
class Panel:
    """A screen or a printed sheet of ``width`` x ``height`` square pixels.

    Parameters
    ----------
    width, height:
        Pixels across and down, each at least 1.
    pixel_pitch:
        Size of a pixel in millimetres.
    subpixel_offsets:
        Place of the centres of R, G and B within the pixel, ``(right, down)`` from the pixel's centre in pixels,
        each within one pixel.

    Raises
    ------
    DisplayError
        If a count is not a whole number of at least 1, or a length is not finite and positive.
    """

    width: int
    height: int
    pixel_pitch: float
    subpixel_offsets: SubpixelOffsets = RGB_STRIPE

    def __post_init__(self) -> None:
        object.__setattr__(self, "width", whole_count(self.width, "panel.width"))
        object.__setattr__(self, "height", whole_count(self.height, "panel.height"))
        object.__setattr__(self, "pixel_pitch", positive(self.pixel_pitch, "panel.pixel_pitch"))
        object.__setattr__(self, "subpixel_offsets", _checked_offsets(self.subpixel_offsets))

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the pixel area in millimetres."""
        return self.width * self.pixel_pitch, self.height * self.pixel_pitch

    def point(self, u: Array, v: Array, ops: ArrayOps) -> tuple[Array, Array]:
        """Millimetres (x right, y up, origin in the middle) of continuous pixel coordinates.

        ``u`` counts columns from the left edge, ``v`` rows from the top edge: column ``c`` covers ``c <= u < c + 1``
        and its centre is ``c + 0.5``.
        """
        return (u - 0.5 * self.width) * self.pixel_pitch, (0.5 * self.height - v) * self.pixel_pitch

    def coordinates(self, x: Array, y: Array, ops: ArrayOps) -> tuple[Array, Array]:
        """Continuous pixel coordinates of a point in millimetres; the inverse of :meth:`point`."""
        return x / self.pixel_pitch + 0.5 * self.width, 0.5 * self.height - y / self.pixel_pitch

    def subpixel_point(self, u: Array, v: Array, c: Array, ops: ArrayOps) -> tuple[Array, Array]:
        """:meth:`point` displaced by the offset of the sub-pixel ``c``: 0 (R), 1 (G), 2 (B); an int or an array."""
        red, green, blue = self.subpixel_offsets
        if isinstance(c, int):
            right, down = self.subpixel_offsets[c]
            return self.point(u + right, v + down, ops)
        # Sums inside `where`, since a choice between two plain numbers has no precision of its own.
        is_red, is_green = c < 0.5, c < 1.5
        u = ops.where(is_red, u + red[0], ops.where(is_green, u + green[0], u + blue[0]))
        v = ops.where(is_red, v + red[1], ops.where(is_green, v + green[1], v + blue[1]))
        return self.point(u, v, ops)


def _checked_offsets(offsets: object) -> SubpixelOffsets:
    key = "panel.subpixel_offsets"
    rule = "it must be three pairs (right, down) for R, G and B, in pixels, each number between -1 and 1"
    try:
        pairs = [tuple(pair) for pair in offsets]  # type: ignore[attr-defined]
    except TypeError:
        pairs = []
    if len(pairs) != 3 or any(len(pair) != 2 for pair in pairs):
        raise DisplayError(f"subpixel_offsets is {offsets!r}", where=key, rule=rule)
    checked = []
    for pair in pairs:
        right, down = (finite(value, key, rule=rule) for value in pair)
        if abs(right) > 1 or abs(down) > 1:
            raise DisplayError(f"subpixel_offsets holds {pair!r}", where=key, rule=rule)
        checked.append((right, down))
    return checked[0], checked[1], checked[2]
