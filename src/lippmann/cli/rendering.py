"""``lippmann render`` and ``lippmann preview``: a scene becomes a picture."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli import clusters, options, parse, printing, sequences, tiled
from lippmann.cli.console import Console, estimate_in_words
from lippmann.errors import UsageError
from lippmann.progress import Progress

if TYPE_CHECKING:
    from lippmann.image import IntegralImage, Provenance
    from lippmann.scene.placement import PlacementOptions

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
        help="none, or oidn: take the noise out with Open Image Denoise (extra 'denoise'), with the effort that the "
        "rays deserve; oidn-fast and oidn-high name it. auto: with --method pooled, and where --method auto finds that "
        "better.",
    ),
]
Layers = Annotated[
    bool,
    typer.Option(
        "--layers", help="Add depth, position, normal, albedo and shape of what each pixel sees (OpenEXR only)."
    ),
]
Subpixels = Annotated[bool, typer.Option("--subpixels", help="A ray for every sub-pixel, at its own place.")]


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
    resume: tiled.Resume = False,
    cluster: clusters.ClusterName = None,
    tls_ca: clusters.TlsCa = None,
    tls_cert: clusters.TlsCert = None,
    tls_key: clusters.TlsKey = None,
    frames: sequences.Frames = None,
    fps: sequences.Fps = None,
    animation: sequences.Animation = None,
    camera_path: sequences.CameraPath = None,
    video: sequences.Video = None,
    eye: sequences.Eye = None,
    device: options.Device = "auto",
    threads: options.Threads = None,
    memory: options.Memory = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Render a scene into the native pixels of a display."""
    from lippmann import api
    from lippmann.atomic import check_folder_writable, check_writable
    from lippmann.cli.maps import write_maps
    from lippmann.image.formats import format_for

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
        "turn": angles(turn),
        "shift": (0.0, 0.0, 0.0) if shift is None else parse.triple(shift, "--shift"),
        "scale": scale,
        "pop_out": pop_out,
        "device": device,
        "threads": threads,
        "memory": parse.memory(memory),
    }
    load: dict[str, Any] = {"environment": environment, "background": color(background), "allow_outside": allow_outside}
    wanted = sequences.Wanted(frames, fps, animation, camera_path, video, eye)
    on_cluster = clusters.Asked(cluster, tls_ca, tls_cert, tls_key)
    if wanted:
        files: dict[str, Any] = {"bits": bits, "maps": maps, "resume": resume}
        with on_cluster.runner(console, threads) as runner:
            sequences.render_frames(scene, output, wanted, console, load=load, runner=runner, **files, **asked)
        return
    _check_layers(layers, format_for(output, bits)[0], output)
    sizing = {name: asked[name] for name in ("method", "denoise", "subpixels", "memory")}
    if on_cluster or tiled.is_tiled(output, bits, target, resume=resume, **sizing):
        _check_whole({"--maps": maps, "--marks": margin})
        with on_cluster.runner(console, threads) as runner:
            tiled.render_tiled(scene, output, console, bits=bits, resume=resume, load=load, runner=runner, **asked)
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
            write_maps(image, maps)
        image = printing.marked(image, margin)
        image.save(output, bits=bits)
    written = _with_seconds(image, write=time.perf_counter() - writing)
    remarks(console, image.provenance)
    height, width = image.pixels.shape[:2]
    console.result(report(output, (width, height), written.provenance), _sentence(output, written))


def preview(
    scene: options.Scene,
    output: options.Output,
    size: Annotated[str, typer.Option("--size", help="Width x height in pixels.")] = "512x512",
    camera: Annotated[str | None, typer.Option("--camera", help="A camera of the scene file.")] = None,
    integrator: options.Integrator = "auto",
    depth: options.Depth = None,
    spp: options.Spp = None,
    seed: options.Seed = 0,
    pixel_filter: options.PixelFilter = "auto",
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
    """Render the plain picture that the scene's camera sees."""
    from lippmann import api
    from lippmann.atomic import check_writable
    from lippmann.image.formats import format_for, write_plain_picture

    console = Console(quiet, as_json)
    format_for(output, bits)
    check_writable(output)
    with console.progress() as progress:
        started = time.perf_counter()
        loaded = api.load_scene(
            scene, environment=environment, background=color(background), allow_outside=allow_outside
        )
        load_seconds = time.perf_counter() - started
        plain = api.preview(
            loaded,
            size=parse.size(size, "--size"),
            camera=camera,
            integrator=integrator,
            depth=depth,
            spp=spp,
            seed=seed,
            pixel_filter=pixel_filter,
            device=device,
            threads=threads,
            memory=parse.memory(memory),
            progress=progress,
        )
        writing = time.perf_counter()
        provenance = add_seconds(plain.provenance, load=load_seconds)
        write_plain_picture(plain.pixels, output, bits=bits, transfer=provenance.transfer)
        provenance = add_seconds(provenance, write=time.perf_counter() - writing)
    for note in provenance.notes:
        console.remark(note)
    height, width = plain.pixels.shape[:2]
    console.result(
        report(output, (width, height), provenance),
        f"{output}: {width}x{height} pixels in {provenance.seconds['total']:.1f} s",
    )


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


def remarks(console: Console, made: Provenance) -> None:
    """What is to be known of a picture beside its figures."""
    console.remark(depth_line(made))
    if "auto" in made.options:
        console.remark(f"auto: {made.options['auto']}")
    for note in made.notes:
        console.remark(note)
    if made.estimate is not None:
        console.remark(f"estimated PSNR {estimate_in_words(made.estimate)}")


def report(output: Path, size: tuple[int, int], provenance: Provenance) -> dict[str, Any]:
    """What ``--json`` says of a render."""
    return {
        "output": str(output),
        "size": list(size),
        "method": provenance.method,
        "integrator": provenance.integrator,
        "depth": provenance.depth,
        "spp": provenance.spp,
        "seed": provenance.seed,
        "traced_fraction": provenance.traced_fraction,
        "pixel_shares": dict(provenance.pixel_shares),
        "estimate": None if provenance.estimate is None else dict(provenance.estimate),
        "rays": dict(provenance.rays),
        "seconds": dict(provenance.seconds),
        "options": dict(provenance.options),
        "notes": list(provenance.notes),
    }


def _sentence(output: Path, image: IntegralImage) -> str:
    height, width = image.pixels.shape[:2]
    rays = image.provenance.rays
    millions = sum(rays.values()) / 1e6
    shares = "".join(f"{100 * share:.1f} % {name}, " for name, share in image.provenance.pixel_shares.items())
    return (
        f"{output}: {width}x{height} pixels for {image.display.name}, {image.provenance.spp} samples per pixel, "
        f"{shares}{millions:.1f} M rays, {image.provenance.seconds['total']:.1f} s"
    )


def depth_line(made: Provenance) -> str:
    """Where the scene lies, beside what the display can resolve."""
    (back, front), (far, near) = (made.options[key] for key in ("depth_range", "resolvable_range"))
    return f"scene {depths(back, front)}; the display resolves {depths(far, near)}"


def depths(back: float, front: float) -> str:
    """A range of depth in words."""
    return f"from {-back:.1f} mm behind to {front:.1f} mm before the lens plane"


def _with_seconds(image: IntegralImage, **seconds: float) -> IntegralImage:
    return replace(image, provenance=add_seconds(image.provenance, **seconds))


def add_seconds(provenance: Provenance, **seconds: float) -> Provenance:
    """Time spent outside the renderer belongs to its stage and to the total."""
    added = dict(provenance.seconds)
    for stage, value in seconds.items():
        added[stage] = added.get(stage, 0.0) + value
        added["total"] = added.get("total", 0.0) + value
    return replace(provenance, seconds=added)


def color(text: str | None) -> tuple[float, float, float] | None:
    """A background colour from what was typed."""
    return None if text is None else parse.triple(text, "--background")


def placement(
    camera: str | None, place: str | None, turn: str | None, shift: str | None, scale: float, pop_out: float | None
) -> PlacementOptions:
    """Where the display is to stand, from the options of those names."""
    from lippmann.scene.placement import PlacementOptions

    return PlacementOptions(
        mode=place,  # type: ignore[arg-type]  # it is checked there
        camera=camera,
        turn=angles(turn),
        shift=(0.0, 0.0, 0.0) if shift is None else parse.triple(shift, "--shift"),
        scale=scale,
        pop_out=pop_out,
    )


def angles(text: str | None) -> tuple[float, float, float]:
    """Yaw, pitch and roll in degrees from what was typed."""
    if text is None:
        return 0.0, 0.0, 0.0
    values = parse.numbers(text, "--turn", (1, 2, 3))
    yaw, pitch, roll = (*values, *([0.0] * (3 - len(values))))
    return math.fmod(yaw, 360.0), pitch, roll
