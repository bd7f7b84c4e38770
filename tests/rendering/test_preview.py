"""Plain pictures of a scene's camera."""

from __future__ import annotations

import numpy as np
import pytest

import lippmann
from lippmann.errors import UsageError

pytestmark = pytest.mark.usefixtures("engine")


@pytest.mark.slow
def test_noise_is_taken_out_unless_it_is_asked_for():
    def shown(**options):
        return lippmann.preview("teapot", size=(64, 64), **options)

    many = shown(spp=96, denoise="none").pixels
    noisy, clean = shown(spp=4, seed=3, denoise="none"), shown(spp=4, seed=3)
    assert "denoise" not in noisy.provenance.options
    assert clean.provenance.options["denoise_effort"] == "fast"
    assert clean.provenance.seconds["denoise"] > 0
    assert np.mean((clean.pixels - many) ** 2) < 0.5 * np.mean((noisy.pixels - many) ** 2)


def test_a_display_shows_what_its_whole_picture_shows_to_the_eye():
    small = lippmann.load_display("seed-lenticular").resized(96, 64)
    exact = {"integrator": "albedo", "spp": 1, "pixel_filter": "point", "placement": {"turn": 20}}
    eye = (30.0, 0.0, 600.0)
    made = lippmann.preview("teapot", small, size=(48, 48), eye=eye, **exact)
    shown = made.pixels
    assert repr(made) == "<Preview 48 x 32 pixels>"
    assert made._repr_png_().startswith(b"\x89PNG")
    replayed = lippmann.render("teapot", small, method="full", **exact).replay(eye, size=(48, 32), filter="nearest")
    assert shown.shape == (32, 48, 3)
    assert (np.abs(shown - replayed).max(axis=2) > 1e-4).mean() < 0.02
    assert replayed.std() > 0.05
    assert np.abs(shown - lippmann.preview("teapot", small, size=(48, 48), **exact).pixels).max() > 0.1


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"eye": (0.0, 0.0, 500.0)}, "eye: there is no display"),
        ({"placement": {"turn": 20}}, "placement: there is no display"),
        ({"display": "seed-lenticular", "camera": "main"}, "camera: a display stands before it"),
        ({"display": "seed-lenticular", "eye": (0.0, 0.0, -5.0)}, "in front of the lens plane"),
    ],
)
def test_what_does_not_go_together_is_refused(options, what):
    with pytest.raises(UsageError, match=what):
        lippmann.preview("teapot", size=(16, 16), **options)
