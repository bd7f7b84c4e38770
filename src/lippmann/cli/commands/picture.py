"""Commands on existing pictures: ``info``, ``views``, ``micro-images`` and ``compose``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from lippmann.cli.commands.quilt import Aspect, Layout, quilt_of
from lippmann.cli.shared import options, parse
from lippmann.cli.shared.console import Console, estimate_in_words
from lippmann.cli.shared.scene_source import output_of
from lippmann.wording import samples_in_words

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lippmann.image import PictureFile
    from lippmann.image.metadata import Provenance
    from lippmann.quilts.quilt import Quilt

Format = Annotated[
    Literal["png", "exr", "tiff"] | None,
    typer.Option("--format", help="Picture format. Default: as the picture is stored."),
]


def info(
    picture: options.Picture,
    layout: Layout = None,
    aspect: Aspect = None,
    as_json: options.Json = False,
) -> None:
    """Show a picture's display, size and provenance."""
    from lippmann.image import open_file

    quilt = quilt_of(picture, layout, aspect)
    if quilt is not None:
        Console(as_json=as_json).result(_quilt_values(picture, quilt), _quilt_lines(picture, quilt))
        return
    file = open_file(picture)
    Console(as_json=as_json).result(_info_values(picture, file), _info_lines(picture, file))


def views(
    picture: options.Picture,
    output: options.OptionalFolder = None,
    format: Format = None,
    bits: options.Bits = None,
    display: options.PictureDisplay = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Split a picture into views: one picture per direction, one pixel per lens."""
    from lippmann.image import open_picture, write_views
    from lippmann.image.views import view_grid

    console, output = Console(quiet, as_json), output_of(output, picture, "-views")
    image = open_picture(picture, display=parse.display(display))
    with console.progress() as progress:
        count = write_views(image, output, format=format, bits=bits, progress=progress)
    if image.views_note:
        console.remark(image.views_note)
    grid = view_grid(image.display)
    shape = [len(grid.down), len(grid.right)]
    result = {"output": str(output), "views": shape, "written": count, "exact": grid.exact}
    console.result(result, f"{output}: {count} views")


def micro_images(
    picture: options.Picture,
    output: options.OptionalFolder = None,
    format: Format = None,
    bits: options.Bits = None,
    display: options.PictureDisplay = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Split a picture into micro-images: one picture per lens."""
    from lippmann.image import open_picture, write_micro_images

    console, output = Console(quiet, as_json), output_of(output, picture, "-micro-images")
    image = open_picture(picture, display=parse.display(display))
    with console.progress() as progress:
        count = write_micro_images(image, output, format=format, bits=bits, progress=progress)
    grid = image.display.lens_grid
    result = {"output": str(output), "lenses": [grid.rows, grid.columns], "written": count}
    console.result(result, f"{output}: {count} micro-images")


def compose(
    folder: Annotated[Path, typer.Argument(help="Folder written by 'lippmann views' or 'lippmann micro-images'.")],
    output: options.OptionalOutput = None,
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Join views or micro-images into the native picture."""
    from lippmann.image import compose as compose_folder
    from lippmann.image.write import check_output

    console, output = Console(quiet, as_json), output_of(output, folder, "-native.exr")
    check_output(output, bits)
    with console.progress() as progress:
        image = compose_folder(folder, progress=progress)
    image.save(output, bits=bits)
    height, width = image.pixels.shape[:2]
    result = {"output": str(output), "size": [width, height], "display": image.display.name}
    console.result(result, f"{output}: {width}x{height} pixels for {image.display.name}")


def _quilt_values(path: Path, quilt: Quilt) -> dict[str, Any]:
    values: dict[str, Any] = {"file": str(path), "size": list(quilt.size), "stored": quilt.stored}
    values["quilt"] = quilt.layout._asdict()
    values["display"] = None if quilt.display is None else quilt.display.to_dict()
    return values | {"provenance": quilt.provenance.to_dict()}


def _quilt_lines(path: Path, quilt: Quilt) -> list[str]:
    from lippmann.image.metadata import Provenance

    (width, height), (view_width, view_height) = quilt.size, quilt.view_size
    aspect = "" if quilt.layout.aspect is None else f", aspect {quilt.layout.aspect:g}"
    lines = [f"{path}: quilt, {width}x{height}, {quilt.stored}"]
    lines.append(f"views       {quilt.layout.columns}x{quilt.layout.rows} of {view_width}x{view_height} pixels{aspect}")
    if quilt.display is not None:
        lines.append(f"display     {quilt.display.name}")
    return lines + (_provenance_lines(quilt.provenance, "view") if quilt.provenance != Provenance() else [])


def _info_values(path: Path, file: PictureFile) -> dict[str, Any]:
    values: dict[str, Any] = {
        "file": str(path),
        "format": file.format,
        "size": [file.width, file.height],
        "stored": file.stored,
        "layers": list(file.layers),
        "notes": list(file.notes),
    }
    if file.metadata is not None:
        values |= file.metadata.to_dict()
    return values


def _method(provenance: Provenance) -> str:
    depth, spp, seed = provenance.depth, provenance.spp, provenance.seed
    parts = [provenance.method or "unknown", provenance.integrator]
    parts += [
        "" if depth is None else f"depth {depth}",
        "" if spp is None else samples_in_words(spp),
        "" if seed is None else f"seed {seed}",
    ]
    return ", ".join(part for part in parts if part)


def _info_lines(path: Path, file: PictureFile) -> list[str]:
    lines = [f"{path}: {file.format.upper()}, {file.width}x{file.height}, {file.stored}"]
    if file.layers:
        lines.append(f"layers      {', '.join(file.layers)}")
    lines += [f"note        {note}" for note in file.notes]
    if file.metadata is None:
        return [*lines, "no Lippmann metadata: commands that need the display take --display"]
    display, provenance = file.metadata.display, file.metadata.provenance
    grid = display.lens_grid
    lines += [
        f"display     {display.name} ({display.lens_array.layout}, {grid.columns}x{grid.rows} lenses, "
        f"field {display.field_of_view:.1f} degrees)",
    ]
    if display.sheet is not None:
        sheet, pixel = display.sheet, display.panel.pixel_pitch
        borders = [f"{name} {size * pixel:.4g} mm" for name in ("bleed", "margin") if (size := getattr(sheet, name))]
        lines.append("print       " + ", ".join([display.title, *borders, *["mirrored"] * sheet.mirrored]))
    return lines + _provenance_lines(provenance)


def _provenance_lines(provenance: Provenance, part: str = "micro-image") -> list[str]:
    lines = [
        f"scene       {provenance.scene or 'unknown'}",
        f"method      {_method(provenance)}",
        f"made by     Lippmann {provenance.version or '(unknown version)'} "
        f"on {provenance.device or 'an unknown device'}",
    ]
    if provenance.estimate is not None:
        lines.append(f"estimated   {_estimate(provenance.estimate, part)}")
    if provenance.rays:
        lines.append("rays        " + ", ".join(f"{count:,} {kind}" for kind, count in provenance.rays.items()))
    if provenance.seconds:
        lines.append("seconds     " + ", ".join(f"{stage} {spent:.2f}" for stage, spent in provenance.seconds.items()))
    lists = {name: provenance.options.get(name) for name in ("settings", "plan")}
    lines += [f"{name:<11} {_plain(value)}" for name, value in provenance.options.items() if name not in lists]
    for name, each in lists.items():
        if isinstance(each, list):
            lines += [f"{name if place == 0 else '':<11} {line}" for place, line in enumerate(each)]
    return lines + [f"note        {note}" for note in provenance.notes]


def _estimate(estimate: Mapping[str, object], part: str) -> str:
    """An estimate in words; of another program's picture, its figures by name."""
    try:
        return estimate_in_words(estimate, part)
    except (KeyError, TypeError, ValueError):
        return ", ".join(f"{name} {_plain(value)}" for name, value in estimate.items())


def _plain(value: object) -> str:
    """A value of a picture's metadata to be read: numbers of six digits, lists without brackets."""
    if isinstance(value, (list, tuple)):
        return ", ".join(_plain(each) for each in value)
    return f"{value:g}" if isinstance(value, float) else str(value)
