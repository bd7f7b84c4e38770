"""``lippmann quilt render``: a scene becomes a quilt."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli import options, parse, rendering
from lippmann.cli.console import Console, estimate_in_words
from lippmann.progress import Progress

if TYPE_CHECKING:
    from lippmann.quilt import Quilt

Device = Annotated[
    str,
    typer.Option(
        "--display",
        "-d",
        help="A device (see 'lippmann quilt sizes'; 'portrait' will do), its visual.json, or any lenticular display.",
    ),
]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        help="The quilt to write: NAME_qsCOLUMNSxROWSaASPECT.png, .exr or .tif. By default the scene's name, here.",
        show_default=False,
    ),
]
Views = Annotated[
    str | None,
    typer.Option("--views", help="Columns x rows of views; by default those that the device is given."),
]
Size = Annotated[
    str | None, typer.Option("--size", help="Width x height of the quilt in pixels; by default the device's.")
]
Method = Annotated[
    str,
    typer.Option(
        "--method",
        help="auto: what is fastest for the quality asked for; full: every ray is traced; "
        "pooled: neighbouring views share their light before it is denoised.",
    ),
]


def render(
    scene: options.Scene,
    output: Output = None,
    display: Device = "portrait",
    views: Views = None,
    size: Size = None,
    method: Method = "auto",
    integrator: options.Integrator = "auto",
    depth: options.Depth = None,
    spp: options.Spp = None,
    quality: Annotated[
        float | None, typer.Option("--quality", help="Work until every view is estimated to reach this PSNR in dB.")
    ] = None,
    quality_mean: rendering.QualityMean = None,
    max_time: rendering.MaxTime = None,
    seed: options.Seed = 0,
    pixel_filter: options.PixelFilter = "auto",
    denoise: rendering.Denoise = "auto",
    camera: rendering.Camera = None,
    place: rendering.Place = None,
    turn: rendering.Turn = None,
    shift: rendering.Shift = None,
    scale: rendering.Scale = 1.0,
    pop_out: rendering.PopOut = None,
    environment: options.Environment = None,
    background: options.Background = None,
    allow_outside: options.AllowOutside = False,
    bits: options.Bits = None,
    device: options.Device = "auto",
    threads: options.Threads = None,
    memory: options.Memory = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Render a scene as a quilt: the views of cameras side by side before the display."""
    from lippmann import api
    from lippmann.atomic import check_writable
    from lippmann.image.formats import format_for
    from lippmann.quilt import load_device, quilt_of_display
    from lippmann.quilt_files import write_quilt

    console = Console(quiet, as_json)
    target = load_device(display)
    grid = None if views is None else parse.size(views, "--views", rule="columns x rows, such as 8x6")
    wanted = quilt_of_display(target, grid, None if size is None else parse.size(size, "--size"))
    path = output or Path(f"{Path(scene).stem}{wanted.layout.ending}.png")
    _check_name(path, wanted.layout.ending)
    format_for(path, bits)
    check_writable(path)
    with console.progress() as progress:
        started = time.perf_counter()
        loaded = api.load_scene(
            scene, environment=environment, background=rendering.color(background), allow_outside=allow_outside
        )
        load_seconds = time.perf_counter() - started
        made = api.render_quilt(
            loaded,
            target,
            views=(wanted.layout.columns, wanted.layout.rows),
            size=(wanted.width, wanted.height),
            method=method,
            integrator=integrator,
            depth=depth,
            spp=spp,
            quality=quality,
            quality_mean=quality_mean,
            max_time=max_time,
            seed=seed,
            pixel_filter=pixel_filter,
            denoise=denoise,
            placement=rendering.placement(camera, place, turn, shift, scale, pop_out),
            device=device,
            threads=threads,
            memory=parse.memory(memory),
            progress=progress,
        )
        progress(Progress("write", 0, 1))
        writing = time.perf_counter()
        write_quilt(made, path, bits=bits)
    spent = rendering.add_seconds(made.provenance, load=load_seconds, write=time.perf_counter() - writing)
    console.remark(rendering.depth_line(spent))
    for note in spent.notes:
        console.remark(note)
    if spent.estimate is not None:
        console.remark(f"estimated PSNR {estimate_in_words(spent.estimate, 'view')}")
    seconds = spent.seconds["total"]
    values: dict[str, Any] = rendering.report(path, (wanted.width, wanted.height), spent)
    console.result(values | {"display": target.name, "views": wanted.layout.views}, _sentence(path, made, seconds))


def _check_name(path: Path, ending: str) -> None:
    from lippmann.errors import OutputError
    from lippmann.quilt import layout_of_name

    if layout_of_name(path).ending != ending:
        rule = f"the quilt's ends in {ending}{path.suffix}"
        raise OutputError("the name says another quilt", where=str(path), rule=rule, fix="leave --output out")


def _sentence(path: Path, made: Quilt, seconds: float) -> str:
    width, height = made.size
    millions = sum(made.provenance.rays.values()) / 1e6
    return (
        f"{path}: {made.layout.columns}x{made.layout.rows} views, {width}x{height} pixels, "
        f"{made.provenance.spp} samples per pixel, {millions:.1f} M rays, {seconds:.1f} s"
    )
