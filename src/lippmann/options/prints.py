"""A print behind a lens sheet, and what is done to its picture: texts as they are typed, with their units."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from lippmann.options.option import Options, option

_print = partial(option, default=None, group="Print")


@dataclass(frozen=True)
class PrintOptions(Options):
    """The display ``print``; see :mod:`lippmann.display.formats.print_sheet`, which reads the texts."""

    lpi: str | None = _print(help="Pitch of the lens sheet in lenses per inch.", first=True)
    print_lpi: str | None = _print(
        help="Print pitch in lenses per inch from a pitch test, in place of `lpi`.", first=True
    )
    ppi: str | None = _print(help="Resolution in pixels per inch.", first=True)
    size: str | None = _print(
        help="Size of the print with a unit, such as 200x300mm or 8x10in, or A4.", first=True, metavar="WIDTHxHEIGHT"
    )
    viewing_distance: str | None = _print(help="Viewing distance, such as 600mm, or infinite. Default: 500mm.")
    thickness: str | None = _print(help="Thickness of the sheet, such as 0.66mm or 26mil.")
    index: str | None = _print(help="Refractive index of the sheet. Default: 1.57.")
    field: str | None = _print(
        help="Field of view in degrees. Default: that of the best focus with `thickness`, else 54."
    )


@dataclass(frozen=True)
class FinishOptions(Options):
    """Steps that prepare a picture for print."""

    bleed: str | None = _print(
        help="Of a print: go on by this width beyond every edge, such as 3mm; it is cut off.", first=True
    )
    marks: str | None = _print(
        help="Of a print: add a margin of this width, such as 10mm, with alignment marks.", first=True
    )
    icc: Path | None = _print(help="Of a print: convert to this ICC profile (RGB). Default: sRGB.", first=True)
    mirror: bool = _print(default=False, help="Of a print: write it mirrored, for ink on the back of the lenses.")
