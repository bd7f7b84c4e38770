"""Rectangles of whole pixels, and a picture cut into a grid of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass


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
