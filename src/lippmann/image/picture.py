"""The interface of pictures in memory and on disk: values by windows, rows and single pixels."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np

from lippmann.display import Display
from lippmann.display.pixel_window import PixelWindow
from lippmann.errors import PictureError, UsageError
from lippmann.image.encoding import linear_values
from lippmann.image.provenance import Provenance
from lippmann.image.stored_values import FloatArray, Indices, Layer, Matrix, Stored, Values
from lippmann.image.views import Resampling, view_grid

#: Deviation of ``world_from_display`` from a rotation and scales that rounding may leave.
_TOLERANCE = 1e-6


class Picture(ABC):
    """The pixels of a panel: :class:`~lippmann.image.IntegralImage` in memory, or
    :class:`~lippmann.image.LargePicture` in a file that is decoded piece by piece.

    Attributes
    ----------
    display:
        Display of the picture; its panel has ``W x H`` pixels.
    world_from_display:
        ``(4, 4)`` affine map from the display frame (mm) to the scene.
    provenance:
        How the picture was made.
    maps:
        Layers beside the RGB by name, ``(H, W)`` or ``(H, W, 2 to 4)``.
    stored:
        Type of the values in the picture's file; ``float32`` if it has none.
    """

    display: Display
    world_from_display: Matrix
    provenance: Provenance
    maps: Mapping[str, Layer]
    stored: Stored

    @abstractmethod
    def window(self, window: PixelWindow) -> Values:
        """``(rows, columns, 3)`` values of a rectangle as the picture holds them: linear floats or codes."""

    @abstractmethod
    def take(self, row: Indices, column: Indices, channels: slice = slice(0, 3)) -> FloatArray:
        """Linear RGB ``(..., channels)`` of single pixels; ``row`` and ``column`` broadcast to ``(...)``."""

    def held_rows(self, first: int, last: int) -> Values:
        """``(last - first, W, 3)`` values of whole rows as the picture holds them: linear floats or codes."""
        return self.window(PixelWindow(0, first, self.display.panel.width, last - first))

    def rows(self, first: int, last: int) -> FloatArray:
        """``(last - first, W, 3)`` linear RGB of whole rows."""
        return linear_values(self.held_rows(first, last), self.provenance.transfer)

    @property
    def views_are_exact(self) -> bool:
        """Whether the views are a permutation of the pixels; otherwise they are resampled."""
        return view_grid(self.display).exact

    @property
    def views_note(self) -> str:
        """A sentence on how the views deviate from exact ones; empty if they do not."""
        return view_grid(self.display).note

    def replay(
        self,
        eye: tuple[float, float, float] | None = None,
        *,
        size: tuple[int, int] | None = None,
        filter: Resampling = "nearest",
        subpixels: bool | None = None,
        optics: bool = False,
    ) -> FloatArray:
        """Linear RGB ``(height, width, 3)`` that an eye at ``eye`` (mm, display frame) sees.

        Parameters, defaults and errors are those of :func:`lippmann.viewing.replay.replay`; with ``optics`` those of
        :func:`lippmann.viewing.optical_replay.replay_optics`, which takes the place of ``filter`` and ``subpixels``.
        """
        from lippmann.viewing.replay import replay

        if optics:
            from lippmann.viewing.optical_replay import replay_optics

            if (filter, subpixels) != ("nearest", None):
                rule = "the lens says which sub-pixels are seen, and how much of each"
                parameter = "subpixels" if filter == "nearest" else "filter"
                raise UsageError("given beside optics", parameter=parameter, rule=rule, fix="leave it out")
            return replay_optics(self, eye, size=size)
        return replay(self, eye, size=size, filter=filter, subpixels=subpixels)


def checked_placement(matrix: object) -> Matrix:
    """``matrix`` as a read-only ``(4, 4)`` float64 array; a :class:`PictureError` if it places no display.

    Columns 0 to 2 are the display's axes in the world: right-handed, x and y at a right angle and equally long. That of
    z may be longer, where the display shows the scene's depth compressed, and lean, where a camera's lens is shifted.
    """
    rule = "it must be 4 x 4: a rotation times a scale (z may differ and lean), a translation, and (0, 0, 0, 1) below"
    try:
        values: Matrix = np.array(matrix, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise PictureError("world_from_display is no matrix", rule=rule) from None
    if values.shape != (4, 4) or not np.isfinite(values).all() or list(values[3]) != [0, 0, 0, 1]:
        raise PictureError(f"world_from_display is {values.tolist()}", rule=rule)
    linear = values[:3, :3]
    with np.errstate(all="ignore"):  # what overflows places nothing either: NaN is within no tolerance
        lengths = np.linalg.norm(linear, axis=0)
        axes = linear / lengths
        is_regular = np.linalg.det(axes) > 0.0 and abs(lengths[0] / lengths[1] - 1.0) <= _TOLERANCE
        is_square = abs(axes[:, 0] @ axes[:, 1]) <= _TOLERANCE
    if not (is_regular and is_square):
        raise PictureError(f"world_from_display is {values.tolist()}", rule=rule)
    values.flags.writeable = False
    return values
