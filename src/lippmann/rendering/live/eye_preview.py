"""What a display will show to one eye, without its whole picture.

An eye sees a single (sub-)pixel at every place of the panel. Only those are traced, with the rays that they have in the
whole picture, and put where the eye sees them, as :mod:`lippmann.viewing.replay` does with a picture that is there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from lippmann.display import Display
from lippmann.display.visible_pixels import EyeMap, Floats, PixelSet, Vector, points_of_pixel
from lippmann.image.preview import Preview
from lippmann.options.choices import POOLED_LIGHT
from lippmann.progress import ProgressCallback, silent
from lippmann.rendering.denoise.oidn import Effort, load_denoiser
from lippmann.rendering.film.memory_model import cut_wavefronts
from lippmann.rendering.picture import describe_placement
from lippmann.rendering.provenance import make_provenance
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.request.tuning import TUNING
from lippmann.rendering.session import Session, open_session, read_choices
from lippmann.runtime import machine
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import Matrix

if TYPE_CHECKING:
    from lippmann.rendering.transport.ray_source import SinglePixelRays


@exclusive()
def render_eye_preview(
    scene: Scene,
    display: Display,
    eye: Vector,
    request: RenderRequest,
    size: tuple[int, int],
    progress: ProgressCallback = silent,
) -> Preview:
    """Render what an eye in front of ``display`` will see of ``scene``.

    Parameters
    ----------
    eye:
        Its place in the display's frame, mm.
    request:
        Of a whole picture. The method is always ``full``. The view is denoised if ``denoise`` asks for it, or is "auto"
        and the integrator samples light.
    size:
        Width and height that the picture, which has the panel's shape, keeps to.

    Raises
    ------
    UsageError, SceneError, MemoryLimitError, EngineError
        As the stages find them.
    """
    resolved = resolve(replace(request, method="full"), scene, display)
    width, height = display.panel.size_inside(*size)
    across = points_of_pixel(display, (width, height))
    points = EyeMap(display, (width * across, height * across), subpixels=bool(resolved.subpixels))
    visible = replace(points.pixels_for_eye(eye), across=across)
    samples = _choose_samples(request, resolved, len(visible.column) // visible.channels)
    denoises = _denoises(request, resolved, scene)
    # The eye's view is denoised, not the traced pixels.
    plain = replace(resolved, spp=samples, denoise="none")
    session = open_session(scene, plain, (width, height), progress=progress)
    placement = session.place(display)

    # Mitsuba may be loaded now that the engine has chosen its libraries.
    from lippmann.rendering.denoise.guided_denoiser import choose_effort
    from lippmann.rendering.film.wavefront import trace_frame
    from lippmann.rendering.transport.ray_source import SinglePixelRays

    whole = session.rays(display, placement)
    source = SinglePixelRays(whole, visible.column, visible.row, visible.channel)
    integrator = session.integrator(whole, placement.display_from_world, placement.exposure)
    plan = cut_wavefronts(source.width, source.height, samples, channels=source.channels, memory=session.memory)
    frame = trace_frame(integrator, source, plan, seed=plain.seed, box_filter=plain.box_filter, progress=progress)
    options: dict[str, object] = {}
    if denoises:
        effort = choose_effort(request.denoise, samples)
        picture = _denoise_view(session, source, placement.display_from_world, visible, frame.pixels, effort)
        options = {"denoise": "oidn", "denoise_effort": effort}
    else:
        picture = visible.arrange(frame.pixels[0])
    frame.pixels = picture
    provenance = make_provenance(
        session,
        frame,
        samples=samples,
        options={"eye": list(eye), **options, **describe_placement(resolved, placement)},
        choices=read_choices(integrator),
        notes=placement.warnings,
    )
    return Preview(resolved.tone_mapped(picture), provenance)


def _choose_samples(asked: RenderRequest, resolved: RenderRequest, places: int) -> int:
    if asked.spp is not None or resolved.spp == 1 or resolved.integrator not in POOLED_LIGHT:
        return resolved.samples
    return min(max(1, TUNING.values // max(1, places)), TUNING.usual)


def _denoises(asked: RenderRequest, resolved: RenderRequest, scene: Scene) -> bool:
    if resolved.denoises:
        load_denoiser()
        return True
    is_noisy = asked.denoise == "auto" and resolved.integrator in POOLED_LIGHT
    return is_noisy and not (scene.lies_off_surfaces or scene.is_unlit) and machine.has_denoiser()


def _denoise_view(
    session: Session,
    source: SinglePixelRays,
    display_from_world: Matrix,
    visible: PixelSet,
    pixels: Floats,
    effort: Effort,
) -> Floats:
    """The eye's denoised picture, from its noisy ``pixels (1, n, 3)`` and the feature buffers of the same pixels."""
    from lippmann.rendering.denoise.dual_buffer import denoise_light
    from lippmann.rendering.denoise.guided_denoiser import SurfacePart, denoise_surfaces
    from lippmann.rendering.denoise.tuning import TUNING as DENOISE
    from lippmann.rendering.film.feature_buffers import plan_guides, trace_guides

    request, plan = session.request, plan_guides(source, DENOISE.guide_samples // visible.points, session.memory)
    progress = session.watch.progress
    guides = trace_guides(
        session.built, source, plan, display_from_world, box_filter=request.box_filter, progress=progress
    )
    noisy, albedo, normal = (
        visible.arrange_for_denoiser(values[0]) for values in (pixels, guides.albedo, guides.normal)
    )
    surfaces = SurfacePart.of(normal)

    def denoise(light: Floats, *_: object) -> Floats:
        return denoise_surfaces(light, albedo, normal, surfaces, effort=effort)

    clean = session.watch.stage("denoise", lambda: denoise_light(noisy, None, denoise, request.samples))
    return visible.arrange_denoised(clean)
