"""What files say of a picture's light and its error."""

from __future__ import annotations

import pytest

from lippmann.rendering.estimate.psnr import Estimate
from lippmann.rendering.light_statements import light_notes, stated_error
from lippmann.rendering.request.render_request import RenderRequest

ESTIMATE = Estimate(40.0, 38.0, 43.0, 34.0, 30.0, 37.0, (3, 0))
AMONG_MIRRORS = {"caustics": "photons"}


@pytest.mark.parametrize(("samples", "low", "worst_low"), [(4, 33.0, 23.0), (8, 36.0, 25.0), (16, 38.0, 30.0)])
@pytest.mark.parametrize("caustics", ["photons", "none"])
def test_intervals_of_few_samples_among_mirrors_reach_down_farther(samples, low, worst_low, caustics):
    stated = stated_error(ESTIMATE, samples, {"caustics": caustics})
    assert stated == ESTIMATE.to_dict() | {"psnr_low": low, "worst_low": worst_low}
    notes = light_notes(RenderRequest(), ESTIMATE, samples, {"caustics": caustics})
    assert any("missed bright light among mirrors" in note for note in notes) == (samples < 16)


def test_no_psnr_is_below_nothing():
    poor = Estimate(5.0, 3.0, 6.0, 4.0, 2.0, 5.0, (0, 0))
    stated = stated_error(poor, 2, AMONG_MIRRORS)
    assert stated is not None
    assert (stated["psnr_low"], stated["worst_low"]) == (0.0, 0.0)


def test_elsewhere_they_are_as_estimated():
    assert stated_error(ESTIMATE, 2, {}) == ESTIMATE.to_dict()
    assert light_notes(RenderRequest(), ESTIMATE, 2, {}) == ()
    assert stated_error(None, 2, AMONG_MIRRORS) is None
    assert light_notes(RenderRequest(), None, 2, AMONG_MIRRORS) == ()


def test_without_caustics_that_are_there_nothing_is_stated():
    left = {"caustics": "paths"}
    assert stated_error(ESTIMATE, 64, left) is None
    (note,) = light_notes(RenderRequest(), None, 64, left)
    assert "no estimate of the error" in note


def test_exposure_and_cut_light_are_told():
    request = RenderRequest(exposure="auto", clamp_indirect=2.5)
    exposed, cut = light_notes(request, ESTIMATE, 64, {"exposure": 1.5})
    assert "+1.50 EV" in exposed
    assert "above 2.5" in cut
