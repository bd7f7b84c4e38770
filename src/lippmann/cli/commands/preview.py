"""``lippmann preview``: what a display will show to one eye, or the plain picture that a scene's camera sees."""

from __future__ import annotations

import time
from typing import Annotated

import typer

from lippmann.cli.shared import options, parse
from lippmann.cli.shared.command_options import with_options, without
from lippmann.cli.shared.console import Console, add_seconds, depth_line, report
from lippmann.cli.shared.scene_source import SceneSource, display_of, output_of
from lippmann.errors import UsageError
from lippmann.options.forms import LEFT_OUT
from lippmann.options.light import LightOptions
from lippmann.options.option import changed_options, flag_of
from lippmann.options.outputs import AccessOptions
from lippmann.options.placement import PlacementOptions
from lippmann.options.prints import PrintOptions
from lippmann.options.quality import MachineOptions, QualityOptions
from lippmann.options.scene import SceneOptions
from lippmann.options.texts import triple

#: The display of a picture for which none is given.
_DISPLAY = "seed-lenticular"


@with_options
def preview(
    scene: options.Scene,
    output: options.OptionalOutput = None,
    display: options.DisplayName = _DISPLAY,
    plain: Annotated[
        bool,
        typer.Option(
            "--plain",
            help="Without a display: what the scene's own camera sees, or --camera.",
            rich_help_panel="Display",
        ),
    ] = False,
    pixels: Annotated[
        str | None,
        typer.Option(
            "--pixels",
            metavar="WIDTHxHEIGHT",
            help="Largest width and height of the picture. Default: 512x512.",
            rich_help_panel="Display",
        ),
    ] = None,
    eye: Annotated[
        str | None,
        typer.Option(
            "--eye",
            metavar="X,Y,Z",
            help="Position of the eye in mm: right, up, toward the viewer. Default: in front of the middle.",
            rich_help_panel="Display",
        ),
    ] = None,
    state: options.State = None,
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    *,
    asked: SceneOptions,
    access: AccessOptions,
    placement: PlacementOptions,
    light: LightOptions,
    how: Annotated[QualityOptions, without(*LEFT_OUT["preview"])],
    printed: PrintOptions,
    machine: MachineOptions,
) -> None:
    """Show in a few seconds what a display will show to an eye in front of its middle."""
    from lippmann.image.write import check_output, write_plain_picture
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.viewing.replay import check_size, eye_before

    console = Console(quiet, as_json)
    output = output_of(output, scene, "-preview.png")
    check_output(output, bits)
    if plain:
        _check_plain(eye, display, placement, is_of_state=state is not None)
    target = display_of(display, printed)
    request = RenderRequest.from_options(how, machine, placement=placement).for_file(output, bits)
    source = SceneSource(scene, asked, light, access)
    size = check_size(parse.size(pixels or "512x512", "--pixels"), "pixels")
    at = eye_before(target, None if eye is None else triple(eye, "--eye"))
    with console.progress() as progress:
        loaded, load_seconds = source.load_timed()
        if plain:
            from lippmann.rendering.preview import render_preview

            image = render_preview(loaded, placement.camera, size, request, progress)
        else:
            from lippmann.rendering.live.eye_preview import render_eye_preview

            image = render_eye_preview(loaded, target, at, request, size, progress)
        writing = time.perf_counter()
        provenance = add_seconds(image.provenance, load=load_seconds)
        write_plain_picture(image.pixels, output, bits=bits, transfer=provenance.transfer)
        provenance = add_seconds(provenance, write=time.perf_counter() - writing)
    if not plain:
        console.remark(depth_line(provenance))
    console.remark(*provenance.notes)
    height, width = image.pixels.shape[:2]
    before = "" if plain else f" as {target.name} will show it"
    console.result(
        report(output, (width, height), provenance),
        f"{output}: {width}x{height} pixels{before}, {provenance.seconds['total']:.1f} s",
    )


def _check_plain(eye: str | None, display: str, placement: PlacementOptions, *, is_of_state: bool) -> None:
    """Refuse options of a display, of which a plain picture has none; the file of a studio may hold them."""
    given = ["eye"] if eye is not None else []
    if not is_of_state:
        given += ["display"] if display != _DISPLAY else []
        given += [name for name in changed_options(placement) if name != "camera"]
    if given:
        rule = "--plain shows the scene without a display"
        raise UsageError("is for a display", where=flag_of(given[0]), rule=rule, fix="leave one of them out")
