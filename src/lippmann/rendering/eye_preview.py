"""What a display will show to one eye, without its whole picture.

An eye sees a single (sub-)pixel at every place of the panel. Only those are traced, with the rays that they have in the
whole picture, and put where the eye sees them, as :mod:`lippmann.viewing.replay` does with a picture that is there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.array_ops import NUMPY
from lippmann.progress import ProgressCallback, silent
from lippmann.rendering.denoise.oidn import denoise, load_denoiser
from lippmann.rendering.film.wavefront_plan import make_plan
from lippmann.rendering.picture import placed_options
from lippmann.rendering.preview import Preview
from lippmann.rendering.request.choices import LIGHT, POOLED_LIGHT
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import open_session
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.scene import Scene

#: Pixels along the longer side of the picture, where nothing is said.
LONGER_SIDE = 512
#: Samples that a picture is made of where no number is given, and the most of one (sub-)pixel.
_SAMPLE_BUDGET, _MOST_SAMPLES = 1 << 20, 64
#: With so many samples, noise is not worth taking out.
_CLEAN_FROM = 32

Vector = tuple[float, float, float]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class SeenPixels:
    """The (sub-)pixels of a panel that an eye sees at the pixels of a picture.

    Attributes
    ----------
    column, row, channel:
        ``(n,)``: each once.
    number:
        ``(height, width, 3)``: which of them each value of the picture shows; -1 where the eye looks past the panel.
    """

    column: Indices
    row: Indices
    channel: Indices
    number: Indices


def seen_pixels(display: Display, eye: Vector, size: tuple[int, int], *, subpixels: bool) -> SeenPixels:
    """What an eye at ``eye`` (mm) sees of a panel, as a picture of the lens plane: ``size`` is (width, height)."""
    width, height = size
    panel = display.panel
    u, v = np.meshgrid(
        (np.arange(width) + 0.5) * panel.width / width, (np.arange(height) + 0.5) * panel.height / height
    )
    seen = display.panel_point_seen_by(*eye, *display.panel_point(u, v), NUMPY)
    at_column, at_row = display.pixel_coordinates(*seen)
    keys = np.empty((height, width, 3), np.int64)
    for channel in range(3):
        right, down = panel.subpixel_offsets[channel] if subpixels else (0.0, 0.0)
        column, row = (
            np.floor(np.clip(at - by, -1e9, 1e9)).astype(np.int64) for at, by in ((at_column, right), (at_row, down))
        )
        inside = (column >= 0) & (column < panel.width) & (row >= 0) & (row < panel.height)
        key = (row * panel.width + column) * 3 + (channel if subpixels else 0)
        keys[..., channel] = np.where(inside, key, -1)
    found, number = np.unique(keys, return_inverse=True)
    first = int(found[0] < 0)
    found = found[first:]
    pixel = found // 3
    return SeenPixels(
        pixel % panel.width, pixel // panel.width, found % 3, number.reshape(keys.shape).astype(np.int64) - first
    )


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

    seen = seen_pixels(display, eye, (width, height), subpixels=bool(resolved.subpixels))
    whole = DisplayRays(display, placement.world_from_display, bool(resolved.subpixels))
    source = SinglePixelRays(whole, seen.column, seen.row, seen.channel)
    samples = _choose_samples(request, resolved, source.width)
    integrator = session.integrator(whole, placement.display_from_world, placement.exposure)
    plan = make_plan(source.width, 1, samples, memory=session.memory)
    frame = trace_frame(integrator, source, plan, seed=resolved.seed, box_filter=resolved.box_filter, progress=progress)
    picture = _picture(frame.pixels[0], seen)
    # Where lenses are larger than the picture's pixels, it is made of blocks, which the denoiser has never seen.
    is_fine = 2 * source.width > width * height * whole.channels
    denoises = samples < _CLEAN_FROM and is_fine and request.denoise != "none" and resolved.integrator in LIGHT
    denoises &= not (scene.lies_off_surfaces or scene.fills_panel)
    if denoises:
        load_denoiser()
        guides = trace_guides(
            session.built,
            source,
            make_plan(source.width, 1, 1, memory=session.memory),
            placement.display_from_world,
            seed=resolved.seed + 1,
            box_filter=resolved.box_filter,
        )
        picture = session.watch.stage(
            "denoise",
            lambda: denoise(picture, _picture(guides.albedo[0], seen), _picture(guides.normal[0], seen), effort="fast"),
        )
        picture[seen.number < 0] = 0.0
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


def _picture(values: NDArray[np.float32], seen: SeenPixels) -> NDArray[np.float32]:
    """The picture ``(height, width, 3)`` of the values ``(n, 3)`` of pixels; black past the panel."""
    with_black = np.concatenate([values, np.zeros((1, 3), np.float32)])
    return np.ascontiguousarray(with_black[seen.number, np.arange(3)])


def _choose_samples(asked: RenderRequest, resolved: RenderRequest, pixels: int) -> int:
    if asked.spp is not None or resolved.spp == 1 or resolved.integrator not in POOLED_LIGHT:
        return resolved.samples
    return min(max(1, _SAMPLE_BUDGET // max(1, pixels)), _MOST_SAMPLES)
