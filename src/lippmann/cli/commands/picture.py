"""Commands on pictures that exist: look into them, take them apart, put them together, see what an eye sees."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli.shared import options, parse
from lippmann.cli.shared.console import Console, estimate_in_words
from lippmann.errors import UsageError

if TYPE_CHECKING:
    from lippmann.display import Display
    from lippmann.image import PictureFile, Provenance

Format = Annotated[str | None, typer.Option("--format", help="png, exr or tiff; by default as the picture is stored.")]
Filter = Annotated[str, typer.Option("--filter", help="nearest, or linear between pixels of one lens.")]
Size = Annotated[str | None, typer.Option("--size", help="Width x height in pixels.")]


def info(
    picture: options.Picture,
    as_json: options.Json = False,
) -> None:
    """Say what a picture is: its display, and how it was made."""
    from lippmann.image import open_file

    found = open_file(picture)
    Console(as_json=as_json).result(_info_values(picture, found), "\n".join(_info_lines(picture, found)))


def views(
    picture: options.Picture,
    output: options.Folder,
    format: Format = None,
    bits: options.Bits = None,
    display: options.PictureDisplay = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Write each view (one direction, one pixel of every lens) as a picture of its own."""
    from lippmann.image import open_picture, write_views
    from lippmann.image.views import view_grid

    console = Console(quiet, as_json)
    image = open_picture(picture, display=_display(display))
    with console.progress() as progress:
        count = write_views(image, output, format=format, bits=bits, progress=progress)  # type: ignore[arg-type]
    if image.views_note:
        console.remark(image.views_note)
    grid = view_grid(image.display)
    shape = [len(grid.down), len(grid.right)]
    result = {"output": str(output), "views": shape, "written": count, "exact": grid.exact}
    console.result(result, f"{output}: {count} views")


def micro_images(
    picture: options.Picture,
    output: options.Folder,
    format: Format = None,
    bits: options.Bits = None,
    display: options.PictureDisplay = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Write the micro-image of each lens as a picture of its own."""
    from lippmann.image import open_picture, write_micro_images

    console = Console(quiet, as_json)
    image = open_picture(picture, display=_display(display))
    with console.progress() as progress:
        count = write_micro_images(image, output, format=format, bits=bits, progress=progress)  # type: ignore[arg-type]
    grid = image.display.lens_grid
    result = {"output": str(output), "lenses": [grid.rows, grid.columns], "written": count}
    console.result(result, f"{output}: {count} micro-images")


def compose(
    folder: Annotated[Path, typer.Argument(help="A folder that 'views' or 'micro-images' wrote.")],
    output: options.Output,
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Put views or micro-images back together into the native picture."""
    from lippmann.image import compose as compose_folder
    from lippmann.image.write import format_for
    from lippmann.runtime.atomic_write import check_writable

    console = Console(quiet, as_json)
    format_for(output, bits)
    check_writable(output)
    with console.progress() as progress:
        image = compose_folder(folder, progress=progress)
    image.save(output, bits=bits)
    height, width = image.pixels.shape[:2]
    result = {"output": str(output), "size": [width, height], "display": image.display.name}
    console.result(result, f"{output}: {width}x{height} pixels for {image.display.name}")


def replay(
    picture: options.Picture,
    output: options.Output,
    eye: Annotated[
        str | None, typer.Option("--eye", help="The eye's place X,Y,Z in mm, z toward the viewer; by default central.")
    ] = None,
    sweep: Annotated[
        bool, typer.Option("--sweep", help="An animation from left to right: .png (APNG) or .mp4.")
    ] = False,
    frames: Annotated[int, typer.Option("--frames", help="Frames of a sweep.")] = 48,
    width: Annotated[
        float | None, typer.Option("--sweep-width", help="How far a sweep goes in mm; by default through the field.")
    ] = None,
    size: Size = None,
    filter: Filter = "nearest",
    bits: options.Bits = None,
    display: options.PictureDisplay = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Show what an eye in front of the display sees."""
    from lippmann.image.streamed import open_picture
    from lippmann.image.write import format_for, write_plain_picture
    from lippmann.runtime.atomic_write import check_writable
    from lippmann.viewing.replay import default_eye
    from lippmann.viewing.replay import replay as replay_picture
    from lippmann.viewing.replay import sweep as sweep_picture
    from lippmann.viewing.video_file import check_animation_path, write_animation

    console = Console(quiet, as_json)
    if sweep:
        check_animation_path(output)
    else:
        format_for(output, bits)
        for option, value in (("--sweep-width", width),):
            if value is not None:
                raise UsageError("has no meaning for a single picture", where=option, fix="add --sweep")
    check_writable(output)
    image = open_picture(picture, display=_display(display))
    place = default_eye(image.display) if eye is None else parse.triple(eye, "--eye")
    pixels = None if size is None else parse.size(size, "--size")
    transfer = image.provenance.transfer
    result: dict[str, Any] = {"output": str(output), "eye": list(place), "filter": filter}
    if not sweep:
        seen = replay_picture(image, place, size=pixels, filter=filter)  # type: ignore[arg-type]
        write_plain_picture(seen, output, bits=bits, transfer=transfer)
        console.result(result, f"{output}: seen from {_place(place)}")
        return
    reach = _field_width(image.display, place[2]) if width is None else width
    start, stop = ((place[0] + side * reach / 2, place[1], place[2]) for side in (-1, 1))
    moving = sweep_picture(image, start, stop, frames, size=pixels, filter=filter)  # type: ignore[arg-type]
    write_animation(moving, output, transfer=transfer)
    result |= {"frames": frames, "start": list(start), "stop": list(stop)}
    console.result(result, f"{output}: {frames} frames, seen from {_place(start)} to {_place(stop)}")


def refocus(
    picture: options.Picture,
    output: options.Output,
    plane: Annotated[float, typer.Option("--plane", help="Height of the plane in focus in mm, toward the viewer.")],
    size: Size = None,
    bits: options.Bits = None,
    display: options.PictureDisplay = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Focus on a plane, as a camera with an aperture as wide as the field would."""
    from lippmann.image.streamed import open_picture
    from lippmann.image.write import format_for, write_plain_picture
    from lippmann.runtime.atomic_write import check_writable
    from lippmann.viewing.refocus import refocus as refocus_picture

    console = Console(quiet, as_json)
    format_for(output, bits)
    check_writable(output)
    image = open_picture(picture, display=_display(display))
    seen = refocus_picture(image, plane, size=None if size is None else parse.size(size, "--size"))
    write_plain_picture(seen, output, bits=bits, transfer=image.provenance.transfer)
    console.result({"output": str(output), "plane": plane}, f"{output}: focused at {plane:g} mm")


def _display(name: str | None) -> Display | None:
    from lippmann.display import load_display

    return None if name is None else load_display(name)


def _place(eye: tuple[float, float, float]) -> str:
    return f"({eye[0]:.0f}, {eye[1]:.0f}, {eye[2]:.0f}) mm"


def _field_width(display: Display, distance: float) -> float:
    """How wide the display's field is at ``distance``: from one flip of the picture to the next, in mm."""
    return 2 * distance * math.tan(math.radians(display.field_of_view / 2))


def _info_values(path: Path, found: PictureFile) -> dict[str, Any]:
    values: dict[str, Any] = {
        "file": str(path),
        "format": found.format,
        "size": [found.width, found.height],
        "stored": found.stored,
        "layers": list(found.layers),
    }
    if found.metadata is not None:
        values |= found.metadata.to_dict()
    return values


def _method(made: Provenance) -> str:
    parts = [made.method or "unknown", made.integrator]
    for text, value in (("depth {}", made.depth), ("{} samples per pixel", made.spp), ("seed {}", made.seed)):
        parts.append("" if value is None else text.format(value))
    return ", ".join(part for part in parts if part)


def _info_lines(path: Path, found: PictureFile) -> list[str]:
    lines = [f"{path}: {found.format.upper()}, {found.width}x{found.height}, {found.stored}"]
    if found.layers:
        lines.append(f"layers      {', '.join(found.layers)}")
    if found.metadata is None:
        return [*lines, "no Lippmann metadata: say --display where a command needs the display"]
    display, made = found.metadata.display, found.metadata.provenance
    grid = display.lens_grid
    lines += [
        f"display     {display.name} ({display.lens_array.layout}, {grid.columns}x{grid.rows} lenses, "
        f"field {display.field_of_view:.1f} degrees)",
        f"scene       {made.scene or 'unknown'}",
        f"method      {_method(made)}",
        f"made by     Lippmann {made.version or '(unknown version)'} on {made.device or 'an unknown device'}",
    ]
    if made.estimate is not None:
        lines.append(f"estimated   {estimate_in_words(made.estimate)}")
    if made.rays:
        lines.append("rays        " + ", ".join(f"{count:,} {kind}" for kind, count in made.rays.items()))
    if made.seconds:
        lines.append("seconds     " + ", ".join(f"{stage} {spent:.2f}" for stage, spent in made.seconds.items()))
    lines += [f"{name:<11} {value}" for name, value in made.options.items()]
    return lines + [f"note        {note}" for note in made.notes]
