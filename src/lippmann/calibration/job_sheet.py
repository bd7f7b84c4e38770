"""The job sheet of a print: one PDF page that goes with its file to whoever prints, laminates and cuts it."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from lippmann._version import VERSION
from lippmann.display import Display
from lippmann.display.sheet import Sheet
from lippmann.display.sheet_layout import trim_of
from lippmann.errors import OutputError
from lippmann.runtime.atomic_write import check_writable, replacing
from lippmann.runtime.plotting import plain_matplotlib

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_INCH = 25.4

#: A4 in inches: portrait.
_PAGE = (210 / _INCH, 297 / _INCH)

#: Left edges of the page's text and of the table's values, in shares of its width.
_LEFT, _VALUES = 0.1, 0.36

#: Points; and lines a page over the height of one.
_FONT, _LINE = 10.0, 0.021

#: Longest file name that fits beside its label, in letters.
_LONGEST = 60


def check_job_sheet(path: Path) -> None:
    """Raise :class:`OutputError` unless ``path`` is a PDF file that can be written."""
    if path.suffix.lower() != ".pdf":
        raise OutputError(f"the ending is '{path.suffix}'", where=str(path), rule="a job sheet is a .pdf file")
    check_writable(path)


def job_facts(display: Display, file: str) -> list[tuple[str, str]]:
    """Names and values of what a printer has to know; ``file`` is the name of the picture's file."""
    sheet, trim, pixel = display.sheet or Sheet(), trim_of(display), display.panel.pixel_pitch

    def size(width: int, height: int) -> str:
        return f"{width * pixel:.2f} x {height * pixel:.2f} mm, {width} x {height} pixels"

    across, _ = display.pixels_per_lens
    infinite = math.isinf(display.viewing_distance)
    return [
        ("File", file if len(file) <= _LONGEST else f"{file[: _LONGEST - 1]}…"),
        ("Sheet", size(display.panel.width, display.panel.height)),
        ("Finished print", size(trim.width, trim.height)),
        ("Bleed", f"{sheet.bleed * pixel:.2f} mm on every side" if sheet.bleed else "none"),
        ("Margin with marks", f"{sheet.margin * pixel:.2f} mm on every side" if sheet.margin else "none"),
        ("Resolution", f"{_INCH / pixel:.6g} pixels per inch"),
        ("Lens sheet", f"{_INCH / display.lattice.pitch:.6g} lenses per inch, lenses upright"),
        ("Print pitch", f"{_INCH / display.micro_image_pitch:.6g} per inch, {across:.4g} pixels per lens"),
        ("Viewing distance", "infinite" if infinite else f"{display.viewing_distance:g} mm"),
        ("Field of view", f"{display.field_of_view:.3g} degrees, air-equivalent gap {display.gap:.3g} mm"),
        ("Colours", f"RGB, profile {sheet.profile}"),
        ("Mirrored", "yes, for ink on the back of the lenses" if sheet.mirrored else "no, for ink on paper"),
    ]


def job_steps(sheet: Sheet) -> list[str]:
    """Steps of making the print, in order: ink on paper behind the lenses, or on the back of the lenses themselves."""
    dark = "until the strips above and below the picture are evenly dark" if sheet.margin else "until no bars are seen"
    cut = ["Cut at the cutting lines."] if sheet.margin else ["Cut the bleed away."] if sheet.bleed else []
    if sheet.mirrored:
        return [
            "Print the file at 100 % on the flat back of the lens sheet, lenses upright.",
            "The file is mirrored already: switch mirroring off in the print program.",
            f"Adjust the position of the lens sheet {dark} through the lenses.",
            "Cover the ink with white, or laminate white film on it.",
            *cut,
        ]
    return [
        "Print the file at 100 %, without scaling, sharpening or mirroring.",
        "Let the print dry in the room where it is laminated.",
        "Lay the lens sheet on the print: lenses up and upright, the flat back on the ink.",
        f"Turn and move the lens sheet {dark}.",
        "Laminate.",
        *cut,
    ]


def write_job_sheet(display: Display, path: Path, file: str) -> None:
    """Write the job sheet of a sheet whose picture has the name ``file`` as one page of PDF, A4.

    Raises
    ------
    OutputError
        If the file is no PDF or cannot be written.
    """
    check_job_sheet(path)
    with plain_matplotlib(), warnings.catch_warnings(), replacing(path) as temporary:
        warnings.simplefilter("ignore", UserWarning)  # letters that the font lacks are drawn as boxes
        from matplotlib.figure import Figure

        figure = Figure(figsize=_PAGE)
        figure.text(_LEFT, 0.94, "Lenticular print: job sheet", size=1.6 * _FONT, weight="bold")
        y = 0.9
        for name, value in job_facts(display, file):
            figure.text(_LEFT, y, name, size=_FONT, color="0.35")
            figure.text(_VALUES, y, value, size=_FONT, parse_math=False)
            y -= _LINE
        y -= _LINE
        figure.text(_LEFT, y, "In this order", size=1.2 * _FONT, weight="bold")
        for number, step in enumerate(job_steps(display.sheet or Sheet()), start=1):
            y -= 1.2 * _LINE
            figure.text(_LEFT, y, f"{number}.  {step}", size=_FONT)
        y -= 2 * _LINE
        _draw_sheet(figure.add_axes((_LEFT, 0.06, 1 - 2 * _LEFT, y - 0.06)), display)
        figure.text(_LEFT, 0.03, f"Lippmann {VERSION}", size=0.8 * _FONT, color="0.35")
        figure.savefig(temporary, format="pdf", metadata={"CreationDate": None, "Title": f"Job sheet of {file}"})


def _draw_sheet(axes: Axes, display: Display) -> None:
    """The sheet from the side that is printed, with its bleed and its trim, to scale."""
    from matplotlib.patches import Rectangle

    sheet, pixel = display.sheet or Sheet(), display.panel.pixel_pitch
    width, height = display.size_mm
    outlines = [("edge of the file", "solid", 0), ("end of the bleed", "dotted", sheet.margin)]
    for label, style, cut in (*outlines[: 2 if sheet.bleed else 1], ("cut here", "dashed", sheet.border)):
        away = cut * pixel
        outline = Rectangle((away, away), width - 2 * away, height - 2 * away, fill=False, linestyle=style, label=label)
        axes.add_patch(outline)
    border = sheet.border * pixel
    axes.text(width / 2, height - border - 0.04 * height, "TOP", ha="center", va="top", size=_FONT)
    axes.set(xlim=(-0.02 * width, 1.02 * width), ylim=(-0.02 * height, 1.02 * height), aspect="equal")
    axes.set_axis_off()
    axes.legend(loc="center", frameon=False, fontsize=_FONT)
