"""``lippmann plan``: what a rendering will show and take, before it is begun."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from lippmann.cli.shared import options
from lippmann.cli.shared.command_options import for_form, only, with_options
from lippmann.cli.shared.console import Console
from lippmann.cli.shared.scene_source import SceneSource, planned_display
from lippmann.options.light import LightOptions
from lippmann.options.outputs import AccessOptions, SequenceOptions
from lippmann.options.placement import PlacementOptions
from lippmann.options.prints import PrintOptions
from lippmann.options.quality import MachineOptions, QualityOptions
from lippmann.options.scene import SceneOptions


@with_options
def plan(
    scene: options.Scene,
    display: options.DisplayName = "seed-lenticular",
    state: options.State = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    *,
    asked: SceneOptions,
    access: AccessOptions,
    placement: PlacementOptions,
    light: LightOptions,
    how: Annotated[QualityOptions, for_form("forecast")],
    printed: PrintOptions,
    turning: Annotated[SequenceOptions, only("turntable", "swing")],
    machine: MachineOptions,
) -> None:
    """Say what 'render' will show and take, without rendering: depth, blur, rays, memory and time.

    For an eye-tracked monitor --size is that of its pair in pixels, such as 7680x2160.
    """
    from lippmann.rendering.forecast import forecast
    from lippmann.rendering.request.render_request import RenderRequest

    console = Console(quiet, as_json)
    target, pair_size = planned_display(display, printed)
    request = RenderRequest.from_options(how, machine, placement=placement)
    source = SceneSource(scene, asked, light, access)
    with console.progress() as progress:
        if turning:
            from lippmann.cli.commands.sequence import open_moving
            from lippmann.sequences.frames import place_frames

            motion = open_moving(source, turning, request)
            where = place_frames(motion, target, placement)
            loaded, frames = motion.scene(0), motion.count
            request = replace(request, placement=where(0))
        else:
            loaded, frames = source.load(), 1
        prediction = forecast(loaded, target, request, progress, frames=frames, size=pair_size)
    console.remark(*prediction.notes)
    lines = [f"{name:<15}{text}" for name, text in prediction.in_words().items()]
    console.result(prediction.to_dict(), "\n".join(lines))
