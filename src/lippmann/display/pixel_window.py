"""A picture cut into tiles: rectangles of whole pixels, counted row by row from the top left."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Window:
    """``rows`` x ``columns`` pixels whose top left one is ``(row, column)``."""

    row: int
    column: int
    rows: int
    columns: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """What cuts the window out of an array of the whole picture."""
        return slice(self.row, self.row + self.rows), slice(self.column, self.column + self.columns)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.rows, self.columns


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

    def __getitem__(self, index: int) -> Window:
        if not 0 <= index < len(self):
            raise IndexError(f"there is no tile {index} of {len(self)}")
        row, column = divmod(index, self.columns)
        top, left = row * self.side, column * self.side
        return Window(top, left, min(self.side, self.height - top), min(self.side, self.width - left))

    def __iter__(self) -> Iterator[Window]:
        return (self[index] for index in range(len(self)))

    def name(self, index: int) -> str:
        """The tile by its row and column, such as ``r0003_c0012``: for files and for people."""
        row, column = divmod(index, self.columns)
        return f"r{row:04}_c{column:04}"
