"""``lippmann render``: a scene becomes a display's native picture, whole or tile by tile."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.commands import cluster as clusters
from lippmann.cli.commands import print as printing
from lippmann.cli.commands import sequence, view
from lippmann.cli.shared import command_clock, options, parse
from lippmann.cli.shared.console import Console
from lippmann.cli.shared.default_output import output_of
from lippmann.cli.shared.picture_report import add_seconds, remarks, report
from lippmann.cli.shared.scene_source import SceneSource
from lippmann.errors import UsageError
from lippmann.progress import Progress, ProgressCallback
from lippmann.rendering.request.choices import tone_map_of
from lippmann.wording import samples_in_words

if TYPE_CHECKING:
    from lippmann.calibration.finish import Finish
    from lippmann.display import Display
    from lippmann.image import IntegralImage
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.tiles.tiled_render import Runner

Maps = Annotated[
    Path | None,
    typer.Option(
        "--maps",
        help="Write pictures of where pixels came from and of their estimated error into this folder.",
        show_default=False,
    ),
]
Resume = Annotated[
    bool,
    typer.Option(
        "--resume",
        help="Keep finished tiles beside the output, and go on with those (of a sequence: with the frames) that an "
        "interrupted run left. See docs/how-to/large-pictures.md.",
    ),
]


def render(
    scene: options.Scene,
    output: options.OptionalOutput = None,
    display: options.DisplayName = "seed-lenticular",
    method: options.Method = "auto",
    order: options.Order = None,
    respect_gloss: options.RespectGloss = None,
    maps: Maps = None,
    up: options.Up = None,
    crop: options.Crop = None,
    unit_scale: options.UnitScale = None,
    min_opacity: options.MinOpacity = None,
    variants: options.Variants = None,
    depth_map: options.DepthMap = None,
    transfer_function: options.TransferFunction = None,
    window: options.Window = None,
    series: options.Series = None,
    integrator: options.Integrator = "auto",
    depth: options.Depth = None,
    spp: options.Spp = None,
    effort: options.Effort = "normal",
    quality: options.Quality = None,
    quality_worst: options.QualityWorst = None,
    quality_mean: options.QualityMean = None,
    max_time: options.MaxTime = None,
    seed: options.Seed = 0,
    exposure: options.Exposure = "auto",
    tone_map: options.ToneMap = "auto",
    subpixels: options.Subpixels = None,
    pixel_filter: options.PixelFilter = "auto",
    denoise: options.Denoise = "auto",
    caustics: options.Caustics = "auto",
    clamp_indirect: options.ClampIndirect = None,
    layers: options.Layers = False,
    camera: options.Camera = None,
    place: options.Place = None,
    turn: options.Turn = None,
    shift: options.Shift = None,
    scale: options.Scale = 1.0,
    depth_scale: options.DepthScale = "auto",
    pop_out: options.PopOut = None,
    environment: options.Environment = None,
    background: options.Background = None,
    light_turn: options.LightTurn = None,
    light_strength: options.LightStrength = 1.0,
    environment_strength: options.EnvironmentStrength = 1.0,
    allow_outside: options.AllowOutside = False,
    single_scattering: options.SingleScattering = False,
    lpi: printing.Lpi = None,
    print_lpi: printing.PrintLpi = None,
    ppi: printing.Ppi = None,
    size: printing.Size = None,
    viewing_distance: printing.Distance = None,
    thickness: printing.Thickness = None,
    index: printing.Index = None,
    field: printing.Field = None,
    bleed: printing.Bleed = None,
    marks: printing.MarksMargin = None,
    icc: printing.Icc = None,
    mirror: printing.Mirror = False,
    bits: options.Bits = None,
    resume: Resume = False,
    opens: options.Open = False,
    cluster: clusters.ClusterName = None,
    tls_ca: clusters.TlsCa = None,
    tls_cert: clusters.TlsCert = None,
    tls_key: clusters.TlsKey = None,
    frames: sequence.Frames = None,
    fps: sequence.Fps = None,
    animation: sequence.Animation = None,
    camera_path: sequence.CameraPath = None,
    turntable: sequence.TurntableFrames = None,
    swing: sequence.Swing = None,
    video: sequence.Video = None,
    eye: sequence.Eye = None,
    codec: sequence.Codec = None,
    state: options.State = None,
    device: options.Device = "auto",
    threads: options.Threads = None,
    memory: options.Memory = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Render a scene into the native pixels of a display."""
    from lippmann.image.write import check_output, format_for
    from lippmann.rendering.picture import render_picture
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.runtime.atomic_write import check_folder_writable

    console = Console(quiet, as_json)
    target = printing.display_of(
        display,
        lpi=lpi,
        print_lpi=print_lpi,
        ppi=ppi,
        size=size,
        viewing_distance=viewing_distance,
        thickness=thickness,
        index=index,
        field=field,
    )
    wanted = sequence.Wanted(frames, fps, animation, camera_path, turntable, swing, video, eye, codec)
    target, finish = printing.sheet_of(target, bleed=bleed, marks=marks, icc=icc, mirror=mirror, in_frames=bool(wanted))
    wanted, output = sequence.with_film(wanted, output_of(output, scene, "-frames" if wanted else ".png"))
    if opens and wanted and wanted.video is None:
        raise UsageError("shows a picture or a film", where="--open", fix="add --video film.mp4")
    request = RenderRequest(
        method=method,
        order=order,
        respect_gloss=respect_gloss,
        integrator=integrator,
        depth=depth,
        spp=spp,
        effort=effort,
        quality=parse.quality(quality, quality_mean, console),
        quality_worst=quality_worst,
        max_time=max_time,
        began=None if wanted else command_clock.began(),
        seed=seed,
        exposure=parse.exposure(exposure),
        tone_map=tone_map_of(tone_map, output),
        subpixels=subpixels,
        pixel_filter=pixel_filter,
        denoise=denoise,
        caustics=caustics,
        clamp_indirect=clamp_indirect,
        layers=layers,
        placement=parse.placement(camera, place, turn, shift, scale, depth_scale, pop_out),
        device=device,
        threads=threads,
        memory=parse.memory(memory),
    )
    source = SceneSource(
        *(scene, environment, parse.color(background), allow_outside, single_scattering, up),
        *(parse.crop(crop), unit_scale, min_opacity),
        light=parse.light(light_turn, light_strength, environment_strength),
        variants=parse.variants(variants),
        depth_map=depth_map,
        transfer_function=transfer_function,
        window=parse.window(window),
        series=series,
    )
    on_cluster = clusters.ClusterOptions(cluster, tls_ca, tls_cert, tls_key)
    if wanted:
        files = sequence.Files(output, bits, maps, resume)
        with on_cluster.runner(console, threads) as runner:
            sequence.render_frames(source, target, request, wanted, files, console, runner=runner)
        if opens and wanted.video is not None:
            view.open_file(wanted.video)
        return
    name, stored = format_for(output, bits)
    _check_layers(layers, name, output)
    if on_cluster or is_tiled(output, bits, target, request, resume=resume):
        if maps is not None:
            fix = "leave it out: a file that ends in .exr holds each pixel's error and samples itself"
            rule = "with --resume, to Zarr and beyond the memory pictures are rendered in tiles"
            raise UsageError("needs the whole picture at once", where="--maps", rule=rule, fix=fix)
        with on_cluster.runner(console, threads) as runner:
            _render_tiled(
                source, target, request, output, console, bits=bits, resume=resume, finish=finish, runner=runner
            )
        if opens:
            view.view(output, quiet=quiet, as_json=as_json)
        return
    check_output(output, name)
    finish.check_stored(stored, output)
    if maps is not None:
        check_folder_writable(maps)
    with console.progress() as progress:
        started = time.perf_counter()
        loaded = source.load()
        load_seconds = time.perf_counter() - started
        image = render_picture(loaded, target, request, progress)
        progress(Progress("write", 0, 1))
        writing = time.perf_counter()
        image = _with_seconds(image, load=load_seconds)
        if maps is not None:
            from lippmann.viewing.diagnostic_maps import write_maps

            write_maps(image, maps)
        image, remark = _readable(image, stored, output)
        image = finish.image(image)
        image.save(output, bits=bits, icc=finish.icc)
    written = _with_seconds(image, write=time.perf_counter() - writing)
    remarks(console, image.provenance)
    if remark:
        console.remark(remark)
    height, width = image.pixels.shape[:2]
    console.result(report(output, (width, height), written.provenance), _sentence(output, written))
    if opens:
        view.view(output, quiet=quiet, as_json=as_json)


def _readable(image: IntegralImage, stored: str, output: Path) -> tuple[IntegralImage, str]:
    """Depth in a format of integers as shades, with a legend beside it and a line that says so; all else as it is."""
    if image.provenance.integrator != "depth" or stored.startswith("float"):
        return image, ""
    from lippmann.image.write import write_plain_picture
    from lippmann.viewing.depth_picture import legend, shades_of_depth

    shades, (low, high) = shades_of_depth(image)
    beside = output.with_name(f"{output.stem}-legend.png")
    write_plain_picture(legend(shades, (low, high)), beside, bits=8, transfer="linear")
    return shades, f"depth from {low:.1f} mm (dark) to {high:.1f} mm (white), see {beside.name}; .exr keeps millimetres"


def _check_layers(layers: bool, name: str, output: Path) -> None:
    if layers and name != "exr":
        raise UsageError(
            f"{output.name} cannot hold layers",
            where="--layers",
            rule="OpenEXR can",
            fix="give the output the ending .exr",
        )


def _sentence(output: Path, image: IntegralImage) -> str:
    height, width = image.pixels.shape[:2]
    rays = image.provenance.rays
    millions = sum(rays.values()) / 1e6
    shares = "".join(f"{100 * share:.1f} % {name}, " for name, share in image.provenance.pixel_shares.items())
    return (
        f"{output}: {width}x{height} pixels for {image.display.name}, {samples_in_words(image.provenance.spp)}, "
        f"{shares}{millions:.1f} M rays, {image.provenance.seconds['total']:.1f} s"
    )


def _with_seconds(image: IntegralImage, **seconds: float) -> IntegralImage:
    return replace(image, provenance=add_seconds(image.provenance, **seconds))


def is_tiled(output: Path, bits: int | None, display: Display, request: RenderRequest, *, resume: bool) -> bool:
    """Whether a picture has to be rendered in tiles: where that is asked for, or is the only way."""
    from lippmann.image.write import format_for

    name, _ = format_for(output, bits)
    if resume or name != "tiff":
        return resume or name == "zarr"
    from lippmann.tiles.tiled_render import fits_whole

    return not fits_whole(display, request)


@contextmanager
def _kept(output: Path, console: Console) -> Iterator[ProgressCallback]:
    """The console's progress; whatever ends the work once tiles are rendered, say what is left of it."""
    from lippmann.journal.tile_journal import journal_of

    has_begun = False

    def watching(report: Progress) -> None:
        nonlocal has_begun
        has_begun = has_begun or report.stage == "tiles"
        progress(report)

    try:
        with console.progress() as progress:
            yield watching
    except BaseException:
        if has_begun:
            console.remark(f"finished tiles are kept in {journal_of(output).name}: with --resume the command goes on")
        raise


def _render_tiled(
    source: SceneSource,
    display: Display,
    request: RenderRequest,
    output: Path,
    console: Console,
    *,
    bits: int | None,
    resume: bool,
    finish: Finish,
    runner: Runner | None,
) -> None:
    """Render into a file tile by tile, and say what came of it."""
    from lippmann.tiles.tiled_render import render_to_file

    started = time.perf_counter()
    with _kept(output, console) as progress:
        rendered = render_to_file(
            source.load(),
            display,
            request,
            output,
            bits=bits,
            resume=resume,
            finish=finish,
            runner=runner,
            progress=progress,
        )
    made = rendered.provenance
    remarks(console, made)
    width, height = rendered.size
    values = report(output, rendered.size, made)
    values["tiles"] = {"made": rendered.tiles - rendered.resumed, "found": rendered.resumed}
    found = f", {rendered.resumed} of {rendered.tiles} tiles found" if rendered.resumed else ""
    console.result(
        values,
        f"{output}: {width}x{height} pixels for {display.name}, {samples_in_words(made.spp)}{found}, "
        f"{sum(made.rays.values()) / 1e6:.1f} M rays, {time.perf_counter() - started:.1f} s",
    )
