"""What a picture lacks of a goal, by its estimate."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from lippmann.api import load_scene
from lippmann.display import Display
from lippmann.display.lens_array import LensArray
from lippmann.display.panel import Panel
from lippmann.rendering.adaptive.goal import Goal, goal_of
from lippmann.rendering.adaptive.tuning import TUNING
from lippmann.rendering.estimate.psnr import Estimate
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest

SHOWN = Display("test", Panel(64, 64, 0.25), LensArray("square", 2.0), gap=6.8)


def test_missing_is_by_the_likely_value_and_by_the_low_end():
    wide = Estimate(45, 44, 46, 41.0, 38.0, 43.0, (0, 0))
    assert Goal(quality_worst=40).missing(wide) == pytest.approx(1.0)
    narrow = Estimate(45, 44.9, 45.1, 41.0, 40.8, 41.2, (0, 0))
    assert Goal(quality_worst=42).missing(narrow) == pytest.approx(1.0)
    assert Goal(quality=44).missing(wide) <= 0


def test_a_quality_of_the_whole_asks_for_micro_images_too():
    estimate = Estimate(38.0, 37.0, 39.0, 26.0, 25.0, 27.0, (0, 0))
    assert Goal(quality=35).missing(estimate) == pytest.approx(-3)
    # The worst micro-image may have 12 dB less than the whole.
    assert Goal(quality=39).missing(estimate) == pytest.approx(1)
    assert Goal(quality=38).missing(replace(estimate, worst=25.5)) == pytest.approx(0.5)


def test_a_default_picture_is_to_be_clean_by_the_likely_value():
    request = RenderRequest(method="pooled", denoise="oidn", spp=8)
    assert goal_of(request) == Goal(spp=8)
    with_reserve = resolve(RenderRequest(), load_scene("teapot"), SHOWN)
    goal = goal_of(with_reserve)
    assert goal == Goal(TUNING.clean, TUNING.clean_worst, spp=with_reserve.spp_reserve, is_promise=False)
    wide = Estimate(TUNING.clean, 20.0, 50.0, TUNING.clean_worst, 5.0, 40.0, (0, 0))
    assert goal.missing(wide) == 0
    # However good the picture is as a whole.
    assert goal.missing(replace(wide, psnr=50.0, worst=TUNING.clean_worst - 2)) == pytest.approx(2)


def test_without_a_quality_nothing_is_missing():
    assert Goal(spp=8).missing(Estimate(5.0, 4.0, 6.0, 1.0, 0.0, 2.0, (0, 0))) == -math.inf
