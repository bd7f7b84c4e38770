"""Errors that go with the scene do not flicker, errors that each view has by itself do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.image import IntegralImage
from lippmann.metrics import compare, view_flicker


def of_views(display, error):
    """A grey reference and the same with ``error`` added to its views, ``(ny, nx, rows, columns, 3)``."""
    grey = np.full(np.shape(error), 0.5, np.float32)
    from lippmann.image import Provenance

    made = {"provenance": Provenance(transfer="linear")}
    return tuple(
        IntegralImage.from_views((grey + part).astype(np.float32), display, **made) for part in (np.zeros(()), error)
    )


def shape_of(display):
    return IntegralImage(np.zeros((display.panel.height, display.panel.width, 3)), display).views().shape


@pytest.mark.parametrize("kind", ["lenticular", "square"])
def test_a_blemish_that_all_views_share_does_not_flicker(display, kind):
    shown = display(kind)
    shape = shape_of(shown)
    blemish = np.random.default_rng(1).normal(0, 0.05, (1, 1, *shape[2:])) + np.zeros(shape)
    found = view_flicker(*of_views(shown, blemish))
    assert found.error == pytest.approx(np.square(blemish).mean(), rel=1e-3)
    assert found.share == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("kind", ["lenticular", "square"])
def test_noise_of_each_view_has_the_flicker_of_its_error(display, kind):
    shown = display(kind, 64, 64)
    noise = np.random.default_rng(2).normal(0, 0.05, shape_of(shown))
    reference, test = of_views(shown, noise)
    found = view_flicker(reference, test)
    assert found.share == pytest.approx(1, rel=0.05)
    assert found.psnr == pytest.approx(compare(reference, test).psnr, abs=0.3)


def test_neighbours_to_opposite_sides_are_the_worst(display):
    shown = display("lenticular")
    shape = shape_of(shown)
    wave = 0.1 * (-1.0) ** np.arange(shape[1])[None, :, None, None, None] + np.zeros(shape)
    found = view_flicker(*of_views(shown, wave))
    assert found.share == pytest.approx(2, rel=1e-5)
    assert found.psnr == pytest.approx(20 - 10 * math.log10(2), abs=1e-3)


def test_what_the_reference_itself_changes_by_is_no_flicker(display, picture):
    shown = display("square")
    codes = np.random.default_rng(3).uniform(0.2, 0.7, (32, 64, 3))
    found = view_flicker(picture(shown, codes), picture(shown, codes + 0.1))
    assert found.share == pytest.approx(0, abs=1e-5)
    assert found.error == pytest.approx(0.01, rel=1e-4)


@pytest.mark.slow
@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 2**31), kind=st.sampled_from(["lenticular", "slanted", "square", "hexagonal"]))
def test_the_share_lies_between_none_and_two(display, picture, seed, kind):
    random = np.random.default_rng(seed)
    shown = display(kind)
    found = view_flicker(*(picture(shown, random.uniform(0, 1, (32, 64, 3))) for _ in range(2)))
    assert 0 <= found.share <= 2


def test_equal_pictures_and_single_views(display, picture):
    image = picture(display("square"), 0.3)
    found = view_flicker(image, image)
    assert (found.share, found.psnr) == (0, math.inf)
    assert compare(image, image).to_dict()["flicker"] == {"psnr": None, "share": 0}
    from lippmann.display import Display, LensArray, Panel

    alone = picture(Display("alone", Panel(8, 8, 0.25), LensArray("square", 0.25), gap=6.8), 0.3)
    assert view_flicker(alone, alone) is None
    assert compare(alone, alone).to_dict()["flicker"] is None
