"""Pictures that are looked at without ever being whole in memory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.image.codec import FormatName, check_stored, linear_values
from lippmann.image.formats import metadata_for, read_info, read_picture
from lippmann.image.integral_image import FloatArray, IntegralImage, Stored
from lippmann.image.pixel_source import ChunkedPixels, open_pixels
from lippmann.image.provenance import Provenance
from lippmann.image.views import view_grid
from lippmann.store.grid import Window

#: Pictures of more pixels are read piece by piece: as float32 they would take 400 MB and more.
LARGE = 1 << 25


class Picture(Protocol):
    """What an :class:`IntegralImage` and a :class:`LargePicture` have in common."""

    @property
    def display(self) -> Display:
        """The display that the picture is for."""
        ...

    @property
    def provenance(self) -> Provenance:
        """How the picture was made."""
        ...

    def take(self, row: NDArray[Any], column: NDArray[Any], channels: slice = ...) -> FloatArray:
        """Linear values of single pixels, ``(..., channels)``."""
        ...


@dataclass(frozen=True, eq=False)
class LargePicture:
    """A picture in a file, read as it is asked for. Fields as those of :class:`IntegralImage`.

    Attributes
    ----------
    source:
        The values as stored.
    """

    source: ChunkedPixels
    display: Display
    world_from_display: NDArray[np.float64]
    provenance: Provenance
    stored: Stored
    maps: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    def take(self, row: NDArray[Any], column: NDArray[Any], channels: slice = slice(0, 3)) -> FloatArray:
        """Linear values of single pixels, ``(..., channels)``."""
        return linear_values(self.source.take(row, column)[..., channels], self.provenance.transfer)

    def rows(self, first: int, last: int) -> FloatArray:
        """``(last - first, W, 3)`` linear values of whole rows."""
        values = self.source.window(Window(first, 0, last - first, self.source.width))
        return linear_values(values, self.provenance.transfer)

    @property
    def views_are_exact(self) -> bool:
        """As :attr:`IntegralImage.views_are_exact`."""
        return view_grid(self.display).exact

    @property
    def views_note(self) -> str:
        """As :attr:`IntegralImage.views_note`."""
        return view_grid(self.display).note


def open_picture(path: Path, *, display: Display | None = None) -> IntegralImage | LargePicture:
    """A picture from a file: whole, or piece by piece where it is large and its format allows that.

    Parameters and errors as for :func:`lippmann.image.formats.read_picture`.
    """
    info = read_info(path)
    if info.width * info.height <= LARGE or info.format not in ("tiff", "zarr"):
        return read_picture(path, display=display)
    metadata = metadata_for(info, path, display)
    name = cast(FormatName, info.format)
    check_stored(info.stored, name, path)
    return LargePicture(
        open_pixels(path, name),
        metadata.display,
        metadata.world_from_display,
        metadata.provenance,
        cast(Stored, info.stored),
    )
