"""Files of prints with a margin and alignment marks."""

from __future__ import annotations

from pathlib import Path

from lippmann.calibration.alignment_marks import Marks, marked_provenance, marked_rows, with_marks
from lippmann.codecs.tiff_strips import write_tiff_bands
from lippmann.display import Display
from lippmann.errors import OutputError
from lippmann.image import IntegralImage
from lippmann.image.encoding import stored_values
from lippmann.image.metadata import Metadata, to_text
from lippmann.image.stored_values import Values
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
    """Write a picture with a margin and its alignment marks.

    Parameters
    ----------
    picture:
        The picture, in memory or in a file; a picture in a file is processed in bands.
    path:
        The file to write; TIFF for a picture in a file.
    margin:
        Width of the margin in millimetres, 3 to 100.
    bits:
        Bits per value; None: as the picture is stored.
    progress:
        Called as bands are written.

    Returns
    -------
    The display of the marked sheet.

    Raises
    ------
    UsageError
        If the margin is out of range, or the display has no upright cylindrical lenses.
    OutputError
        If the format is unknown, has no such bits, or is not TIFF for a picture in a file; or the file cannot be
        written.
    """
    if isinstance(picture, IntegralImage):
        marked = with_marks(picture, margin)
        marked.save(path, bits=bits)
        return marked.display
    marks = Marks(picture.display, margin)
    name, stored = format_for(path, bits, source=picture.stored)
    if name != "tiff":
        rule = "a picture of this size needs TIFF"
        raise OutputError(f"the ending is '{path.suffix}'", where=str(path), rule=rule)
    sheet, transfer = marks.sheet, picture.provenance.transfer
    metadata = Metadata(sheet, picture.world_from_display, marked_provenance(marks, picture.provenance))

    def band(first: int, last: int) -> Values:
        return stored_values(marked_rows(marks, picture.rows, first, last), stored, transfer)

    with replacing(path) as temporary:
        write_tiff_bands(
            temporary,
            (sheet.panel.width, sheet.panel.height),
            band,
            pixel_pitch=sheet.panel.pixel_pitch,
            description=to_text(metadata),
            progress=progress,
        )
    return sheet
