"""``lippmann pitch-test`` and ``lippmann marks``, and the options that describe a print."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.shared import options, parse
from lippmann.cli.shared.console import Console
from lippmann.errors import DisplayError, OutputError, UsageError

if TYPE_CHECKING:
    from lippmann.display import Display
    from lippmann.display.formats.print_sheet import Print
    from lippmann.image import IntegralImage

Lpi = Annotated[str | None, typer.Option("--lpi", help="Pitch of the lens sheet in lenses per inch.")]
PrintLpi = Annotated[
    str | None,
    typer.Option("--print-lpi", help="Print pitch in lenses per inch from a pitch test, in place of --lpi."),
]
Ppi = Annotated[str | None, typer.Option("--ppi", help="Resolution in pixels per inch.")]
Size = Annotated[
    str | None, typer.Option("--size", help="Of a print: WIDTHxHEIGHT with a unit, such as 200x300mm or 8x10in.")
]
Distance = Annotated[
    str | None,
    typer.Option("--viewing-distance", help="Viewing distance, such as 600mm, or infinite. Default: 500mm."),
]
Thickness = Annotated[str | None, typer.Option("--thickness", help="Thickness of the sheet, such as 0.66mm or 26mil.")]
Index = Annotated[str | None, typer.Option("--index", help="Refractive index of the sheet. Default: 1.57.")]
Field = Annotated[
    str | None,
    typer.Option("--field", help="Field of view in degrees, instead of --thickness. Default: 54."),
]
MarksMargin = Annotated[
    str | None, typer.Option("--marks", help="Add a margin of this width, such as 10mm, with alignment marks.")
]

_PRINT = "print"


def print_of(**texts: str | None) -> Print:
    """The print that the options describe; ``texts`` are their values by parameter name.

    Raises
    ------
    DisplayError
        If a value is missing or invalid; names the option.
    """
    from lippmann.display.formats.print_sheet import print_of_texts

    try:
        return print_of_texts({_option(key): text for key, text in texts.items() if text is not None})
    except DisplayError as error:
        raise DisplayError(error.what, where=f"--{error.where}", rule=error.rule, fix=error.fix) from None


def display_of(name: str, **texts: str | None) -> Display:
    """The display ``name``; ``print`` is described by ``texts``, the values of the print options by parameter name.

    Raises
    ------
    DisplayError
        If the display is unknown, or a print option is missing or invalid.
    UsageError
        If print options are given for another display.
    """
    from lippmann.display import load_display

    if name == _PRINT:
        return print_of(**texts).display()
    for key, text in texts.items():
        if text is not None:
            rule = f"it applies to --display {_PRINT} only"
            raise UsageError(f"does not apply to the display {name}", where=f"--{_option(key)}", rule=rule)
    return load_display(name)


def margin_of(text: str | None, display: Display, *, in_frames: bool) -> float | None:
    """The margin of ``--marks`` in mm; None without ``--marks``.

    Raises
    ------
    UsageError
        If the margin is out of range, the display has no upright cylindrical lenses, or frames are rendered.
    """
    if text is None:
        return None
    from lippmann.calibration.alignment_marks import Marks
    from lippmann.display.units import length

    if in_frames:
        raise UsageError("does not apply to frames of a moving scene", where="--marks", fix="leave it out")
    try:
        return Marks(display, length(text, "--marks")).margin
    except UsageError as error:
        parameter = "marks" if error.parameter == "margin" else error.parameter
        raise UsageError(error.what, where=error.where, parameter=parameter, rule=error.rule, fix=error.fix) from None


def marked(image: IntegralImage, margin: float | None) -> IntegralImage:
    """The picture with a margin of ``margin`` mm and its marks; the picture itself if ``margin`` is None."""
    if margin is None:
        return image
    from lippmann.calibration.alignment_marks import with_marks

    return with_marks(image, margin)


def marks(
    picture: options.Picture,
    output: options.Output,
    margin: Annotated[str, typer.Option("--margin", help="Width of the margin with a unit, such as 10mm.")] = "10mm",
    display: options.PictureDisplay = None,
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Add a margin with alignment marks to a picture for print."""
    from lippmann.calibration.marked_files import write_marked
    from lippmann.display.units import length
    from lippmann.image.streamed import open_picture
    from lippmann.image.write import check_output, format_for

    console = Console(quiet, as_json)
    check_output(output, format_for(output, bits)[0])
    width = length(margin, "--margin")
    image = open_picture(picture, display=parse.display(display))
    with console.progress() as progress:
        panel = write_marked(image, output, width, bits=bits, progress=progress).panel
    result = {"output": str(output), "size": [panel.width, panel.height], "size_mm": list(panel.size_mm)}
    console.result(result, f"{output}: {panel.width}x{panel.height} pixels, {_size(panel.size_mm)}")


def pitch_test(
    output: Annotated[Path, typer.Option("--output", "-o", help="TIFF file to write.")],
    lpi: Lpi = None,
    print_lpi: PrintLpi = None,
    ppi: Ppi = None,
    size: Size = None,
    viewing_distance: Distance = None,
    thickness: Thickness = None,
    index: Index = None,
    field: Field = None,
    strips: Annotated[int, typer.Option("--strips", help="Number of strips.")] = 21,
    step: Annotated[
        float | None,
        typer.Option("--step", help="Step between strips in lenses per inch. Default: half a lens over the width."),
    ] = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Write a pitch test: strips at slightly different print pitches, to find the sheet's."""
    from lippmann.calibration.pitch_strips import PitchTest
    from lippmann.codecs.tiff_strips import write_tiff_bands
    from lippmann.display.pixel_window import PixelWindow
    from lippmann.runtime.atomic_write import check_writable, replacing

    console = Console(quiet, as_json)
    if output.suffix.lower() not in (".tif", ".tiff"):
        rule = "a pitch test is a TIFF file, which holds its resolution"
        raise OutputError(f"the ending is '{output.suffix}'", where=str(output), rule=rule)
    sheet = print_of(
        lpi=lpi,
        print_lpi=print_lpi,
        ppi=ppi,
        size=size,
        viewing_distance=viewing_distance,
        thickness=thickness,
        index=index,
        field=field,
    )
    test = PitchTest(sheet, strips, step)
    check_writable(output)
    width, height = sheet.pixels
    with console.progress() as progress, replacing(output) as temporary:
        write_tiff_bands(
            temporary,
            (width, height),
            lambda first, last: test.draw(PixelWindow(0, first, width, last - first)),
            pixel_pitch=25.4 / sheet.ppi,
            progress=progress,
        )
    values = [strip.lpi for strip in test.all_strips]
    result = {"output": str(output), "size": [width, height], "expected": sheet.pitch_on_print, "strips": values}
    texts = [strip.text for strip in test.all_strips]
    line = f"{output}: {strips} strips from {texts[0]} to {texts[-1]} lpi, {sheet.pitch_on_print:.6g} expected"
    console.result(result, f"{line}, {width}x{height} pixels at {sheet.ppi:g} ppi")


def _option(parameter: str) -> str:
    return parameter.replace("_", "-")


def _size(size_mm: tuple[float, float]) -> str:
    return f"{size_mm[0]:.2f}x{size_mm[1]:.2f} mm"
