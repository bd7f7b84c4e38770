"""An experiment without an engine: pictures, times and ray counts that the test knows."""

from __future__ import annotations

import zlib

import numpy as np
import pytest

from lippmann.display import load_display
from lippmann.image import IntegralImage, Provenance
from lippmann.reproduce import Experiment, run_experiment

#: Seconds of tracing, seconds of reusing, share of the pixels traced, error of the reprojected ones (coded).
COSTS = {
    "full": (2.0, 0.0, 1.0, 0.0),
    "lens-view-paper": (0.6, 0.4, 0.25, 0.02),
    "interpolated-paper": (0.4, 0.4, 0.2, 0.03),
    "lens-view-default": (0.5, 0.1, 0.2, 0.02),
    "interpolated-default": (0.4, 0.1, 0.15, 0.03),
    "lens-view-gloss": (0.9, 0.2, 0.3, 0.01),
    "interpolated-gloss": (0.8, 0.2, 0.25, 0.012),
}


class FakeRenderer:
    """Renders noise on a gradient; the micro-image on the left is always without error."""

    def __init__(self, display, base=None):
        self.display = display
        self.base = base
        self.calls = []

    def __call__(self, scene, variant):
        self.calls.append((scene, variant.key))
        panel = self.display.panel
        size = panel.height, panel.width
        trace, reuse, traced, error = COSTS[variant.key]
        generator = np.random.default_rng(zlib.crc32(f"{scene}/{variant.key}".encode()))
        status = np.where(generator.uniform(size=size) < traced, 0, 1)
        status[:, :8] = 0
        if variant.method == "interpolated":
            status[:, 8:][generator.uniform(size=size)[:, 8:] > 0.95] = 2
        pixels = (
            np.linspace(0.1, 0.9, panel.width)[None, :, None] * np.ones((*size, 3)) if self.base is None else self.base
        )
        pixels = np.where(status[..., None] > 0, pixels + generator.normal(0, error, (*size, 3)), pixels)
        primary = panel.width * panel.height
        provenance = Provenance(
            method=variant.method,
            integrator="classic",
            depth=2,
            spp=1,
            scene=scene,
            version="1.2.3",
            device="a <test> device",
            traced_fraction=traced,
            rays={"primary": int(primary * traced), "shadow": int(2 * primary * traced), "secondary": 0},
            seconds={"load": 9.0, "build": 9.0, "compile": 9.0, "trace": trace, "reuse": reuse, "total": 30.0},
            transfer="linear",
        )
        maps = {} if variant.manner is None else {"status": status.astype(np.float32)}
        return IntegralImage(pixels, self.display, provenance=provenance, maps=maps)


@pytest.fixture(scope="session")
def fake_renderer():
    return FakeRenderer


@pytest.fixture(scope="session")
def small_display():
    """The paper's display, cut down to sixteen lenses."""
    return load_display("seed-lenticular").resized(128, 48)


@pytest.fixture(scope="session")
def results(small_display):
    experiment = Experiment(("teapot", "tree"), small_display, runs=1, warm_up=0)
    return run_experiment(experiment, FakeRenderer(small_display))
