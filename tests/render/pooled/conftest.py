"""Small displays in front of small scenes."""

from __future__ import annotations

import numpy as np
import pytest


@pytest.fixture
def lens_display():
    from lippmann.display import load_display

    return load_display("seed-lenticular").resized(128, 32)


@pytest.fixture
def make_pooled(engine, lens_display):
    """``make(scene dict, ...)`` gives a pooled renderer, and the full renderer's picture as a function of samples."""
    import mitsuba as mi

    from lippmann.render.full import trace_frame
    from lippmann.render.integrators.path import PathIntegrator
    from lippmann.render.plan import make_plan
    from lippmann.render.pooled.renderer import Pooled
    from lippmann.render.rays import DisplayRays
    from lippmann.render.traits import make_traits

    def make(parts, depth=4, seed=0, has_null=False, subpixels=False, **options):
        scene = mi.load_dict({"type": "scene"} | parts)
        placed = np.diag([0.1, 0.1, 0.1, 1.0])
        source = DisplayRays(lens_display, placed, subpixels)
        traits = make_traits(scene, has_null=has_null)
        pooled = Pooled(scene, traits, depth, source, seed=seed, **options)

        def full(samples, seed=77):
            channels = 3 if subpixels else 1
            plan = make_plan(source.width, source.height, samples, channels=channels, memory=2**31)
            return trace_frame(PathIntegrator(scene, traits, depth), source, plan, seed=seed).pixels

        return pooled, full

    return make
