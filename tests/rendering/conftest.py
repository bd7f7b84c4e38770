"""What tests of renderings share: a scene beside two long pictures that know nothing of each other, to judge others by.

The mean of (p - a)(p - b) is a picture's squared error, free of the noise of a and b.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from lippmann.color.transfer import encode_srgb
from lippmann.display import Display
from lippmann.metrics.mse_psnr import micro_image_means
from lippmann.options.placement import PlacementOptions

REFERENCE_SEEDS = 1001, 2002


@dataclass
class JudgedScene:
    """A scene, its references of ``full`` with so many samples, and the pictures that were made of it."""

    name: str
    scene: object
    display: Display
    reference_samples: int
    pictures: dict = field(default_factory=dict)

    def __post_init__(self):
        long = {"method": "full", "denoise": "none", "spp": self.reference_samples}
        self.references = [self.render(seed=seed, **long) for seed in REFERENCE_SEEDS]

    def render(self, seed=7, **options):
        import lippmann

        scale = self.display.size_mm[0] / 2
        return lippmann.render(
            self.scene,
            self.display,
            placement=PlacementOptions(place="display", scale=scale),
            seed=seed,
            **({"tone_map": "none"} | options),
        )

    def picture(self, samples, method="full", denoise="none", seed=7):
        """Made once."""
        key = samples, method, denoise, seed
        if key not in self.pictures:
            self.pictures[key] = self.render(spp=samples, method=method, denoise=denoise, seed=seed)
        return self.pictures[key]

    @property
    def mean(self):
        """The references together, linear."""
        return np.mean([reference.pixels for reference in self.references], axis=0)

    def errors(self, image):
        """Mean squared error, and that of the worst micro-image."""
        code = encode_srgb(image.pixels.astype(np.float64))
        first, second = (code - encode_srgb(reference.pixels.astype(np.float64)) for reference in self.references)
        product = (first * second).mean(axis=2)
        return product.mean(), np.nanmax(micro_image_means(product, self.display)[0])

    def psnr(self, image):
        """PSNR in dB, and that of the worst micro-image."""
        return tuple(float(-10 * np.log10(max(error, 1e-12))) for error in self.errors(image))

    def bias(self, image):
        """How far the mean of a picture's light is off, relative."""
        return float(image.pixels.mean(dtype=np.float64) / self.mean.mean(dtype=np.float64)) - 1


@pytest.fixture(scope="session")
def judged_scene(engine):
    """:class:`JudgedScene`."""
    return JudgedScene


@pytest.fixture
def as_denoised(monkeypatch):
    """Pictures stay as the denoiser and sharing leave them, however wrong they are."""
    monkeypatch.setattr(
        "lippmann.rendering.denoise.dual_buffer.weigh_samples", lambda *_, threads: np.zeros((1, 1, 1), np.float32)
    )
