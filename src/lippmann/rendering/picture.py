"""Rendering of a whole picture in the native pixels of a display: from the request to the integral image."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np

from lippmann.display import Display
from lippmann.display.panel import PixelWindow
from lippmann.display.view_cone import panel_window
from lippmann.options.choices import REUSING
from lippmann.progress import ProgressCallback, silent
from lippmann.rendering.provenance import make_provenance
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import Build, Session, find_uniform_background, open_session, read_choices
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.placement import Placement
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import Color

if TYPE_CHECKING:
    from lippmann.image.integral_image import IntegralImage
    from lippmann.rendering.film.wavefront import Frame


@exclusive()
def render_picture(
    scene: Scene,
    display: Display,
    request: RenderRequest,
    progress: ProgressCallback = silent,
    build: Build | None = None,
    *,
    stands_as: Display | None = None,
) -> IntegralImage:
    """Render ``scene`` for ``display`` in one piece.

    Parameters
    ----------
    build:
        As of :func:`~lippmann.rendering.session.open_session`.
    stands_as:
        Display of the same size that sets the placement instead: the original of a refined display.

    Raises
    ------
    UsageError, SceneError, MemoryLimitError, EngineError
        As the stages find them; nothing has been written then.
    """
    if request.began is None:
        request = replace(request, began=time.perf_counter())
    display.check_native()
    request = resolve(request, scene, display)
    size = display.panel.width, display.panel.height
    session = open_session(scene, request, size, progress=progress, build=build)
    request = session.request
    placement = session.place(stands_as or display)

    # Mitsuba may be loaded now that the engine has chosen its libraries.
    from lippmann.image.integral_image import IntegralImage
    from lippmann.rendering.film.aov import plan_layers, trace_layers
    from lippmann.rendering.methods import Job, trace

    display_from_world = placement.display_from_world
    source = session.rays(display, placement)
    integrator = session.integrator(source, display_from_world, placement.exposure)
    window = find_window(session, display, placement)
    part = source if window is None else source.of_window(window)

    traced = trace(Job(session, integrator, part, display_from_world))
    frame = traced.frame
    if window is not None:
        _pad_to_picture(frame, window, display, find_uniform_background(session.built, request))
    session.watch.seconds.update(traced.seconds)
    if request.layers:
        frame.maps |= session.watch.stage(
            "layers",
            lambda: trace_layers(
                session.built, source, plan_layers(source, session.memory), display_from_world, progress
            ),
        )
    provenance = make_provenance(
        session,
        frame,
        samples=traced.samples,
        options={
            **({"auto": request.reason} if request.reason else {}),
            **_reuse_options(request),
            **traced.options,
            **describe_placement(request, placement),
        },
        choices=read_choices(integrator),
        estimate=traced.estimate,
        notes=(*placement.warnings, *describe_lens_gap(display), *traced.notes),
    )
    # Files hold integers of 32 bits.
    maps = {name: v.astype(np.uint32) if v.dtype.kind in "iu" else v for name, v in frame.maps.items()}
    return IntegralImage(request.tone_mapped(frame.pixels), display, placement.world_from_display, provenance, maps)


def describe_lens_gap(display: Display) -> tuple[str, ...]:
    """A line on the gap behind the real lenses of a display; none where it has only a pitch."""
    if display.lens is None:
        return ()
    pinhole = display.lens.thickness / display.lens.index
    return (f"{display.lens.in_words()}: gap {display.gap:.4g} mm, not thickness / index ({pinhole:.4g} mm)",)


def choose_exposure(scene: Scene, display: Display, request: RenderRequest, build: Build | None = None) -> float:
    """The automatic exposure in stops of a picture of ``scene``, without rendering it.

    Raises
    ------
    UsageError, SceneError, EngineError
        As :func:`render_picture`.
    """
    session = open_session(scene, resolve(request, scene, display), build=build)
    placement = session.place(display)
    source = session.rays(display, placement)
    integrator = session.integrator(source, placement.display_from_world, placement.exposure)
    # A fixed exposure comes on top of the camera's own.
    return cast("float", read_choices(integrator).get("exposure", 0.0)) - session.choose_own_exposure(
        placement.exposure
    )


def find_window(session: Session, display: Display, placement: Placement) -> PixelWindow | None:
    """The window of pixels that can see the scene, if the others show an even background; None where all are traced.

    Only for denoised pictures: others may be rendered in tiles, and each pixel has the same samples then.
    """
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.pbr.scene import scene_corners

    built, request = session.built, session.request
    if request.method in REUSING or request.denoise == "none" or not isinstance(built, BuiltScene):
        return None
    if find_uniform_background(built, request) is None:
        return None
    return panel_window(scene_corners(built, placement.display_from_world), display)


def _pad_to_picture(frame: Frame, window: PixelWindow, display: Display, background: Color | None) -> None:
    """Pad the traced window to the whole picture with background; maps are 0 there."""
    size = display.panel.height, display.panel.width
    pixels = np.empty((*size, 3), dtype=np.float32)
    pixels[...] = background
    pixels[window.slices] = frame.pixels
    frame.pixels = pixels
    for name, values in frame.maps.items():
        frame.maps[name] = np.zeros((*size, *values.shape[2:]), dtype=values.dtype)
        frame.maps[name][window.slices] = values


def describe_placement(request: RenderRequest, placement: Placement) -> dict[str, object]:
    """Metadata of pixel filter, tone mapping and placement."""
    return {
        "pixel_filter": request.pixel_filter,
        "placement": placement.mode,
        "depth_scale": placement.depth_scale,
        **({"tone_map": request.tone_map} if request.tone_map != "none" else {}),
        **({} if request.clamp_indirect is None else {"clamp_indirect": request.clamp_indirect}),
        "depth_range": list(placement.depth_range),
        "depth_budget": list(placement.depth_budget),
    }


def _reuse_options(request: RenderRequest) -> dict[str, object]:
    if request.method not in REUSING:
        return {}
    return {"order": request.order or "default", "respect_gloss": request.careful}
