"""Interlaced prints: photographs woven for a lens sheet, written strip by strip with resolution and ICC profile.

The photographs cover the whole sheet with its bleed.

Lenses along stand upright and part the photographs from left to right: for depth, and for flips that a turn of the
print shows. Lenses across lie and part them from above to below, for flips: the print is woven lying on its side, the
photographs' tops on the left, so the first photograph is seen from above.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from lippmann.calibration.finish import NO_FINISH, Finish
from lippmann.codecs.icc import Profile, name_of
from lippmann.codecs.png import encode_png
from lippmann.codecs.tiff_strips import write_tiff_bands
from lippmann.codecs.types import Pixels
from lippmann.display import Display
from lippmann.errors import OutputError, PictureError, UsageError
from lippmann.image.encoding import FORMATS, TEXT_KEY, converted_values, mirrored_in_file, profile_in_file
from lippmann.image.metadata import Metadata, to_text
from lippmann.image.stored_values import FloatArray
from lippmann.options.choices import Correction
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.quilts.photos import Photos
from lippmann.quilts.weave import ViewChoice, Weaving, check_weave, weave_provenance, weave_window
from lippmann.runtime.atomic_write import check_writable, replacing

Lenses = Literal["along", "across"]

#: View columns per lens: bilinear samples between them stay sharp.
_COLUMNS_PER_LENS = 2

#: Rows of a PNG that are woven at a time.
_ROWS = 64


def view_size(display: Display) -> tuple[int, int]:
    """Width and height in pixels beyond which a display shows no more of a view."""
    return _COLUMNS_PER_LENS * display.lens_grid.columns, display.panel.height


def check_interlaced_path(path: Path) -> None:
    """Raise :class:`OutputError` unless ``path`` is a PNG or TIFF that can be written."""
    if FORMATS.get(path.suffix.lower()) not in ("png", "tiff"):
        raise OutputError(f"the ending is '{path.suffix}'", where=str(path), rule="a print is a .png or .tif file")
    check_writable(path)


def write_interlaced(
    photos: Photos,
    display: Display,
    path: Path,
    *,
    lenses: Lenses = "along",
    choice: ViewChoice = "linear",
    correct: Correction = "none",
    headroom: float = 0.0,
    scene: str = "",
    finish: Finish = NO_FINISH,
    progress: ProgressCallback = silent,
) -> tuple[tuple[int, int], tuple[str, ...]]:
    """Weave photographs for a display and write the picture with its resolution and ICC profile.

    A TIFF is made some rows at a time, so that it may be larger than memory; a PNG is held in memory.

    Parameters
    ----------
    photos:
        The photographs, turned for lenses across.
    display:
        A lenticular display; for lenses across, an upright one, which is turned to the right by 90 degrees. Of a print
        it includes the bleed.
    path:
        The PNG or TIFF file. With lenses along it carries the display.
    lenses:
        ``along``: lens axes upright; ``across``: lying.
    choice:
        ``nearest``: one view per sub-pixel; ``linear``: a mixture of two.
    correct, headroom:
        As for :func:`~lippmann.quilts.weave.weave`, with lenses along.
    scene:
        Name for the provenance.
    finish:
        Margin with marks (with lenses along only) and mirroring. The photographs have the profile already.
    progress:
        Called after every strip.

    Returns
    -------
    Width and height in pixels, and what is to be said of the picture.

    Raises
    ------
    PictureError
        If the display is not lenticular, or lenses across are slanted.
    UsageError
        If a margin is out of range, or is asked for with lenses across.
    OutputError
        If the file cannot be written, or is no PNG or TIFF.
    """
    check_interlaced_path(path)
    check_weave(photos.quilt, display, choice)
    across = lenses == "across"
    if across and not display.lattice.rows_are_alike:
        raise PictureError(f"the lenses of {display.name} are slanted", rule="lenses across are those of a print")
    if across and finish.margin is not None:
        raise UsageError("marks are for upright lenses", parameter="marks", fix='use lenses="along"')
    if across and correct != "none":
        raise UsageError("is for upright lenses", parameter="correct", fix='use lenses="along"')
    whole = replace(display, sheet=None)  # no part of which is cut off: the photographs cover it
    weaving = Weaving(photos.quilt, whole, choice, correct, headroom)
    options, notes = weaving.describe_correction()
    if across:
        notes += ("a replay of lying lenses needs the file turned to the left: see docs/how-to/print.md",)
    finished = replace(finish, profile=Profile(name_of(photos.icc), photos.icc) if photos.icc else None).display(
        display
    )
    panel = finished.panel
    size = (panel.height, panel.width) if across else (panel.width, panel.height)
    metadata = Metadata(finished, np.eye(4), weave_provenance(photos.quilt, choice, scene, options, notes))
    text = "" if across else to_text(metadata)  # a display with lying lenses cannot be described

    def weave_rows(first: int, last: int) -> FloatArray:
        if across:
            return np.rot90(weave_window(photos.quilt, whole, choice, (0, panel.height), (first, last)), -1)
        return weaving.rows(first, last)

    printed = replace(finish, profile=None).rows(weave_rows, display)

    def rows(first: int, last: int) -> Pixels:
        return mirrored_in_file(converted_values(printed(first, last), "uint8", "srgb"), finished)

    icc = profile_in_file(finished, "uint8", "srgb", photos.icc)

    with replacing(path) as temporary:
        if FORMATS[path.suffix.lower()] == "tiff":
            write_tiff_bands(
                temporary,
                size,
                rows,
                pixel_pitch=panel.pixel_pitch,
                description=text,
                icc=icc,
                progress=progress,
            )
        else:
            codes = np.empty((size[1], size[0], 3), dtype=np.uint8)
            for first in range(0, size[1], _ROWS):
                last = min(first + _ROWS, size[1])
                codes[first:last] = rows(first, last)
                progress(Progress("weave", last, size[1]))
            texts = {TEXT_KEY: text} if text else {}
            encoded = encode_png(codes, text=texts, pixel_pitch=panel.pixel_pitch, icc=icc)
            temporary.write_bytes(encoded)
    return size, notes
