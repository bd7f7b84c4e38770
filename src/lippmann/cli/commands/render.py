"""``lippmann render``: a scene becomes a display's native picture, whole or tile by tile."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli.commands import cluster as clusters
from lippmann.cli.commands import print as printing
from lippmann.cli.commands import sequence
from lippmann.cli.shared import options, parse
from lippmann.cli.shared.console import Console
from lippmann.cli.shared.picture_report import add_seconds, remarks, report
from lippmann.errors import UsageError
from lippmann.progress import Progress, ProgressCallback

if TYPE_CHECKING:
    from lippmann.display import Display
    from lippmann.image import IntegralImage
    from lippmann.tiles.tiled_render import Rendered, Runner

Method = Annotated[
    str,
    typer.Option(
        "--method",
        help="auto: what is fastest for the quality asked for; full: every ray is traced; "
        "lens-view: points are carried from lens to lens and missed pixels traced; "
        "interpolated: those of every other lens are averaged; "
        "pooled: noise is taken out, and all lenses that see a point share its light.",
    ),
]
Order = Annotated[
    str | None,
    typer.Option("--order", help="For lens-view and interpolated: default, or paper (lens by lens, as the paper did)."),
]
RespectGloss = Annotated[
    bool | None,
    typer.Option(
        "--respect-gloss/--no-respect-gloss",
        help="For them: trace what carrying over would falsify (mirrors, glass, highlights, edges). "
        "By default yes, but in the paper's order.",
        show_default=False,
    ),
]
Maps = Annotated[
    Path | None,
    typer.Option(
        "--maps",
        help="Write pictures of where pixels came from and of their estimated error into this folder.",
        show_default=False,
    ),
]
Camera = Annotated[str | None, typer.Option("--camera", help="Place the display by this camera of the scene file.")]
Place = Annotated[
    str | None,
    typer.Option(
        "--place",
        help="fit: the scene into the display's depth; camera: as the scene's camera looks; "
        "display: scene units are its mm. By default a bundled scene's own camera, else fit.",
    ),
]
Turn = Annotated[str | None, typer.Option("--turn", help="Turn the scene: YAW[,PITCH[,ROLL]] in degrees.")]
Shift = Annotated[str | None, typer.Option("--shift", help="Move the scene: X,Y,Z in mm.")]
Scale = Annotated[float, typer.Option("--scale", help="Enlarge the scene about the display's centre.")]
PopOut = Annotated[
    float | None, typer.Option("--pop-out", help="Share of the scene's depth in front of the lens plane, 0 to 1.")
]
Quality = Annotated[
    float | None,
    typer.Option("--quality", help="Work until every micro-image is estimated to reach this PSNR in dB, such as 40."),
]
QualityMean = Annotated[
    float | None, typer.Option("--quality-mean", help="Work until the whole picture is estimated to reach this PSNR.")
]
MaxTime = Annotated[
    float | None, typer.Option("--max-time", help="Stop tracing after so many seconds, with the best so far.")
]
Denoise = Annotated[
    str,
    typer.Option(
        "--denoise",
        help="none, or oidn: take the noise out with Open Image Denoise, with the effort that the rays deserve; "
        "oidn-fast and oidn-high name it. auto: with --method pooled, and where --method auto finds that better.",
    ),
]
Layers = Annotated[
    bool,
    typer.Option(
        "--layers", help="Add depth, position, normal, albedo and shape of what each pixel sees (OpenEXR only)."
    ),
]
Subpixels = Annotated[bool, typer.Option("--subpixels", help="A ray for every sub-pixel, at its own place.")]
Resume = Annotated[
    bool,
    typer.Option(
        "--resume",
        help="Keep finished tiles beside the output, and go on with those (of a sequence: with the frames) that an "
        "interrupted run left. See docs/large-pictures.md.",
    ),
]

#: What places the display, by the names of ``PlacementOptions``.
_PLACEMENT = {
    "place": "mode",
    "camera": "camera",
    "turn": "turn",
    "shift": "shift",
    "scale": "scale",
    "pop_out": "pop_out",
}
#: What only renderers of whole pictures know; refused where it is asked for.
_WHOLE = {"order": "--order", "respect_gloss": "--respect-gloss"}


def render(
    scene: options.Scene,
    output: options.Output,
    display: options.DisplayName = "seed-lenticular",
    method: Method = "auto",
    order: Order = None,
    respect_gloss: RespectGloss = None,
    maps: Maps = None,
    integrator: options.Integrator = "auto",
    depth: options.Depth = None,
    spp: options.Spp = None,
    quality: Quality = None,
    quality_mean: QualityMean = None,
    max_time: MaxTime = None,
    seed: options.Seed = 0,
    subpixels: Subpixels = False,
    pixel_filter: options.PixelFilter = "auto",
    denoise: Denoise = "auto",
    layers: Layers = False,
    camera: Camera = None,
    place: Place = None,
    turn: Turn = None,
    shift: Shift = None,
    scale: Scale = 1.0,
    pop_out: PopOut = None,
    environment: options.Environment = None,
    background: options.Background = None,
    allow_outside: options.AllowOutside = False,
    lpi: printing.Lpi = None,
    print_lpi: printing.PrintLpi = None,
    ppi: printing.Ppi = None,
    size: printing.Size = None,
    viewing_distance: printing.Distance = None,
    thickness: printing.Thickness = None,
    index: printing.Index = None,
    field: printing.Field = None,
    marks: printing.MarksMargin = None,
    bits: options.Bits = None,
    resume: Resume = False,
    cluster: clusters.ClusterName = None,
    tls_ca: clusters.TlsCa = None,
    tls_cert: clusters.TlsCert = None,
    tls_key: clusters.TlsKey = None,
    frames: sequence.Frames = None,
    fps: sequence.Fps = None,
    animation: sequence.Animation = None,
    camera_path: sequence.CameraPath = None,
    video: sequence.Video = None,
    eye: sequence.Eye = None,
    device: options.Device = "auto",
    threads: options.Threads = None,
    memory: options.Memory = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Render a scene into the native pixels of a display."""
    from lippmann import api
    from lippmann.image.write import format_for
    from lippmann.runtime.atomic_write import check_folder_writable, check_writable

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
    margin = printing.margin_of(marks, target, in_frames=frames is not None)
    asked: dict[str, Any] = {
        "display": target,
        "method": method,
        "order": order,
        "respect_gloss": respect_gloss,
        "integrator": integrator,
        "depth": depth,
        "spp": spp,
        "quality": quality,
        "quality_mean": quality_mean,
        "max_time": max_time,
        "seed": seed,
        "subpixels": subpixels,
        "pixel_filter": pixel_filter,
        "denoise": denoise,
        "layers": layers,
        "camera": camera,
        "place": place,
        "turn": parse.angles(turn),
        "shift": (0.0, 0.0, 0.0) if shift is None else parse.triple(shift, "--shift"),
        "scale": scale,
        "pop_out": pop_out,
        "device": device,
        "threads": threads,
        "memory": parse.memory(memory),
    }
    load: dict[str, Any] = {
        "environment": environment,
        "background": parse.color(background),
        "allow_outside": allow_outside,
    }
    wanted = sequence.Wanted(frames, fps, animation, camera_path, video, eye)
    on_cluster = clusters.Asked(cluster, tls_ca, tls_cert, tls_key)
    if wanted:
        files: dict[str, Any] = {"bits": bits, "maps": maps, "resume": resume}
        with on_cluster.runner(console, threads) as runner:
            sequence.render_frames(scene, output, wanted, console, load=load, runner=runner, **files, **asked)
        return
    _check_layers(layers, format_for(output, bits)[0], output)
    sizing = {name: asked[name] for name in ("method", "denoise", "subpixels", "memory")}
    if on_cluster or is_tiled(output, bits, target, resume=resume, **sizing):
        _check_whole({"--maps": maps, "--marks": margin})
        with on_cluster.runner(console, threads) as runner:
            _render_tiled(scene, output, console, bits=bits, resume=resume, load=load, runner=runner, **asked)
        return
    check_writable(output)
    if maps is not None:
        check_folder_writable(maps)
    with console.progress() as progress:
        started = time.perf_counter()
        loaded = api.load_scene(scene, **load)
        load_seconds = time.perf_counter() - started
        image = api.render(loaded, **asked, progress=progress)
        progress(Progress("write", 0, 1))
        writing = time.perf_counter()
        image = _with_seconds(image, load=load_seconds)
        if maps is not None:
            from lippmann.viewing.diagnostic_maps import write_maps

            write_maps(image, maps)
        image = printing.marked(image, margin)
        image.save(output, bits=bits)
    written = _with_seconds(image, write=time.perf_counter() - writing)
    remarks(console, image.provenance)
    height, width = image.pixels.shape[:2]
    console.result(report(output, (width, height), written.provenance), _sentence(output, written))


def _check_layers(layers: bool, name: str, output: Path) -> None:
    if layers and name != "exr":
        raise UsageError(
            f"{output.name} cannot hold layers",
            where="--layers",
            rule="OpenEXR can",
            fix="give the output the ending .exr",
        )


def _check_whole(asked: Mapping[str, object]) -> None:
    """Refuse what can only be done to a picture in one piece."""
    for option, value in asked.items():
        if value:
            raise UsageError(
                "needs the whole picture at once",
                where=option,
                rule="with --resume, to Zarr and beyond the memory pictures are rendered in tiles",
                fix="leave it out",
            )


def _sentence(output: Path, image: IntegralImage) -> str:
    height, width = image.pixels.shape[:2]
    rays = image.provenance.rays
    millions = sum(rays.values()) / 1e6
    shares = "".join(f"{100 * share:.1f} % {name}, " for name, share in image.provenance.pixel_shares.items())
    return (
        f"{output}: {width}x{height} pixels for {image.display.name}, {image.provenance.spp} samples per pixel, "
        f"{shares}{millions:.1f} M rays, {image.provenance.seconds['total']:.1f} s"
    )


def _with_seconds(image: IntegralImage, **seconds: float) -> IntegralImage:
    return replace(image, provenance=add_seconds(image.provenance, **seconds))


def is_tiled(output: Path, bits: int | None, display: Display, *, resume: bool, **asked: Any) -> bool:
    """Whether a picture has to be rendered in tiles: where that is asked for, or is the only way.

    ``asked``: method, denoise, subpixels and memory, as those of
    :class:`~lippmann.rendering.request.settings.RenderSettings`.
    """
    from lippmann.image.write import format_for
    from lippmann.rendering.picture import default_memory
    from lippmann.rendering.request.settings import RenderSettings
    from lippmann.tiles.tiled_render import fits_whole

    name, _ = format_for(output, bits)
    if resume or name == "zarr":
        return True
    settings = RenderSettings(**asked)
    return name == "tiff" and not fits_whole(display, settings, settings.memory or default_memory())


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
    scene: str,
    output: Path,
    console: Console,
    *,
    display: Display,
    bits: int | None,
    resume: bool,
    load: Mapping[str, Any],
    runner: Runner | None = None,
    **asked: Any,
) -> Rendered:
    """Render into a file tile by tile, and say what came of it."""
    from lippmann import api
    from lippmann.scene.placement import PlacementOptions

    for name, option in _WHOLE.items():
        if asked.pop(name) is not None:
            raise UsageError("is for methods that need the whole picture", where=option, fix="leave it out")
    placement = PlacementOptions(**{_PLACEMENT[name]: asked.pop(name) for name in list(asked) if name in _PLACEMENT})
    started = time.perf_counter()
    with _kept(output, console) as progress:
        loaded = api.load_scene(scene, **load)
        rendered = api.render_to_file(
            loaded,
            output,
            display,
            bits=bits,
            resume=resume,
            placement=placement,
            runner=runner,
            progress=progress,
            **asked,
        )
    made = rendered.provenance
    remarks(console, made)
    width, height = rendered.size
    values = report(output, rendered.size, made)
    values["tiles"] = {"made": rendered.tiles - rendered.resumed, "found": rendered.resumed}
    found = f", {rendered.resumed} of {rendered.tiles} tiles found" if rendered.resumed else ""
    console.result(
        values,
        f"{output}: {width}x{height} pixels for {display.name}, {made.spp} samples per pixel{found}, "
        f"{sum(made.rays.values()) / 1e6:.1f} M rays, {time.perf_counter() - started:.1f} s",
    )
    return rendered
