"""``lippmann quilt`` and ``lippmann weave``: quilts rendered, packed and unpacked, and woven into native pictures."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from lippmann.cli.commands.interlace import FitOption, fit_note
from lippmann.cli.shared import options, parse
from lippmann.cli.shared.command_options import HelpfulCommand, HelpfulGroup, for_form, with_options
from lippmann.cli.shared.console import Console, add_seconds, depth_line, estimate_in_words, report
from lippmann.cli.shared.scene_source import SceneSource, output_of, sheet_of
from lippmann.errors import UsageError
from lippmann.options.light import LightOptions
from lippmann.options.outputs import AccessOptions, SequenceOptions
from lippmann.options.placement import PlacementOptions
from lippmann.options.prints import FinishOptions
from lippmann.options.quality import MachineOptions, QualityOptions
from lippmann.options.scene import SceneOptions
from lippmann.progress import Progress, ProgressCallback
from lippmann.wording import samples_in_words

if TYPE_CHECKING:
    from lippmann.quilts.quilt import Quilt, QuiltLayout

quilt = typer.Typer(
    cls=HelpfulGroup,
    help="Render, pack and unpack quilts: all views side by side in one picture.",
    rich_markup_mode=None,
)

Device = Annotated[
    str,
    typer.Option(
        "--display",
        "-d",
        "--target",
        help="A device (see 'lippmann quilt sizes'; 'portrait' will do), its visual.json, an eye-tracked monitor such "
        "as 'odyssey-3d', or any lenticular display.",
        rich_help_panel="Display",
    ),
]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        help="The quilt to write: NAME.png, .exr or .tif; _qsCOLUMNSxROWSaASPECT is added. By default the scene's "
        "name, here. Of a sequence a film (.mp4), a folder, or a name with %04d.",
        show_default=False,
        rich_help_panel="Output",
    ),
]
Views = Annotated[
    str | None,
    typer.Option(
        "--views",
        metavar="COLUMNSxROWS",
        help="Views across and up; by default those that the device is given.",
        rich_help_panel="Display",
    ),
]
Size = Annotated[
    str | None,
    typer.Option(
        "--size",
        metavar="WIDTHxHEIGHT",
        help="Size of the quilt in pixels; by default the device's.",
        rich_help_panel="Display",
    ),
]
Layout = Annotated[
    str | None,
    typer.Option(
        "--layout",
        metavar="COLUMNSxROWS",
        help="Views across and up in a quilt whose name and metadata do not say them, such as 8x6.",
    ),
]
Aspect = Annotated[
    float | None,
    typer.Option("--aspect", help="With --layout: width over height of the displayed picture. Default: the display's."),
]
Format = Annotated[
    Literal["png", "exr", "tiff"] | None,
    typer.Option("--format", help="Picture format. Default: as the quilt is stored."),
]


@quilt.command("render", cls=HelpfulCommand)
@with_options
def render(
    scene: options.Scene,
    output: Output = None,
    display: Device = "portrait",
    views: Views = None,
    size: Size = None,
    state: options.State = None,
    bits: options.Bits = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Of a sequence: keep the frames that an interrupted run finished.",
            rich_help_panel="Output",
        ),
    ] = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    *,
    asked: SceneOptions,
    access: AccessOptions,
    placement: PlacementOptions,
    light: LightOptions,
    how: Annotated[QualityOptions, for_form("quilt")],
    moving: SequenceOptions,
    machine: MachineOptions,
) -> None:
    """Render a scene as a quilt: the views of cameras side by side in front of the display."""
    from lippmann.display import load_display
    from lippmann.image.write import check_output
    from lippmann.quilts.files import write_quilt
    from lippmann.quilts.quilt import Quilt, named_with_layout, quilt_of_display
    from lippmann.rendering.quilt import render_quilt
    from lippmann.rendering.request.render_request import RenderRequest

    console = Console(quiet, as_json)
    target = load_display(display)
    grid = None if views is None else parse.size(views, "--views", rule="columns x rows, such as 8x6")
    quilt = quilt_of_display(target, grid, None if size is None else parse.size(size, "--size"))
    path = output_of(output, scene, "-frames") if moving else output or Path(f"{Path(scene).stem}.png")
    moving, file = moving.with_film(path)
    shows_all = moving.eye is None and moving.shows == "eye"
    if moving.video is not None and shows_all and (file != path or quilt.pair):
        moving = replace(moving, video=named_with_layout(moving.video, quilt.ending))
    if file == path and (not moving or (path.suffix and not path.is_dir())):
        file = named_with_layout(path, quilt.ending)
    if not moving:
        if resume:
            raise UsageError("a quilt is rendered in one piece", where="--resume", fix="leave it out")
        check_output(file, bits)
    request = RenderRequest.from_options(how, machine, placement=placement).for_file(path, bits)
    source = SceneSource(scene, asked, light, access)
    if moving:
        from lippmann.cli.commands.sequence import Files, render_frames
        from lippmann.sequences.forms import QuiltForm

        files = Files(file, bits, None, resume)
        render_frames(source, target, request, moving, files, console, form=QuiltForm(quilt))
        return
    with console.progress() as progress:
        loaded, load_seconds = source.load_timed()
        layout = quilt.layout
        frame = render_quilt(
            loaded, target, (layout.columns, layout.rows), (quilt.width, quilt.height), request, progress
        )
        made = Quilt(frame.pixels, layout, provenance=frame.provenance, display=target)
        progress(Progress("write", 0, 1))
        writing = time.perf_counter()
        write_quilt(made, file, bits=bits)
    spent = add_seconds(made.provenance, load=load_seconds, write=time.perf_counter() - writing)
    console.remark(depth_line(spent))
    console.remark(*spent.notes)
    if spent.estimate is not None:
        console.remark(f"estimated PSNR {estimate_in_words(spent.estimate, 'view')}")
    seconds = spent.seconds["total"]
    values: dict[str, Any] = report(file, (quilt.width, quilt.height), spent)
    console.result(values | {"display": target.name, "views": quilt.layout.views}, _sentence(file, made, seconds))


@quilt.command("pack", cls=HelpfulCommand)
def pack(
    folder: Annotated[
        Path,
        typer.Argument(
            help="A folder with one picture per view, numbered from the left; a film of a camera that moves to the "
            "right; or a stereo pair: an .mpo, .jps or .heic file."
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="The quilt to write: NAME_qsCOLUMNSxROWSaASPECT.png, .exr or .tif. By default named after the input, "
            "as square as its views allow.",
            show_default=False,
        ),
    ] = None,
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Put a folder of views into a quilt, the leftmost at the bottom left."""
    from lippmann.codecs.stereo_pairs import read_pair
    from lippmann.codecs.types import FILMS
    from lippmann.image.write import check_output
    from lippmann.quilts.files import ending_of_views, read_film, read_views, write_quilt
    from lippmann.quilts.photos import quilt_of_pair
    from lippmann.quilts.quilt import layout_of_name, names_half_pair

    console = Console(quiet, as_json)
    is_film = folder.suffix.lower() in FILMS and folder.is_file() and read_pair(folder) is None
    is_pair = folder.is_file() and not is_film
    if output is None:
        output = output_of(None, folder, ("_2x1" if is_pair else ending_of_views(folder)) + ".png")
    layout, half = layout_of_name(output, to_write=True), names_half_pair(output)
    check_output(output, bits)
    with console.progress() as progress:
        if is_pair:
            packed = quilt_of_pair(folder, half=half)
        elif is_film:
            packed = read_film(folder, layout)
        else:
            packed = read_views(folder, layout, progress=progress)
            if half:
                console.remark("its views are taken as halved in width: players show them twice as wide")
        console.remark(*packed.notes)
    write_quilt(packed, output, bits=bits)
    width, height = packed.size
    result = {"output": str(output), "size": [width, height], "views": layout.views}
    console.result(result, f"{output}: {layout.columns}x{layout.rows} views, {width}x{height} pixels")


@quilt.command("unpack", cls=HelpfulCommand)
def unpack(
    picture: Annotated[Path, typer.Argument(help="A quilt: PNG, EXR, TIFF, JPEG, WebP or AVIF.")],
    output: options.OptionalFolder = None,
    layout: Layout = None,
    aspect: Aspect = None,
    format: Format = None,
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Write each view of a quilt as a picture of its own, view 0 the leftmost camera's."""
    from lippmann.quilts.files import read_quilt, write_views
    from lippmann.runtime.atomic_write import check_folder_writable

    console, output = Console(quiet, as_json), output_of(output, picture, "-views")
    check_folder_writable(output)
    quilt = read_quilt(picture, layout_of(layout, aspect))
    console.remark(*quilt.notes)
    with console.progress() as progress:
        write_views(quilt, output, format=format, bits=bits, progress=progress)
    width, height = quilt.view_size
    result = {"output": str(output), "size": [width, height], "views": quilt.layout.views}
    console.result(result, f"{output}: {quilt.layout.views} views of {width}x{height} pixels")


@quilt.command("sizes", cls=HelpfulCommand)
def sizes(as_json: options.Json = False) -> None:
    """List the quilts that devices are given, and the pairs of eye-tracked monitors."""
    from lippmann.display import list_displays
    from lippmann.quilts.quilt import DEVICE_QUILTS, quilt_of_display

    pairs = [quilt_of_display(display) for display in list_displays() if display.stereo is not None]
    devices = (*DEVICE_QUILTS, *pairs)
    rows = [
        {
            "display": device.display,
            "size": [device.width, device.height],
            "columns": device.layout.columns,
            "rows": device.layout.rows,
            "aspect": device.layout.aspect,
            "ending": device.ending,
        }
        for device in devices
    ]
    lines = [
        f"{device.display:<32} {device.width}x{device.height}  {device.layout.views:>2} views  {device.ending}"
        for device in devices
    ]
    Console(as_json=as_json).result({"quilts": rows}, "\n".join(lines))


@with_options
def weave(
    source: Annotated[Path, typer.Argument(help="A quilt, or a folder with one picture per view.")],
    display: options.DisplayName,
    output: options.OptionalOutput = None,
    choice: Annotated[
        Literal["nearest", "linear"] | None,
        typer.Option(
            "--views",
            help="nearest: one view per sub-pixel; linear: a mixture of two. Default: linear, of a pair nearest.",
        ),
    ] = None,
    fit: FitOption = None,
    correct: options.Correct = "none",
    headroom: options.Headroom = 0.0,
    layout: Layout = None,
    aspect: Aspect = None,
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    *,
    finishing: FinishOptions,
) -> None:
    """Make a display's native picture from a quilt or a folder of views."""
    from lippmann.calibration.finish import NO_FINISH, write_finished
    from lippmann.display import load_display
    from lippmann.display.sheet_layout import trim_of
    from lippmann.image.streamed import LARGE
    from lippmann.image.write import can_be_banded, check_output
    from lippmann.quilts.fit_views import fit_views
    from lippmann.quilts.weave import check_weavable, usual_choice, weave_to_file
    from lippmann.quilts.weave import weave as weave_views

    console, output = Console(quiet, as_json), output_of(output, source, "-native.png")
    name, stored = check_output(output, bits)
    target, asked_finish = sheet_of(load_display(display), finishing)
    check_weavable(target)  # before the views are read
    finish = asked_finish or NO_FINISH
    finish.check_stored(stored, output)
    panel, trim = finish.display(target).panel, trim_of(target)
    width, height = panel.width, panel.height
    with console.progress() as progress:
        views = _views(source, layout_of(layout, aspect), progress)
        console.remark(*views.notes)
        if fit is not None or source.is_dir():  # a quilt of another shape is refused, unless a fit is asked for
            views, cropped = fit_views(views, trim.width / trim.height, fit or "cover")
            console.remark(*fit_note(cropped, fit))
        choice = choice or usual_choice(views)
        how: dict[str, Any] = {"choice": choice, "correct": correct, "headroom": headroom, "scene": source.stem}
        asked = {**how, "progress": progress}
        if width * height > LARGE and can_be_banded(name):
            notes = weave_to_file(views, target, output, bits=bits, finish=finish, **asked)
        else:
            woven = weave_views(views, target, **asked)
            write_finished(woven, output, finish, bits=bits)
            notes = woven.provenance.notes
    console.remark(*notes)
    result = {
        "output": str(output),
        "size": [width, height],
        "display": target.name,
        "views": views.layout.views,
        "view_choice": choice,
        "correct": correct,
    }
    console.result(result, f"{output}: {views.layout.views} views on {width}x{height} pixels of {target.name}")


def _sentence(path: Path, made: Quilt, seconds: float) -> str:
    width, height = made.size
    millions = sum(made.provenance.rays.values()) / 1e6
    return (
        f"{path}: {made.layout.columns}x{made.layout.rows} views, {width}x{height} pixels, "
        f"{samples_in_words(made.provenance.spp)}, {millions:.1f} M rays, {seconds:.1f} s"
    )


def quilt_of(picture: Path, layout: str | None, aspect: float | None) -> Quilt | None:
    """The quilt of a file: by ``--layout``, its metadata or its name; None for a picture of a panel."""
    from lippmann.quilts.files import is_quilt, read_quilt

    asked = layout_of(layout, aspect)
    if asked is None and not is_quilt(picture):
        return None
    return read_quilt(picture, asked)


def layout_of(layout: str | None, aspect: float | None) -> QuiltLayout | None:
    """The layout of ``--layout`` and ``--aspect``; None without them.

    Raises
    ------
    UsageError, PictureError
        If a value is out of range, or an aspect is given alone.
    """
    from lippmann.quilts.quilt import checked_layout

    if layout is None:
        if aspect is not None:
            raise UsageError("applies to --layout only", where="--aspect", fix="add --layout")
        return None
    columns, rows = parse.size(layout, "--layout", rule="columns x rows, such as 8x6")
    checked_layout(columns, rows, None, where="--layout")
    return checked_layout(columns, rows, aspect, where="--aspect")


def _views(source: Path, layout: QuiltLayout | None, progress: ProgressCallback) -> Quilt:
    from lippmann.quilts.files import read_quilt, read_views

    return read_views(source, layout, progress=progress) if source.is_dir() else read_quilt(source, layout)
