"""Long plain renderings of pixels of one picture, made by the checkout that is judged: placements differ between them.

Time on two cores: an estimated minute a picture.

python benchmarks/defaults_reference.py SCENE DISPLAY PIXELS SAMPLES FILE

``defaults.py`` runs it with the checkout's own source. Light at an exposure of 0, twice with ``SAMPLES`` each.
"""

from __future__ import annotations

import sys

import numpy as np

import lippmann
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import open_session

try:
    from lippmann.rendering.request.plan import resolve
except ImportError:  # of earlier checkouts
    from lippmann.rendering.request.resolve import resolve


def main() -> None:
    scene_name, display_name, pixels, samples, file = sys.argv[1:]
    scene, display = lippmann.load_scene(scene_name), lippmann.load_display(display_name)
    request = RenderRequest(method="full", spp=int(samples), exposure=0.0, caustics="paths")
    request = resolve(request, scene, display)
    session = open_session(scene, request)
    # Mitsuba may be loaded now that the engine has chosen its libraries.
    from lippmann.rendering.transport.ray_source import DisplayRays
    from reference_pixels import trace_pixels

    placement = session.place(display)
    source = DisplayRays(display, placement.world_from_display, bool(request.subpixels))
    integrator = session.integrator(source, placement.display_from_world)
    random = np.random.default_rng(5)
    columns, rows = (random.integers(0, side, int(pixels)) for side in (display.panel.width, display.panel.height))
    halves = [trace_pixels(session, source, integrator, columns, rows, int(samples), seed) for seed in (991, 992)]
    np.savez(file, columns=columns, rows=rows, halves=np.stack(halves))


if __name__ == "__main__":
    main()
