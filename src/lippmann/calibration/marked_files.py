"""A print's file with a margin and its marks, whatever its size."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from lippmann.calibration.alignment_marks import Marks, marked_provenance, marked_rows, with_marks
from lippmann.codecs.tiff_strips import write_tiff_bands
from lippmann.display import Display
from lippmann.errors import OutputError
from lippmann.image import IntegralImage
from lippmann.image.encoding import stored_values
from lippmann.image.metadata import Metadata, to_text
from lippmann.image.streamed import LargePicture
from lippmann.image.write import format_for
from lippmann.progress import ProgressCallback, silent
from lippmann.runtime.atomic_write import replacing


def write_marked(
    picture: IntegralImage | LargePicture,
    path: Path,
    margin: float,
    *,
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> Display:
    """Write the picture with a margin of ``margin`` mm and its marks; the display of the marked sheet.

    A picture that is not whole in memory is read and written band by band, as TIFF.

    Raises
    ------
    UsageError
        As :class:`~lippmann.calibration.alignment_marks.Marks`.
    OutputError
        As :func:`~lippmann.image.write.write_picture`, or if a large picture should become something else than TIFF.
    """
    if isinstance(picture, IntegralImage):
        marked = with_marks(picture, margin)
        marked.save(path, bits=bits)
        return marked.display
    marks = Marks(picture.display, margin)
    name, stored = format_for(path, bits, source=picture.stored)
    if name != "tiff":
        rule = "a picture of this size is written as TIFF"
        raise OutputError(f"the ending '{path.suffix}' will not do", where=str(path), rule=rule)
    sheet, transfer = marks.sheet, picture.provenance.transfer
    made = Metadata(sheet, picture.world_from_display, marked_provenance(marks, picture.provenance))

    def band(first: int, last: int) -> NDArray[Any]:
        return stored_values(marked_rows(marks, picture.rows, first, last), stored, transfer)

    with replacing(path) as temporary:
        write_tiff_bands(
            temporary,
            (sheet.panel.width, sheet.panel.height),
            band,
            pixel_pitch=sheet.panel.pixel_pitch,
            description=to_text(made),
            progress=progress,
        )
    return sheet
