"""``lippmann export`` and ``lippmann import``: light fields in other tools' layouts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lippmann.cli.shared import options, parse
from lippmann.cli.shared.console import Console
from lippmann.cli.shared.scene_source import output_of

_LAYOUTS = "hci (4D Light Field Benchmark), lftoolbox (.mat), eslf (.png), zarr, views, or a plugin's"


def export(
    picture: options.Picture,
    layout: Annotated[str, typer.Option("--as", help=f"Layout: {_LAYOUTS}.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="File or folder to write. By default named after picture and layout, in this folder.",
            show_default=False,
        ),
    ] = None,
    distance: Annotated[
        float | None,
        typer.Option(
            "--distance",
            help="Distance of the cameras in mm, for hci and displays of parallel views. Default: 100 times the depth "
            "that the display resolves.",
        ),
    ] = None,
    bits: Annotated[
        int | None,
        typer.Option("--bits", help="Bits per value: 8, 16, or 32 (float). Default: as the picture is stored."),
    ] = None,
    display: options.PictureDisplay = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Export a picture to the layout of another light-field tool."""
    from lippmann.exchange import export_image
    from lippmann.exchange.layouts import check_target, ending_of, is_folder, with_ending
    from lippmann.image import read_picture
    from lippmann.runtime.atomic_write import check_folder_writable, check_writable

    console = Console(quiet, as_json)
    output = with_ending(layout, output_of(output, picture, f"-{layout}{ending_of(layout)}"))
    check_target(layout, output)
    (check_folder_writable if is_folder(layout) else check_writable)(output)
    image = read_picture(picture, display=parse.display(display))
    with console.progress() as progress:
        done = export_image(image, output, layout, bits=bits, distance=distance, progress=progress)
    console.remark(*done.notes)
    down, across, height, width = done.shape
    result = {
        "output": str(output),
        "layout": layout,
        "views": [across, down],
        "size": [width, height],
        "stored": done.stored,
        "notes": list(done.notes),
    }
    console.result(result, f"{output}: {across}x{down} views of {width}x{height} pixels, {done.stored}")


def import_(
    source: Annotated[Path, typer.Argument(help="File or folder of another light-field tool.")],
    output: options.OptionalOutput = None,
    layout: Annotated[str | None, typer.Option("--as", help=f"Layout: {_LAYOUTS}. Default: recognized.")] = None,
    display: Annotated[
        str | None,
        typer.Option(
            "--display", "-d", help="Display that shows the light field. Default: the one that the file describes."
        ),
    ] = None,
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Import a light field of another tool as a picture for a display."""
    from lippmann.exchange import import_image
    from lippmann.image.write import check_output

    console, output = Console(quiet, as_json), output_of(output, source, "-native.exr")
    check_output(output, bits)
    with console.progress() as progress:
        image, notes = import_image(source, layout, display=parse.display(display), progress=progress)
    image.save(output, bits=bits)
    console.remark(*notes)
    height, width = image.pixels.shape[:2]
    result = {
        "output": str(output),
        "size": [width, height],
        "display": image.display.name,
        "layers": sorted(image.maps),
        "notes": list(notes),
    }
    console.result(result, f"{output}: {width}x{height} pixels for {image.display.name}")
