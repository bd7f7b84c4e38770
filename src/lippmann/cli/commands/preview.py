"""``lippmann preview``: the plain picture that a scene's camera sees."""

from __future__ import annotations

import time
from typing import Annotated

import typer

from lippmann.cli.shared import options, parse
from lippmann.cli.shared.console import Console
from lippmann.cli.shared.picture_report import add_seconds, report
from lippmann.cli.shared.scene_source import SceneSource


def preview(
    scene: options.Scene,
    output: options.Output,
    size: Annotated[str, typer.Option("--size", help="Width x height in pixels.")] = "512x512",
    camera: Annotated[str | None, typer.Option("--camera", help="A camera of the scene file.")] = None,
    integrator: options.Integrator = "auto",
    depth: options.Depth = None,
    spp: options.Spp = None,
    seed: options.Seed = 0,
    exposure: options.Exposure = "auto",
    pixel_filter: options.PixelFilter = "auto",
    environment: options.Environment = None,
    background: options.Background = None,
    allow_outside: options.AllowOutside = False,
    single_scattering: options.SingleScattering = False,
    bits: options.Bits = None,
    device: options.Device = "auto",
    threads: options.Threads = None,
    memory: options.Memory = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Render the plain picture that the scene's camera sees."""
    from lippmann.image.write import check_output, format_for, write_plain_picture
    from lippmann.rendering.preview import render_preview
    from lippmann.rendering.request.render_request import RenderRequest

    console = Console(quiet, as_json)
    check_output(output, format_for(output, bits)[0])
    request = RenderRequest(
        integrator=integrator,
        depth=depth,
        spp=spp,
        seed=seed,
        exposure=parse.exposure(exposure),
        pixel_filter=pixel_filter,
        device=device,
        threads=threads,
        memory=parse.memory(memory),
    )
    source = SceneSource(scene, environment, parse.color(background), allow_outside, single_scattering)
    with console.progress() as progress:
        started = time.perf_counter()
        loaded = source.load()
        load_seconds = time.perf_counter() - started
        plain = render_preview(loaded, camera, parse.size(size, "--size"), request, progress)
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
