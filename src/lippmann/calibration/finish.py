"""A picture made ready for printing: converted to an ICC profile, surrounded by marks, mirrored; and written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lippmann.calibration.alignment_marks import Marks, marked_rows
from lippmann.codecs.icc import Profile, convert_codes
from lippmann.codecs.tiff_strips import write_tiff_bands
from lippmann.color.transfer import Transfer, dequantize, quantize
from lippmann.display import Display
from lippmann.display.sheet import Sheet
from lippmann.errors import OutputError, PictureError
from lippmann.image import IntegralImage
from lippmann.image.encoding import mirrored_in_file, profile_in_file, stored_values
from lippmann.image.metadata import Metadata, to_text
from lippmann.image.stored_values import FloatArray, Stored, Values
from lippmann.image.streamed import LargePicture
from lippmann.image.write import format_for
from lippmann.progress import ProgressCallback, silent
from lippmann.runtime.atomic_write import replacing

LinearRows = Callable[[int, int], FloatArray]


@dataclass(frozen=True)
class Finish:
    """Steps that prepare a picture for print.

    Parameters
    ----------
    margin:
        Width of the margin with marks in millimetres, 3 to 100; None: no margin.
    mirrored:
        Write it mirrored from left to right, for ink on the back of the lenses.
    profile:
        ICC profile to which the colours are converted; None: the picture's own.
    """

    margin: float | None = None
    mirrored: bool = False
    profile: Profile | None = None

    @property
    def icc(self) -> bytes:
        """The profile's bytes; empty where there is none."""
        return b"" if self.profile is None else self.profile.data

    def display(self, display: Display) -> Display:
        """The display of the finished sheet.

        Raises
        ------
        UsageError
            If the margin is out of range, the display has no upright cylindrical lenses, or has marks already.
        """
        if self.margin is not None:
            display = Marks(display, self.margin).sheet
        if not self.mirrored and self.profile is None:
            return display
        sheet = display.sheet or Sheet()
        name = sheet.profile if self.profile is None else self.profile.name
        return replace(display, sheet=replace(sheet, mirrored=sheet.mirrored or self.mirrored, profile=name))

    def rows(self, rows: LinearRows, display: Display, icc: bytes = b"") -> LinearRows:
        """Rows of the finished sheet from those of its picture, linear RGB; ``icc`` is the picture's profile."""
        if self.profile is not None:
            rows = _convert(rows, icc, self.profile.data)
        if self.margin is None:
            return rows
        marks, picture = Marks(display, self.margin), rows
        return lambda first, last: marked_rows(marks, picture, first, last)

    def image(self, image: IntegralImage, icc: bytes = b"") -> IntegralImage:
        """The finished picture; its maps become zero over the margin. Errors as of :meth:`display`."""
        if self == NO_FINISH:
            return image
        self.check_colors(image.provenance.transfer)
        display = self.display(image.display)
        pixels = self.rows(image.rows, image.display, icc)(0, display.panel.height)
        m = (display.panel.width - image.display.panel.width) // 2
        maps = {name: np.pad(values, ((m, m), (m, m), (0, 0))[: values.ndim]) for name, values in image.maps.items()}
        return replace(image, pixels=pixels, display=display, maps=maps)

    def check_colors(self, transfer: Transfer) -> None:
        """Refuse to convert pictures of data, whose codes stand for no colours."""
        if self.profile is not None and transfer != "srgb":
            raise PictureError("its values are data, no colours", parameter="icc", fix="leave it out")

    def check_stored(self, stored: Stored, path: Path) -> None:
        """Refuse to convert colours for a file whose values are no codes of 8 bits."""
        if self.profile is not None and stored != "uint8":
            rule = "colours are converted to an ICC profile with 8 bits per value, in PNG and TIFF"
            raise OutputError(
                f"holds values of the type {stored}", where=str(path), rule=rule, fix="use .png or .tif with 8 bits"
            )


NO_FINISH = Finish()


def write_finished(
    picture: IntegralImage | LargePicture,
    path: Path,
    finish: Finish,
    *,
    icc: bytes = b"",
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> Display:
    """Write a picture as it is printed.

    Parameters
    ----------
    picture:
        The picture, in memory or in a file; a picture in a file is processed in bands.
    path:
        The file to write; TIFF for a picture in a file.
    finish:
        What is done to it.
    icc:
        The picture's own ICC profile; empty: what its sheet says.
    bits:
        Bits per value; None: as the picture is stored.
    progress:
        Called as bands are written.

    Returns
    -------
    The display of the finished sheet.

    Raises
    ------
    UsageError
        If the margin is out of range, the display has no upright cylindrical lenses, or has marks already.
    PictureError
        If data without colours is to be converted to a profile.
    OutputError
        If the format is unknown, has no such bits, or is not TIFF for a picture in a file; or the file cannot be
        written.
    """
    name, stored = format_for(path, bits, source=picture.stored)
    finish.check_stored(stored, path)
    finish.check_colors(picture.provenance.transfer)
    embedded = finish.icc or icc
    if isinstance(picture, IntegralImage):
        finished = finish.image(picture, icc)
        finished.save(path, bits=bits, icc=embedded)
        return finished.display
    if name != "tiff":
        rule = "a picture of this size needs TIFF"
        raise OutputError(f"the ending is '{path.suffix}'", where=str(path), rule=rule)
    display, transfer = finish.display(picture.display), picture.provenance.transfer
    rows = finish.rows(picture.rows, picture.display, icc)

    def band(first: int, last: int) -> Values:
        return mirrored_in_file(stored_values(rows(first, last), stored, transfer), display)

    with replacing(path) as temporary:
        write_tiff_bands(
            temporary,
            (display.panel.width, display.panel.height),
            band,
            pixel_pitch=display.panel.pixel_pitch,
            description=to_text(Metadata(display, picture.world_from_display, picture.provenance)),
            icc=profile_in_file(display, stored, transfer, embedded),
            progress=progress,
        )
    return display


def _convert(rows: LinearRows, source: bytes, target: bytes) -> LinearRows:
    def convert(first: int, last: int) -> FloatArray:
        codes = quantize(rows(first, last), 8, "srgb").astype(np.uint8, copy=False)
        return dequantize(convert_codes(codes, source, target), "srgb")

    return convert
