"""What a display will show to one eye, without its whole picture.

An eye sees a single (sub-)pixel at every place of the panel. Only those are traced, with the rays that they have in the
whole picture, and put where the eye sees them, as :mod:`lippmann.viewing.replay` does with a picture that is there.
"""

from __future__ import annotations

from dataclasses import replace

from lippmann.display import Display
from lippmann.display.seen_pixels import EyeMap, Vector
from lippmann.options.choices import POOLED_LIGHT, PROPERTIES
from lippmann.progress import ProgressCallback, silent
from lippmann.rendering.denoise.oidn import denoise
from lippmann.rendering.film.wavefront_plan import cut_wavefronts
from lippmann.rendering.live.develop import arrange
from lippmann.rendering.picture import placed_options
from lippmann.rendering.preview import Preview
from lippmann.rendering.request.plan import BUDGET, resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import open_session
from lippmann.runtime import machine
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.scene import Scene

#: Pixels along the longer side of the picture, where nothing is said.
LONGER_SIDE = 512


@exclusive()
def render_eye_preview(
    scene: Scene,
    display: Display,
    eye: Vector,
    request: RenderRequest,
    size: tuple[int, int] | None = None,
    progress: ProgressCallback = silent,
) -> Preview:
    """Render what an eye in front of ``display`` will see of ``scene``.

    Parameters
    ----------
    eye:
        Its place in the display's frame, mm.
    request:
        Of a whole picture. Only ``full`` light is traced, whatever the method; few samples are denoised, unless
        ``denoise`` is "none".
    size:
        Width and height that the picture, which has the panel's shape, keeps to. None: 512 pixels on its longer side.

    Raises
    ------
    UsageError, SceneError, MemoryLimitError, EngineError
        As the stages find them.
    """
    # Of splats and volumes nothing is denoised, and a denoiser that is asked for is refused.
    denoiser = request.denoise if scene.lies_off_surfaces else "none"
    plain = replace(request, method="full", denoise=denoiser, order=None, respect_gloss=None, layers=False)
    resolved = resolve(plain, scene, display)
    width, height = display.panel.size_inside(*(size or (LONGER_SIDE, LONGER_SIDE)))
    session = open_session(scene, resolved, (width, height), progress=progress)
    placement = session.place(display)

    # Mitsuba may be loaded now that the engine has chosen its libraries.
    from lippmann.rendering.film.feature_buffers import trace_guides
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.transport.ray_source import DisplayRays, SinglePixelRays

    seen = EyeMap(display, (width, height), subpixels=bool(resolved.subpixels)).seen_by(eye)
    whole = DisplayRays(display, placement.world_from_display, bool(resolved.subpixels))
    source = SinglePixelRays(whole, seen.column, seen.row, seen.channel)
    samples = _choose_samples(request, resolved, source.width)
    integrator = session.integrator(whole, placement.display_from_world, placement.exposure)
    plan = cut_wavefronts(source.width, 1, samples, memory=session.memory)
    frame = trace_frame(integrator, source, plan, seed=resolved.seed, box_filter=resolved.box_filter, progress=progress)
    picture = arrange(frame.pixels[0], seen)
    # Where lenses are larger than the picture's pixels, it is made of blocks, which the denoiser has never seen.
    is_fine = 2 * source.width > width * height * whole.channels
    # With 32 samples noise is not worth taking out.
    denoises = samples < 32 and is_fine and request.denoise != "none" and resolved.integrator not in PROPERTIES
    denoises &= machine.has_denoiser() and not (scene.lies_off_surfaces or scene.fills_panel)
    if denoises:
        guides = trace_guides(
            session.built,
            source,
            cut_wavefronts(source.width, 1, 1, memory=session.memory),
            placement.display_from_world,
            seed=resolved.seed + 1,
            box_filter=resolved.box_filter,
        )
        picture = session.watch.stage(
            "denoise",
            lambda: denoise(picture, arrange(guides.albedo[0], seen), arrange(guides.normal[0], seen), effort="fast"),
        )
        picture *= seen.number >= 0
    frame.pixels = picture
    provenance = session.provenance(
        frame,
        samples=samples,
        options={
            "eye": list(eye),
            **({"denoise": "oidn"} if denoises else {}),
            **placed_options(resolved, placement),
        },
        notes=placement.warnings,
    )
    return Preview(resolved.shown(picture), provenance)


def _choose_samples(asked: RenderRequest, resolved: RenderRequest, pixels: int) -> int:
    if asked.spp is not None or resolved.spp == 1 or resolved.integrator not in POOLED_LIGHT:
        return resolved.samples
    return min(max(1, BUDGET.values // max(1, pixels)), 64)
