"""What is said of the depth of a scene that two eyes look at."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lippmann.display import load_display
from lippmann.display.stereo import depth_of_disparity
from lippmann.scene.placement import FUSED, comfort_in_words, fusion_warning

MONITOR, PANEL = load_display("odyssey-3d"), load_display("portrait")


# From 600 mm with eyes 63 mm apart: 1 degree is 85.8 mm in front and 119.9 behind, 1.84 degrees are 141 mm in front,
# 2.04 degrees 309 behind.
@pytest.mark.parametrize(
    ("back", "front", "verdict", "is_double"),
    [
        (-119.9, 85.7, "comfortable", False),
        (-120.1, 0, "strains", False),
        (0, 85.9, "strains", False),
        (-305, 140, "strains", False),
        (-315, 0, "too much to fuse", True),
        (0, 142, "too much to fuse", True),
    ],
)
def test_verdicts(back, front, verdict, is_double):
    assert comfort_in_words(MONITOR, back, front).startswith(f"{verdict}: ")
    assert bool(fusion_warning(MONITOR, back, front)) == is_double


@pytest.mark.parametrize("beyond", [-1e-5, 0.0, 5e-7, 1e-5])
def test_verdict_and_warning_agree_at_the_limit(beyond):
    near, far = depth_of_disparity(*FUSED, MONITOR.viewing_distance, 63.0)
    for back, front in [(0.0, near + beyond), (far - beyond, 0.0)]:
        is_double = fusion_warning(MONITOR, back, front) != ""
        assert comfort_in_words(MONITOR, back, front).startswith("too much to fuse") == is_double


def test_a_panel_is_judged_from_its_own_distance():
    assert comfort_in_words(PANEL, -50, 50).startswith(
        "comfortable: disparity from -0.39 degrees at the back to 0.46 at the front"
    )
    assert "from 654 mm" in comfort_in_words(PANEL, -50, 50)
    assert fusion_warning(PANEL, -50, 50) == ""
    warning = fusion_warning(PANEL, -600, 50)
    assert warning.startswith("the scene reaches from -600 to 50 mm; from 654 mm away most eyes fuse -384 to 164")
    assert "\n" not in warning


def test_from_far_away_only_the_front_is_too_much():
    wall = load_display("portrait").resized(768, 1024)
    far = replace(wall, viewing_distance=3000.0)
    assert "most eyes fuse all up to 1" in fusion_warning(far, -1e5, 2000)
    assert fusion_warning(far, -1e5, 50) == ""


def test_nothing_is_said_without_a_viewing_distance():
    endless = load_display("seed-lenticular")
    assert comfort_in_words(endless, -5000, 50) == fusion_warning(endless, -5000, 50) == ""
