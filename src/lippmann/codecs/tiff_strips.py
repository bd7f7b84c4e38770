"""TIFF files written band by band, so that a print larger than memory can be drawn.

They have strips and, up to four gigabytes, classic offsets: printers' programs read those, and not always others.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from lippmann.codecs.types import Pixels
from lippmann.progress import Progress, ProgressCallback, silent

_MM_PER_INCH = 25.4

#: Values in one strip of the file: some hundred kilobytes, as readers like them.
_STRIP = 1 << 19

#: Compression level: higher ones save a tenth of the space for three to twelve times the time.
_LEVEL = 1

#: Above this many bytes before packing the file is a BigTIFF, for which classic offsets would be too short.
_CLASSIC = (1 << 32) - (1 << 25)


def write_tiff_bands(
    path: Path,
    size: tuple[int, int],
    band: Callable[[int, int], Pixels],
    *,
    pixel_pitch: float,
    description: str = "",
    icc: bytes = b"",
    progress: ProgressCallback = silent,
) -> None:
    """Write a grey or RGB picture of ``size`` (width, height), losslessly compressed (deflate, whole numbers with
    predictor).

    Parameters
    ----------
    band:
        ``band(first, last)`` gives the rows from ``first`` up to ``last``: ``(last - first, width)`` grey values or
        ``(last - first, width, 3)`` colours, uint8, uint16 or float32. It is asked in order, each row once but
        the first, which says what comes.
    pixel_pitch:
        Millimetres; becomes the resolution in dots per inch.
    description:
        ASCII; becomes ``ImageDescription``.
    icc:
        ICC profile of the values; empty without.
    """
    import tifffile

    width, height = size
    first = band(0, 1)
    channels = first.shape[2:]
    rows = max(1, _STRIP // (width * (channels[0] if channels else 1)))

    def strips() -> Iterator[bytes]:
        for top in range(0, height, rows):
            bottom = min(top + rows, height)
            yield zlib.compress(_differences(band(top, bottom)).tobytes(), _LEVEL)
            progress(Progress("draw", bottom, height))

    with tifffile.TiffWriter(path, bigtiff=width * height * first[0, 0].nbytes > _CLASSIC) as file:
        file.write(
            strips(),
            shape=(height, width, *channels),
            dtype=first.dtype,
            photometric="rgb" if channels else "minisblack",
            rowsperstrip=rows,
            compression="zlib",
            predictor=_is_whole(first),
            resolution=(_MM_PER_INCH / pixel_pitch,) * 2,
            resolutionunit="INCH",
            description=description,
            metadata=None,
            software="Lippmann",
            iccprofile=icc or None,
        )


def _is_whole(values: Pixels) -> bool:
    return values.dtype.kind == "u"


def _differences(values: Pixels) -> Pixels:
    """Each value less the one on its left, modulo the type's range: TIFF's horizontal predictor."""
    return np.diff(values, axis=1, prepend=values.dtype.type(0)) if _is_whole(values) else values
