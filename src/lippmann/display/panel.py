"""The flat grid of pixels behind the lenses; rectangles of whole pixels, and a picture cut into a grid of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from lippmann.display.array_ops import Array, ArrayOps
from lippmann.display.validation import finite, positive, whole_count
from lippmann.errors import DisplayError

Offset = tuple[float, float]
SubpixelOffsets = tuple[Offset, Offset, Offset]

#: A plain RGB stripe: three sub-pixels side by side, each a third of a pixel wide.
RGB_STRIPE: SubpixelOffsets = ((-1 / 3, 0.0), (0.0, 0.0), (1 / 3, 0.0))

#: Pixels of several kinds: rows of a pattern that repeats over the panel, from its top left pixel.
SubpixelCells = tuple[tuple[SubpixelOffsets, ...], ...]

#: Most rows and columns of such a pattern; panels have up to 4, and every kind costs time at every sub-pixel.
MAXIMUM_CELLS = 8


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
    subpixel_cells:
        For panels whose pixels are of several kinds: rows of such offsets, up to 8 x 8, a pattern that repeats over
        the panel from its top left pixel. ``subpixel_offsets`` is then their mean, whatever was given. None where all
        pixels are alike.

    Raises
    ------
    DisplayError
        If a count is not a whole number of at least 1, or a length is not finite and positive.

    Examples
    --------
    >>> lippmann.Panel(1536, 2048, pixel_pitch=0.0785).width
    1536
    """

    width: int
    height: int
    pixel_pitch: float
    subpixel_offsets: SubpixelOffsets = RGB_STRIPE
    subpixel_cells: SubpixelCells | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "width", whole_count(self.width, "panel.width"))
        object.__setattr__(self, "height", whole_count(self.height, "panel.height"))
        object.__setattr__(self, "pixel_pitch", positive(self.pixel_pitch, "panel.pixel_pitch"))
        object.__setattr__(self, "subpixel_offsets", _validate_offsets(self.subpixel_offsets))
        if self.subpixel_cells is not None:
            cells = _validate_cells(self.subpixel_cells)
            object.__setattr__(self, "subpixel_cells", cells)
            object.__setattr__(self, "subpixel_offsets", _mean_offsets(cells))

    @property
    def cells(self) -> SubpixelCells:
        """Rows of offsets as of ``subpixel_cells``; of pixels that are all alike a single one, their own."""
        return self.subpixel_cells or ((self.subpixel_offsets,),)

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the pixel area in millimetres."""
        return self.width * self.pixel_pitch, self.height * self.pixel_pitch

    def size_inside(self, width: int, height: int) -> tuple[int, int]:
        """Width and height in pixels of the largest picture of the panel's shape in one of ``width`` x ``height``.

        A picture that has the panel's shape to half a pixel is filled.
        """
        shape = self.width / self.height
        inside = max(1, min(width, round(height * shape))), max(1, min(height, round(width / shape)))
        return (width, height) if width == round(height * shape) or height == round(width / shape) else inside

    @property
    def subpixel_order(self) -> tuple[int, ...]:
        """The sub-pixels (0 R, 1 G, 2 B) from left to right."""
        return tuple(sorted(range(3), key=lambda c: self.subpixel_offsets[c][0]))

    def point(self, u: Array, v: Array) -> tuple[Array, Array]:
        """Millimetres (x right, y up, origin in the middle) of continuous pixel coordinates.

        ``u`` counts columns from the left edge, ``v`` rows from the top edge: column ``c`` covers ``c <= u < c + 1``
        and its centre is ``c + 0.5``.
        """
        return (u - 0.5 * self.width) * self.pixel_pitch, (0.5 * self.height - v) * self.pixel_pitch

    def coordinates(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Continuous pixel coordinates of a point in millimetres; the inverse of :meth:`point`."""
        return x / self.pixel_pitch + 0.5 * self.width, 0.5 * self.height - y / self.pixel_pitch

    def subpixel_point(self, u: Array, v: Array, c: Array, ops: ArrayOps) -> tuple[Array, Array]:
        """:meth:`point` displaced by the offset of the sub-pixel ``c``: 0 (R), 1 (G), 2 (B); an int or an array."""
        right, down = self.subpixel_offset(u, v, c, ops)
        return self.point(u + right, v + down)

    def subpixel_offset(self, u: Array, v: Array, c: Array, ops: ArrayOps) -> tuple[Array, Array]:
        """Place ``(right, down)`` of the sub-pixel ``c`` from the centre of its pixel, in pixels.

        The pixel is the one that holds the continuous pixel coordinates ``(u, v)``; they matter only where pixels are
        of several kinds.
        """
        if self.subpixel_cells is None:
            return _offset_of(self.subpixel_offsets, u * 0.0, c, ops)
        rows, columns = len(self.subpixel_cells), len(self.subpixel_cells[0])
        row, column = _remainder(ops.floor(v), rows, ops), _remainder(ops.floor(u), columns, ops)
        zero = (u + v) * 0.0
        right, down = zero, zero
        for j, cells in enumerate(self.subpixel_cells):
            for i, offsets in enumerate(cells):
                here = _offset_of(offsets, zero, c, ops)
                is_here = ops.abs(row - j) + ops.abs(column - i) < 0.5
                right, down = ops.where(is_here, here[0], right), ops.where(is_here, here[1], down)
        return right, down


def stripe(order: str, key: str) -> SubpixelOffsets:
    """Offsets of sub-pixels that stand side by side in this order, such as ``"rgb"``; ``"none"`` if they do not."""
    if order == "none":
        return (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)
    if sorted(order) != sorted("rgb"):
        rule = 'it must be an order of sub-pixels such as "rgb", "none", or three pairs [right, down] in pixels'
        raise DisplayError(f"subpixel_offsets is {order!r}", where=key, rule=rule)
    red, green, blue = ((order.index(color) - 1) / 3 for color in "rgb")
    return (red, 0.0), (green, 0.0), (blue, 0.0)


def _remainder(value: Array, count: int, ops: ArrayOps) -> Array:
    return value - count * ops.floor(value / count)


def _offset_of(offsets: SubpixelOffsets, zero: Array, c: Array, ops: ArrayOps) -> tuple[Array, Array]:
    """The offset of sub-pixel ``c``, an int or an array; ``zero`` is an array, so that the result is one."""
    red, green, blue = offsets
    if isinstance(c, int):
        return zero + offsets[c][0], zero + offsets[c][1]
    # Sums inside `where`, since a choice between two plain numbers has no precision of its own.
    is_red, is_green = c < 0.5, c < 1.5
    right = ops.where(is_red, zero + red[0], ops.where(is_green, zero + green[0], zero + blue[0]))
    down = ops.where(is_red, zero + red[1], ops.where(is_green, zero + green[1], zero + blue[1]))
    return right, down


def _validate_cells(cells: object) -> SubpixelCells:
    key = "panel.subpixel_cells"
    most = MAXIMUM_CELLS
    rule = f"it must be 1 to {most} rows of 1 to {most} cells each, all rows alike; a cell is three pairs (right, down)"
    try:
        rows = [list(row) for row in cells]  # type: ignore[attr-defined]
    except TypeError:
        rows = []
    if not 1 <= len(rows) <= most or not 1 <= len(rows[0]) <= most or any(len(row) != len(rows[0]) for row in rows):
        raise DisplayError(f"subpixel_cells is {cells!r}", where=key, rule=rule)
    return tuple(tuple(_validate_offsets(cell, key) for cell in row) for row in rows)


def _mean_offsets(cells: SubpixelCells) -> SubpixelOffsets:
    flat = [offsets for row in cells for offsets in row]
    red, green, blue = (
        (sum(o[c][0] for o in flat) / len(flat), sum(o[c][1] for o in flat) / len(flat)) for c in range(3)
    )
    return red, green, blue


def _validate_offsets(offsets: object, key: str = "panel.subpixel_offsets") -> SubpixelOffsets:
    rule = "it must be three pairs (right, down) for R, G and B, in pixels, each number between -1 and 1"
    try:
        pairs = [tuple(pair) for pair in offsets]  # type: ignore[attr-defined]
    except TypeError:
        pairs = []
    if len(pairs) != 3 or any(len(pair) != 2 for pair in pairs):
        raise DisplayError(f"{key.rpartition('.')[2]} holds {offsets!r}", where=key, rule=rule)
    checked = []
    for pair in pairs:
        right, down = (finite(value, key, rule=rule) for value in pair)
        if abs(right) > 1 or abs(down) > 1:
            raise DisplayError(f"{key.rpartition('.')[2]} holds {pair!r}", where=key, rule=rule)
        checked.append((right, down))
    return checked[0], checked[1], checked[2]


@dataclass(frozen=True)
class PixelWindow:
    """A rectangle of ``width`` x ``height`` whole pixels from column ``left`` and row ``top``, row 0 on top."""

    left: int
    top: int
    width: int
    height: int

    @property
    def right(self) -> int:
        """The column past the last."""
        return self.left + self.width

    @property
    def bottom(self) -> int:
        """The row past the last."""
        return self.top + self.height

    @property
    def rows(self) -> slice:
        """Rows of the whole picture that the rectangle covers."""
        return slice(self.top, self.bottom)

    @property
    def columns(self) -> slice:
        """Columns of the whole picture that the rectangle covers."""
        return slice(self.left, self.right)

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns, the index of the rectangle in an array of the whole picture."""
        return self.rows, self.columns

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width, the shape of an array of the rectangle's pixels."""
        return self.height, self.width

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.width * self.height

    def intersection(self, other: PixelWindow) -> PixelWindow | None:
        """The rectangle common to both; None if they share no pixel."""
        left, top = max(self.left, other.left), max(self.top, other.top)
        width, height = min(self.right, other.right) - left, min(self.bottom, other.bottom) - top
        return PixelWindow(left, top, width, height) if width > 0 and height > 0 else None

    def relative_to(self, other: PixelWindow) -> PixelWindow:
        """The same rectangle, counted from the top left pixel of ``other``."""
        return PixelWindow(self.left - other.left, self.top - other.top, self.width, self.height)


@dataclass(frozen=True)
class TileGrid:
    """Tiles of ``side`` x ``side`` pixels over ``width`` x ``height``, cut off at the right and lower edge."""

    width: int
    height: int
    side: int

    @property
    def columns(self) -> int:
        """Tiles side by side."""
        return -(-self.width // self.side)

    @property
    def rows(self) -> int:
        """Tiles one below the other."""
        return -(-self.height // self.side)

    def __len__(self) -> int:
        return self.rows * self.columns

    def __getitem__(self, index: int) -> PixelWindow:
        if not 0 <= index < len(self):
            raise IndexError(f"there is no tile {index} of {len(self)}")
        row, column = divmod(index, self.columns)
        left, top = column * self.side, row * self.side
        return PixelWindow(left, top, min(self.side, self.width - left), min(self.side, self.height - top))

    def __iter__(self) -> Iterator[PixelWindow]:
        return (self[index] for index in range(len(self)))

    def name(self, index: int) -> str:
        """The tile by its row and column, such as ``r0003_c0012``: for files and for people."""
        row, column = divmod(index, self.columns)
        return f"r{row:04}_c{column:04}"
