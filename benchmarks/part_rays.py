"""Pictures of parts of pixels: light in more directions than a display has."""

from __future__ import annotations

from lippmann.rendering.picture import render_picture
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.runtime import engine


def render(scene, display, exposure, samples, *, beside=0.0, width=1.0, seed=0):
    """Linear RGB of rays from the part of each (sub-)pixel ``width`` of it wide and so many of it beside its middle."""
    engine.start()
    # What knows the class of rays is loaded before another takes its place.
    from lippmann.rendering import methods  # noqa: F401
    from lippmann.rendering.transport import ray_source

    whole = ray_source.DisplayRays

    class PartRays(whole):
        def light_rays(self, column, row, channel, jitter):
            import drjit as dr
            import mitsuba as mi

            # Opaque to the compiler, so that all parts share a kernel.
            middle, share = (dr.opaque(mi.Float, value) for value in (0.5 + beside, width))
            jitter = mi.Point2f(middle + (jitter.x - 0.5) * share, jitter.y)
            return super().light_rays(column, row, channel, jitter)

    request = RenderRequest(
        integrator="direct",
        spp=samples,
        seed=seed,
        denoise="none",
        method="full",
        subpixels=len(set(display.panel.subpixel_offsets)) > 1,
        threads=1,
        exposure=exposure,
        tone_map="none",
    )
    ray_source.DisplayRays = PartRays
    try:
        return render_picture(scene, display, request).pixels.clip(0.0, 1.0)
    finally:
        ray_source.DisplayRays = whole
