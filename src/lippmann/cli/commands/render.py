"""``lippmann render``: a scene becomes a display's native picture, whole or tile by tile."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.shared import options, standard_streams
from lippmann.cli.shared.command_options import with_options
from lippmann.cli.shared.console import Console, add_seconds, remarks, report
from lippmann.cli.shared.scene_source import SceneSource, display_of, output_of, sheet_of
from lippmann.errors import MemoryLimitError, UsageError
from lippmann.options.light import LightOptions
from lippmann.options.outputs import AccessOptions, ClusterOptions, SequenceOptions
from lippmann.options.placement import PlacementOptions
from lippmann.options.prints import FinishOptions, PrintOptions
from lippmann.options.quality import MachineOptions, QualityOptions
from lippmann.options.scene import SceneOptions
from lippmann.progress import Progress
from lippmann.wording import samples_in_words

if TYPE_CHECKING:
    from collections.abc import Callable

    from lippmann.calibration.finish import Finish
    from lippmann.display import Display
    from lippmann.image import IntegralImage
    from lippmann.image.encoding import FormatName
    from lippmann.image.stored_values import Stored
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.tiles.tiled_render import Runner

Maps = Annotated[
    Path | None,
    typer.Option(
        "--maps",
        help="Write diagnostic maps (estimated error, samples per pixel, reused pixels) into this folder.",
        show_default=False,
        rich_help_panel="Output",
    ),
]
Resume = Annotated[
    bool,
    typer.Option(
        "--resume",
        help="Keep finished tiles beside the output, and go on with those (of a sequence: with the frames) that an "
        "interrupted run left. See docs/how-to/large-pictures.md.",
        rich_help_panel="Output",
    ),
]


@with_options
def render(
    scene: options.Scene,
    output: options.OptionalOutput = None,
    display: options.DisplayName = "seed-lenticular",
    state: options.State = None,
    opens: options.Open = False,
    bits: options.Bits = None,
    maps: Maps = None,
    resume: Resume = False,
    correct: options.Correct = "none",
    headroom: options.Headroom = 0.0,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    *,
    asked: SceneOptions,
    access: AccessOptions,
    placement: PlacementOptions,
    light: LightOptions,
    how: QualityOptions,
    printed: PrintOptions,
    finishing: FinishOptions,
    moving: SequenceOptions,
    on: ClusterOptions,
    machine: MachineOptions,
) -> None:
    """Render a scene into the native pixels of a display."""
    from lippmann.image.write import check_output
    from lippmann.rendering.picture import render_picture
    from lippmann.rendering.request.render_request import RenderRequest

    console = Console(quiet, as_json)
    target, finish = sheet_of(display_of(display, printed), finishing, in_frames=bool(moving))
    moving, output = moving.with_film(output_of(output, scene, "-frames" if moving else ".png"))
    if opens and moving and moving.video is None:
        raise UsageError("shows a picture or a film", where="--open", fix="add --video film.mp4")
    request = RenderRequest.from_options(
        *(how, machine),
        placement=placement,
        began=None if moving else standard_streams.command_began(),
    ).for_file(output, bits)
    source = SceneSource(scene, asked, light, access)
    render_one: Callable[..., IntegralImage] = render_picture
    traced = target
    if correct != "none" or headroom:
        from lippmann.corrected import corrected_renderer, finer_display

        render_one, traced = corrected_renderer(correct, headroom), finer_display(target)
        if moving or maps is not None:
            _refuse_correction("frames" if moving else "--maps", "leave one of them out")
    if moving:
        from lippmann.cli.commands.cluster import frame_runner_of
        from lippmann.cli.commands.sequence import Files, render_frames

        files = Files(output, bits, maps, resume)
        with frame_runner_of(on, console, machine.threads) as runner:
            render_frames(source, target, request, moving, files, console, runner=runner)
        if opens and moving.video is not None:
            from lippmann.cli.commands.view import open_file

            open_file(moving.video)
        return
    name, stored = check_output(output, bits)
    _check_layers(how.layers, name, output)
    if on or is_tiled(name, traced, request, resume=resume):
        _check_tiled(correct, maps)
        from lippmann.cli.commands.cluster import runner_of

        with runner_of(on, console, machine.threads) as runner:
            _render_tiled(
                source, target, request, output, console, bits=bits, resume=resume, finish=finish, runner=runner
            )
    else:
        if finish is not None:
            finish.check_stored(stored, output)
        _render_whole(
            source, target, request, render_one, output, console, bits=bits, stored=stored, maps=maps, finish=finish
        )
    if opens:
        from lippmann.cli.commands.view import view

        view(output, quiet=quiet, as_json=as_json)


def _check_tiled(correct: str, maps: Path | None) -> None:
    """Raise UsageError for options that need the whole picture at once, which tiles do not have."""
    if correct == "lens":
        fix = "render a quilt with 'lippmann quilt', then 'lippmann weave --correct lens'"
        _refuse_correction("tiles, as a cluster, --resume, Zarr and pictures beyond the memory have them", fix)
    if maps is not None:
        fix = "leave it out: a file that ends in .exr holds each pixel's error and samples itself"
        rule = "with --resume, to Zarr and beyond the memory pictures are rendered in tiles"
        raise UsageError("needs the whole picture at once", where="--maps", rule=rule, fix=fix)


def _render_whole(
    source: SceneSource,
    display: Display,
    request: RenderRequest,
    render_one: Callable[..., IntegralImage],
    output: Path,
    console: Console,
    *,
    bits: int | None,
    stored: Stored,
    maps: Path | None,
    finish: Finish | None,
) -> None:
    """Render a picture in memory, write it with its ``maps``, and print its figures."""
    from lippmann.runtime.atomic_write import check_folder_writable

    if maps is not None:
        check_folder_writable(maps)
    with console.progress() as progress:
        scene, load_seconds = source.load_timed()
        try:
            image = render_one(scene, display, request, progress)
        except MemoryLimitError as error:
            if error.parameter == "memory" and output.suffix.lower() in (".png", ".exr"):
                error.fix = f"{error.fix}, or give the output the ending .tif or .zarr, which is rendered in tiles"
            raise
        progress(Progress("write", 0, 1))
        writing = time.perf_counter()
        image = _add_seconds(image, load=load_seconds)
        if maps is not None:
            from lippmann.viewing.diagnostic_maps import write_maps

            write_maps(image, maps)
        image, remark = _shade_depth(image, stored, output)
        if finish is not None:
            image = finish.image(image)
        image.save(output, bits=bits, icc=b"" if finish is None else finish.icc)
    written = _add_seconds(image, write=time.perf_counter() - writing)
    remarks(console, image.provenance)
    for line in (remark, _describe_overtime(written, request.max_time)):
        if line:
            console.remark(line)
    height, width = image.pixels.shape[:2]
    console.result(report(output, (width, height), written.provenance), _describe(output, written))


def _shade_depth(image: IntegralImage, stored: str, output: Path) -> tuple[IntegralImage, str]:
    """For depth in a format of integers: a picture in shades, and a remark. Writes their legend beside the picture.

    Other pictures are returned as they are, with an empty remark.
    """
    if image.provenance.integrator != "depth" or stored.startswith("float"):
        return image, ""
    from lippmann.image.write import write_plain_picture
    from lippmann.viewing.depth_picture import legend, shades_of_depth

    shades, (low, high) = shades_of_depth(image)
    beside = output.with_name(f"{output.stem}-legend.png")
    write_plain_picture(legend(shades, (low, high)), beside, bits=8, transfer="linear")
    return shades, f"depth from {low:.1f} mm (dark) to {high:.1f} mm (white), see {beside.name}; .exr keeps millimetres"


def _refuse_correction(beside: str, fix: str) -> None:
    rule = "a scene is corrected in one piece, a single picture"
    raise UsageError(f"given beside {beside}", where="--correct", rule=rule, fix=fix)


def _check_layers(layers: bool, name: str, output: Path) -> None:
    if layers and name != "exr":
        raise UsageError(
            f"{output.name} cannot hold layers",
            where="--layers",
            rule="OpenEXR can",
            fix="give the output the ending .exr",
        )


def _describe(output: Path, image: IntegralImage) -> str:
    height, width = image.pixels.shape[:2]
    rays = image.provenance.rays
    millions = sum(rays.values()) / 1e6
    shares = "".join(f"{100 * share:.1f} % {name}, " for name, share in image.provenance.pixel_shares.items())
    return (
        f"{output}: {width}x{height} pixels for {image.display.name}, {samples_in_words(image.provenance.spp)}, "
        f"{shares}{millions:.1f} M rays, {image.provenance.seconds['total']:.1f} s"
    )


def _describe_overtime(image: IntegralImage, max_time: float | None) -> str:
    """A line on a picture that took over 110 % of ``--max-time``; empty for others."""
    seconds = image.provenance.seconds["total"]
    if max_time is None or seconds <= 1.1 * max_time:
        return ""
    samples = samples_in_words(image.provenance.spp)
    return f"{seconds:.1f} s instead of --max-time {max_time:g}: a picture of {samples} takes that long"


def _add_seconds(image: IntegralImage, **seconds: float) -> IntegralImage:
    return replace(image, provenance=add_seconds(image.provenance, **seconds))


def is_tiled(name: FormatName, display: Display, request: RenderRequest, *, resume: bool) -> bool:
    """Whether a picture is rendered in tiles: on ``--resume``, for Zarr, and for TIFFs that do not fit the memory."""
    if resume or name != "tiff":
        return resume or name == "zarr"
    from lippmann.tiles.tiled_render import fits_whole

    return not fits_whole(display, request)


def _render_tiled(
    source: SceneSource,
    display: Display,
    request: RenderRequest,
    output: Path,
    console: Console,
    *,
    bits: int | None,
    resume: bool,
    finish: Finish | None,
    runner: Runner | None,
) -> None:
    """Render into a file tile by tile, and print its figures."""
    from lippmann.calibration.finish import NO_FINISH
    from lippmann.tiles.tiled_render import render_to_file

    started = time.perf_counter()
    with console.progress() as progress:
        rendered = render_to_file(
            source.load(),
            display,
            request,
            output,
            bits=bits,
            resume=resume,
            finish=finish or NO_FINISH,
            runner=runner,
            progress=progress,
        )
    made = rendered.provenance
    remarks(console, made)
    width, height = rendered.size
    values = report(output, rendered.size, made)
    values["tiles"] = {"made": rendered.tiles - rendered.resumed, "found": rendered.resumed}
    resumed = f", {rendered.resumed} of {rendered.tiles} tiles found" if rendered.resumed else ""
    console.result(
        values,
        f"{output}: {width}x{height} pixels for {display.name}, {samples_in_words(made.spp)}{resumed}, "
        f"{sum(made.rays.values()) / 1e6:.1f} M rays, {time.perf_counter() - started:.1f} s",
    )
