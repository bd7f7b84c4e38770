"""What files say of a picture's light and its error."""

from __future__ import annotations

import pytest

from lippmann.rendering.estimate.psnr import Estimate
from lippmann.rendering.provenance import describe_estimate, describe_light
from lippmann.rendering.request.render_request import RenderRequest

ESTIMATE = Estimate(40.0, 38.0, 43.0, 34.0, 30.0, 37.0, (3, 0))
AMONG_MIRRORS = {"caustics": "photons"}


@pytest.mark.parametrize(("samples", "is_few"), [(4, True), (8, True), (16, False)])
@pytest.mark.parametrize("caustics", ["photons", "none"])
def test_few_samples_among_mirrors_are_told(samples, is_few, caustics):
    notes = describe_light(RenderRequest(), ESTIMATE, samples, {"caustics": caustics})
    assert any("missed bright light among mirrors" in note for note in notes) == is_few


def test_elsewhere_they_are_as_estimated():
    assert describe_estimate(ESTIMATE, {}) == ESTIMATE.to_dict()
    assert describe_light(RenderRequest(), ESTIMATE, 2, {}) == ()
    assert describe_estimate(None, AMONG_MIRRORS) is None
    assert describe_light(RenderRequest(), None, 2, AMONG_MIRRORS) == ()


def test_without_caustics_that_are_there_nothing_is_stated():
    left = {"caustics": "paths"}
    assert describe_estimate(ESTIMATE, left) is None
    (note,) = describe_light(RenderRequest(), None, 64, left)
    assert "no estimate of the error" in note


def test_exposure_and_cut_light_are_told():
    request = RenderRequest(exposure="auto", clamp_indirect=2.5)
    exposed, cut = describe_light(request, ESTIMATE, 64, {"exposure": 1.5})
    assert "+1.50 EV" in exposed
    assert "above 2.5" in cut
