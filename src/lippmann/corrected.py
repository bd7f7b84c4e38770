"""Scenes rendered for the lens that is there: pixels whose light through it comes nearest to what rays meet.

The light that is meant has more directions than the display has pixels: it is the picture of a display with pixels half
as wide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from lippmann.display import Display
from lippmann.errors import UsageError
from lippmann.image import IntegralImage
from lippmann.image.stored_values import FloatArray
from lippmann.optics.correction import PARTS, LensCorrection, judged_rows
from lippmann.options.choices import PROPERTIES, Correction
from lippmann.options.correction import check_correction
from lippmann.progress import ProgressCallback, silent
from lippmann.rendering.picture import render_picture
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.preconditions import explain_missing_estimate
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.runtime.engine_lock import exclusive
from lippmann.scene.scene import Scene


def corrected_renderer(correct: Correction, headroom: float) -> Callable[..., IntegralImage]:
    """:func:`render_corrected` with a headroom, in the place of :func:`lippmann.rendering.picture.render_picture`.

    Raises
    ------
    UsageError
        As :func:`lippmann.options.correction.check_correction`.
    """
    check_correction(correct, headroom)
    return partial(render_corrected, headroom=headroom)


@exclusive()
def render_corrected(
    scene: Scene,
    display: Display,
    request: RenderRequest,
    progress: ProgressCallback = silent,
    *,
    headroom: float = 0.0,
) -> IntegralImage:
    """Render ``scene`` in one piece, corrected for the lenses of ``display``; as it is where that would gain nothing.

    Raises
    ------
    DisplayError
        The display gives no lens, or one for which pictures are not corrected.
    UsageError, SceneError, MemoryLimitError, EngineError
        As :func:`lippmann.rendering.picture.render_picture`.
    """
    resolved = resolve(request, scene, display)
    if request.layers or resolved.integrator in PROPERTIES:
        what = "layers" if request.layers else f"integrator {resolved.integrator}"
        rule = "light is corrected for a lens, nothing else"
        raise UsageError(f"beside {what}", parameter="correct", rule=rule, fix="leave one of them out")
    correction = LensCorrection(display, bool(resolved.subpixels), headroom)
    asked = replace(
        request,
        subpixels=bool(resolved.subpixels),
        spp=None if request.spp is None else -(-request.spp // PARTS**2),
    )
    # The display stands where its own depth budget has it.
    finer = render_picture(scene, finer_display(display), asked, progress, stands_as=display)
    halves = halves_of(finer.pixels)
    judged = judged_rows(display.panel.height)
    step = correction.step([(rows.start, [[part[rows] for part in half] for half in halves]) for rows in judged])
    if step.share == 0.0:
        # Light of the pixels themselves is cleaner than a mean of parts that were denoised each by itself.
        plain = render_picture(scene, display, request, progress)
        options, note = step.describe(0.0)
        made = plain.provenance
        made = replace(made, options={**made.options, **options}, notes=(*made.notes, note))
        return IntegralImage(plain.pixels, display, plain.world_from_display, made)
    pixels = correction.rows(np.mean(halves, axis=0), share=step.share)
    options, note = step.describe(float(np.mean((pixels <= 0.0) | (pixels >= 1.0))))
    # A sample of each finer pixel is several of a pixel: why those have no estimate is not why this one has none.
    of_finer = explain_missing_estimate(replace(asked, spp=finer.provenance.spp))
    why = "no estimate of the error: pixels are solved for, so that the error of samples is not theirs"
    provenance = replace(
        finer.provenance,
        options={**finer.provenance.options, **options},
        notes=(*(each for each in finer.provenance.notes if each != of_finer), why, note),
        spp=PARTS**2 * (finer.provenance.spp or 0),
        estimate=None,
    )
    return IntegralImage(pixels, display, finer.world_from_display, provenance)


def finer_display(display: Display) -> Display:
    """The same lenses before pixels half as wide and high; the middles of its sub-pixels lie where they lay."""
    panel = display.panel
    red, green, blue = ((PARTS * right, PARTS * down) for right, down in panel.subpixel_offsets)
    finer = replace(
        panel,
        width=PARTS * panel.width,
        height=PARTS * panel.height,
        pixel_pitch=panel.pixel_pitch / PARTS,
        subpixel_offsets=(red, green, blue),
    )
    return replace(display, panel=finer, sheet=None, pixel=None)


def halves_of(pixels: FloatArray) -> list[list[FloatArray]]:
    """Two independent halves of the samples of each pixel, as its parts from left to right.

    ``pixels`` is the picture on a :func:`finer_display`. A half is the upper part at the left and the lower one at the
    right, the other half what remains: so its pixels, means of their parts, have the detail of both rows.
    """
    height, width = (side // PARTS for side in pixels.shape[:2])
    cells = pixels.reshape(height, PARTS, width, PARTS, 3)
    return [[cells[:, (half + part) % PARTS, :, part] for part in range(PARTS)] for half in range(PARTS)]
