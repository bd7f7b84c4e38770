"""``lippmann preview``: what a display will show to one eye, or the plain picture that a scene's camera sees."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.commands import print as printing
from lippmann.cli.shared import options, parse
from lippmann.cli.shared.console import Console
from lippmann.cli.shared.default_output import output_of
from lippmann.cli.shared.picture_report import add_seconds, depth_line, report
from lippmann.cli.shared.scene_source import SceneSource
from lippmann.errors import UsageError
from lippmann.rendering.request.choices import tone_map_of

if TYPE_CHECKING:
    from lippmann.progress import ProgressCallback
    from lippmann.rendering.preview import Preview
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.scene.scene import Scene


def preview(
    scene: options.Scene,
    output: options.OptionalOutput = None,
    display: options.DisplayName = "seed-lenticular",
    plain: Annotated[
        bool, typer.Option("--plain", help="Without a display: what the scene's own camera sees, or --camera.")
    ] = False,
    pixels: Annotated[
        str | None, typer.Option("--pixels", help="Width x height that the picture keeps to; 512x512 by default.")
    ] = None,
    eye: Annotated[
        str | None, typer.Option("--eye", help="The eye's place: X,Y,Z in mm; by default in front of the middle.")
    ] = None,
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
    seed: options.Seed = 0,
    exposure: options.Exposure = "auto",
    tone_map: options.ToneMap = "auto",
    subpixels: options.Subpixels = None,
    pixel_filter: options.PixelFilter = "auto",
    denoise: options.Denoise = "auto",
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
    bits: options.Bits = None,
    state: options.State = None,
    device: options.Device = "auto",
    threads: options.Threads = None,
    memory: options.Memory = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Show in a second or two what a display will show to an eye in front of its middle."""
    from lippmann.image.write import check_output, format_for, write_plain_picture
    from lippmann.rendering.request.render_request import RenderRequest

    console = Console(quiet, as_json)
    output = output_of(output, scene, "-preview.png")
    check_output(output, format_for(output, bits)[0])
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
    request = RenderRequest(
        integrator=integrator,
        depth=depth,
        spp=spp,
        effort=effort,
        seed=seed,
        exposure=parse.exposure(exposure),
        tone_map=tone_map_of(tone_map, output),
        subpixels=subpixels,
        pixel_filter=pixel_filter,
        denoise=denoise,
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
    with console.progress() as progress:
        started = time.perf_counter()
        loaded = source.load()
        load_seconds = time.perf_counter() - started
        if plain:
            found = _plain(loaded, camera, pixels, eye, request, progress)
        else:
            from lippmann.rendering.live.eye_preview import render_eye_preview
            from lippmann.viewing.replay import default_eye

            at = default_eye(target) if eye is None else parse.triple(eye, "--eye")
            most = None if pixels is None else parse.size(pixels, "--pixels")
            found = render_eye_preview(loaded, target, at, request, most, progress)
        writing = time.perf_counter()
        provenance = add_seconds(found.provenance, load=load_seconds)
        write_plain_picture(found.pixels, output, bits=bits, transfer=provenance.transfer)
        provenance = add_seconds(provenance, write=time.perf_counter() - writing)
    if not plain:
        console.remark(depth_line(provenance))
    for note in provenance.notes:
        console.remark(note)
    height, width = found.pixels.shape[:2]
    before = "" if plain else f" as {target.name} will show it"
    console.result(
        report(output, (width, height), provenance),
        f"{output}: {width}x{height} pixels{before}, {provenance.seconds['total']:.1f} s",
    )


def _plain(
    scene: Scene,
    camera: str | None,
    size: str | None,
    eye: str | None,
    request: RenderRequest,
    progress: ProgressCallback,
) -> Preview:
    from lippmann.rendering.preview import render_preview

    if eye is not None:
        raise UsageError("sees a display", where="--eye", rule="--plain has none", fix="leave one of them out")
    return render_preview(scene, camera, parse.size(size or "512x512", "--pixels"), request, progress)
