"""The interface of pictures in memory and on disk: their values by windows, rows and single pixels."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.pixel_window import PixelWindow
from lippmann.image.encoding import linear_values
from lippmann.image.provenance import Provenance
from lippmann.image.stored_values import FloatArray, Matrix, Stored, Values
from lippmann.image.views import view_grid


class Picture(ABC):
    """The pixels of a panel, in memory (:class:`~lippmann.image.IntegralImage`) or in a file that is read piece by
    piece (:class:`~lippmann.image.LargePicture`).

    Attributes
    ----------
    display:
        The display that the pixels are for; its panel has ``W x H`` pixels.
    world_from_display:
        ``(4, 4)`` similarity that puts the display frame (mm) into the scene.
    provenance:
        How the picture was made.
    maps:
        Further layers by name, ``(H, W)`` or ``(H, W, 2 to 4)``.
    stored:
        Type of the values in the picture's file.
    """

    display: Display
    world_from_display: Matrix
    provenance: Provenance
    maps: Mapping[str, NDArray[Any]]
    stored: Stored

    @abstractmethod
    def window(self, window: PixelWindow) -> Values:
        """``(rows, columns, 3)`` values of a rectangle as they are held: linear floats, or codes."""

    @abstractmethod
    def take(self, row: NDArray[Any], column: NDArray[Any], channels: slice = slice(0, 3)) -> FloatArray:
        """Linear RGB of single pixels, ``(..., channels)``; ``row`` and ``column`` broadcast to ``(...)``."""

    def held_rows(self, first: int, last: int) -> Values:
        """``(last - first, W, 3)`` values of whole rows as they are held: linear floats, or codes."""
        return self.window(PixelWindow(0, first, self.display.panel.width, last - first))

    def rows(self, first: int, last: int) -> FloatArray:
        """``(last - first, W, 3)`` linear RGB of whole rows."""
        return linear_values(self.held_rows(first, last), self.provenance.transfer)

    @property
    def views_are_exact(self) -> bool:
        """Whether the views are a permutation of the pixels; else they are resampled, see :attr:`views_note`."""
        return view_grid(self.display).exact

    @property
    def views_note(self) -> str:
        """A sentence about the way in which the views are not exact; empty if they are."""
        return view_grid(self.display).note
