"""``lippmann plan``: what a rendering will show and take, before it is begun."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

import typer

from lippmann.cli.commands import print as printing
from lippmann.cli.commands import sequence
from lippmann.cli.shared import options, parse
from lippmann.cli.shared.console import Console
from lippmann.cli.shared.scene_source import SceneSource


def plan(
    scene: options.Scene,
    display: options.DisplayName = "seed-lenticular",
    method: Annotated[
        Literal["auto", "full", "pooled"],
        typer.Option("--method", help="auto and pooled: light is pooled; full: every ray is traced, for references."),
    ] = "auto",
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
    caustics: options.Caustics = "auto",
    clamp_indirect: options.ClampIndirect = None,
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
    turntable: sequence.TurntableFrames = None,
    swing: sequence.Swing = None,
    state: options.State = None,
    device: options.Device = "auto",
    threads: options.Threads = None,
    memory: options.Memory = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Say what 'render' will show and take, without rendering: depth, blur, rays, memory and time."""
    from lippmann.rendering.forecast import forecast
    from lippmann.rendering.request.render_request import RenderRequest

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
    placement = parse.placement(camera, place, turn, shift, scale, depth_scale, pop_out)
    request = RenderRequest(
        method=method,
        integrator=integrator,
        depth=depth,
        spp=spp,
        effort=effort,
        seed=seed,
        exposure=parse.exposure(exposure),
        tone_map=tone_map,
        subpixels=subpixels,
        pixel_filter=pixel_filter,
        denoise=denoise,
        caustics=caustics,
        clamp_indirect=clamp_indirect,
        placement=placement,
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
    turning = sequence.Wanted(None, None, None, None, turntable, swing, None, None)
    with console.progress() as progress:
        if turning:
            from lippmann.sequences.frames import find_stand

            motion = sequence.open_moving(source, turning, request)
            where = find_stand(motion, target, placement)
            loaded, frames = motion.scene(0), motion.count
            request = replace(request, placement=where(0))
        else:
            loaded, frames = source.load(), 1
        found = forecast(loaded, target, request, progress, frames=frames)
    for note in found.notes:
        console.remark(note)
    lines = [f"{name:<15}{text}" for name, text in found.in_words().items()]
    console.result(found.to_dict(), "\n".join(lines))
