"""``lippmann pitch-test`` and ``lippmann marks``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.shared import options, parse
from lippmann.cli.shared.command_options import only, with_options
from lippmann.cli.shared.console import Console, naming
from lippmann.cli.shared.scene_source import output_of, print_of
from lippmann.errors import OutputError, UsageError
from lippmann.options.prints import FinishOptions, PrintOptions

if TYPE_CHECKING:
    from lippmann.display import Display


@with_options
def marks(
    picture: options.Picture,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="The file to write; its ending names the format. By default NAME-marks.tif in this folder; none is "
            "written if only --job-sheet is given.",
        ),
    ] = None,
    margin: Annotated[
        str, typer.Option("--margin", "--marks", help="Width of the margin with a unit, such as 10mm.")
    ] = "10mm",
    display: options.PictureDisplay = None,
    bleed: Annotated[
        str | None,
        typer.Option("--bleed", help="Bleed that a picture without its own record has on every side, such as 3mm."),
    ] = None,
    job_sheet: Annotated[
        Path | None, typer.Option("--job-sheet", help="Write a page for whoever prints and laminates: a .pdf file.")
    ] = None,
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    *,
    finishing: Annotated[FinishOptions, only("icc", "mirror")],
) -> None:
    """Add a margin with alignment marks to a picture for print, and write its job sheet."""
    from lippmann.calibration.finish import Finish, write_finished
    from lippmann.calibration.job_sheet import check_job_sheet, write_job_sheet
    from lippmann.codecs.icc import read_profile
    from lippmann.display.sheet_layout import trimmed
    from lippmann.display.validation import length
    from lippmann.image.read import open_file
    from lippmann.image.streamed import picture_of_file
    from lippmann.image.write import check_output

    console = Console(quiet, as_json)
    if job_sheet is None:
        output = output_of(output, picture, "-marks.tif")
    if output is not None:
        check_output(output, bits)
    if job_sheet is not None:
        check_job_sheet(job_sheet)
    file = open_file(picture)
    target = _display_with_bleed(parse.display(display), bleed)
    if output is None:
        printed = file.metadata_for(target).display
    else:
        icc = finishing.icc
        profile = None if icc is None else read_profile(icc)
        finish = Finish(length(margin, "--margin", unit=""), finishing.mirror, profile)
        image = picture_of_file(file, target)
        with naming(picture), console.progress() as progress:
            printed = write_finished(image, output, finish, icc=file.icc, bits=bits, progress=progress)
    if job_sheet is not None:
        write_job_sheet(printed, job_sheet, (output or picture).name)
    panel, trim = printed.panel, trimmed(printed).size_mm
    written = [str(path) for path in (output, job_sheet) if path is not None]
    result = {
        "output": None if output is None else str(output),
        "job_sheet": None if job_sheet is None else str(job_sheet),
        "size": [panel.width, panel.height],
        "size_mm": list(panel.size_mm),
        "trim_mm": list(trim),
    }
    line = f"{' and '.join(written)}: {panel.width}x{panel.height} pixels, {_size(panel.size_mm)}"
    console.result(result, f"{line}, cut to {_size(trim)}")


def _display_with_bleed(display: Display | None, bleed: str | None) -> Display | None:
    """The display that ``marks`` is given, with its bleed; None for the picture's own."""
    if bleed is None:
        return display
    from lippmann.display.sheet_layout import with_bleed
    from lippmann.display.validation import length

    width = length(bleed, "--bleed", unit="")
    if display is None:
        rule = "a picture with its own record says its bleed itself; of others --display says the trim"
        raise UsageError("needs --display", where="--bleed", rule=rule)
    return with_bleed(display, width)


@with_options
def pitch_test(
    output: Annotated[Path, typer.Option("--output", "-o", help="TIFF file to write.")] = Path("pitch-test.tif"),
    strips: Annotated[int, typer.Option("--strips", help="Number of strips.")] = 21,
    step: Annotated[
        float | None,
        typer.Option("--step", help="Step between strips in lenses per inch. Default: half a lens over the width."),
    ] = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    *,
    printed: PrintOptions,
) -> None:
    """Write a pitch test: strips at slightly different print pitches, to find the sheet's.

    It needs --lpi (or --print-lpi), --ppi and --size.
    """
    from lippmann.calibration.pitch_strips import PitchTest
    from lippmann.codecs.tiff_strips import write_tiff_bands
    from lippmann.display.panel import PixelWindow
    from lippmann.runtime.atomic_write import check_writable, replacing

    console = Console(quiet, as_json)
    if output.suffix.lower() not in (".tif", ".tiff"):
        rule = "a pitch test is a TIFF file, which holds its resolution"
        raise OutputError(f"the ending is '{output.suffix}'", where=str(output), rule=rule)
    sheet = print_of(printed)
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
    texts = [strip.text for strip in test.all_strips]
    result = {
        "output": str(output),
        "size": [width, height],
        "expected": sheet.pitch_on_print,
        "expected_strip": test.expected + 1,
        "strips": values,
    }
    line = f"{output}: {strips} strips from {texts[0]} to {texts[-1]} lpi, {sheet.pitch_on_print:.6g} expected"
    line += f": strip {test.expected + 1} from the top, labelled {texts[test.expected]}"
    console.result(result, f"{line}, {width}x{height} pixels at {sheet.ppi:g} ppi")


def _size(size_mm: tuple[float, float]) -> str:
    return f"{size_mm[0]:.2f}x{size_mm[1]:.2f} mm"
