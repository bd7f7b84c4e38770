"""Commands for light-field panels: quilts, and native pictures woven from views."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli import options, quilts
from lippmann.cli.console import Console

if TYPE_CHECKING:
    from lippmann.progress import ProgressCallback
    from lippmann.quilt import Quilt

quilt = typer.Typer(help="Quilts: all views side by side in one picture.", no_args_is_help=True, rich_markup_mode=None)

quilt.command("render")(quilts.render)

Format = Annotated[str | None, typer.Option("--format", help="png, exr or tiff; by default as the quilt is stored.")]


@quilt.command("pack")
def pack(
    folder: Annotated[Path, typer.Argument(help="A folder with one picture per view, numbered from the left.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="The quilt to write: NAME_qsCOLUMNSxROWSaASPECT.png, .exr or .tif.")
    ],
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Put a folder of views into a quilt, the leftmost at the bottom left."""
    from lippmann.atomic import check_writable
    from lippmann.image.formats import format_for
    from lippmann.quilt import layout_of_name
    from lippmann.quilt_files import read_views, write_quilt

    console = Console(quiet, as_json)
    layout = layout_of_name(output)
    format_for(output, bits)
    check_writable(output)
    with console.progress() as progress:
        packed = read_views(folder, layout, progress=progress)
    write_quilt(packed, output, bits=bits)
    width, height = packed.size
    result = {"output": str(output), "size": [width, height], "views": layout.views}
    console.result(result, f"{output}: {layout.columns}x{layout.rows} views, {width}x{height} pixels")


@quilt.command("unpack")
def unpack(
    picture: Annotated[Path, typer.Argument(help="A quilt (PNG, EXR, TIFF or JPEG) with its layout in the name.")],
    output: options.Folder,
    format: Format = None,
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Write each view of a quilt as a picture of its own, view 0 the leftmost camera's."""
    from lippmann.atomic import check_folder_writable
    from lippmann.quilt_files import read_quilt, write_views

    console = Console(quiet, as_json)
    check_folder_writable(output)
    found = read_quilt(picture)
    with console.progress() as progress:
        write_views(found, output, format=format, bits=bits, progress=progress)  # type: ignore[arg-type]
    width, height = found.view_size
    result = {"output": str(output), "size": [width, height], "views": found.layout.views}
    console.result(result, f"{output}: {found.layout.views} views of {width}x{height} pixels")


@quilt.command("sizes")
def sizes(as_json: options.Json = False) -> None:
    """List the quilts that devices are given."""
    from lippmann.quilt import DEVICE_QUILTS

    rows = [
        {
            "display": device.display,
            "size": [device.width, device.height],
            "columns": device.layout.columns,
            "rows": device.layout.rows,
            "aspect": device.layout.aspect,
            "ending": device.layout.ending,
        }
        for device in DEVICE_QUILTS
    ]
    lines = [
        f"{device.display:<32} {device.width}x{device.height}  {device.layout.views:>2} views  {device.layout.ending}"
        for device in DEVICE_QUILTS
    ]
    Console(as_json=as_json).result({"quilts": rows}, "\n".join(lines))


def weave(
    source: Annotated[Path, typer.Argument(help="A quilt, or a folder with one picture per view.")],
    output: options.Output,
    display: options.DisplayName,
    choice: Annotated[
        str, typer.Option("--views", help="nearest: one view per sub-pixel; linear: a mixture of two.")
    ] = "linear",
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Make a display's native picture from a quilt or a folder of views."""
    from lippmann.display import load_display
    from lippmann.image.banded import can_be_banded
    from lippmann.image.formats import check_output, format_for
    from lippmann.image.large import LARGE
    from lippmann.weave import weave as weave_views
    from lippmann.weave import weave_to_file

    console = Console(quiet, as_json)
    name, _ = format_for(output, bits)
    check_output(output, name)
    target = load_display(display)
    width, height = target.panel.width, target.panel.height
    with console.progress() as progress:
        views = _views(source, progress)
        asked: dict[str, Any] = {"choice": choice, "scene": source.stem, "progress": progress}
        if width * height > LARGE and can_be_banded(name):
            weave_to_file(views, target, output, bits=bits, **asked)
        else:
            weave_views(views, target, **asked).save(output, bits=bits)
    result = {
        "output": str(output),
        "size": [width, height],
        "display": target.name,
        "views": views.layout.views,
        "view_choice": choice,
    }
    console.result(result, f"{output}: {views.layout.views} views on {width}x{height} pixels of {target.name}")


def _views(source: Path, progress: ProgressCallback) -> Quilt:
    from lippmann.quilt_files import read_quilt, read_views

    return read_views(source, progress=progress) if source.is_dir() else read_quilt(source)
