"""Indirect light with a limit: what it takes away, and what it leaves alone."""

from __future__ import annotations

import numpy as np
import pytest

import lippmann
from lippmann.display import load_display
from lippmann.errors import UsageError

pytestmark = pytest.mark.usefixtures("engine")

DISPLAY = load_display("seed-lenticular").resized(128, 32)


def rendered(scene="room", display=DISPLAY, **options):
    chosen = {"integrator": "path", "method": "full", "spp": 8, "seed": 2, "caustics": "paths"}
    return lippmann.render(scene, display, **(chosen | options))


@pytest.mark.long
def test_bright_hits_go_and_nothing_gets_brighter():
    plain, clamped = rendered(), rendered(clamp_indirect=0.5)
    assert (clamped.pixels <= plain.pixels + 1e-5).all()
    assert clamped.pixels.mean() < 0.999 * plain.pixels.mean()
    assert clamped.provenance.options["clamp_indirect"] == 0.5
    assert any("is cut off" in note for note in clamped.provenance.notes)
    assert "clamp_indirect" not in plain.provenance.options
    # Eight samples of at most eight surfaces each bring no more by other surfaces than the limit so often.
    direct = rendered(depth=1)
    assert (clamped.pixels - direct.pixels).max() < plain.pixels.max()


@pytest.mark.long
def test_a_limit_that_nothing_reaches_changes_nothing():
    np.testing.assert_array_equal(rendered(clamp_indirect=1e9).pixels, rendered().pixels)


@pytest.mark.long
def test_direct_light_is_never_clamped():
    plain, clamped = (rendered(depth=1, clamp_indirect=limit) for limit in (None, 1e-3))
    np.testing.assert_array_equal(plain.pixels, clamped.pixels)


@pytest.mark.slow
def test_the_limit_is_that_of_what_is_shown():
    """With an exposure of one stop light is twice as bright, and so is what is cut off."""
    ball = {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.9}}}
    sky = {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}}
    balls = {f"ball {x}": ball | {"center": [x, 0, 0], "radius": 0.5} for x in (-1, 0, 1)}
    scene = lippmann.load_scene({"type": "scene", "sky": sky, **balls})
    asked = {"scene": scene, "display": DISPLAY.resized(32, 16), "tone_map": "none"}
    plain, whole = (rendered(clamp_indirect=limit, exposure=0, **asked) for limit in (0.05, None))
    brighter = rendered(clamp_indirect=0.1, exposure=1, **asked)
    assert (plain.pixels < whole.pixels - 0.02).mean() > 0.1
    np.testing.assert_allclose(brighter.pixels, 2 * plain.pixels, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("limit", [0, -1.0, float("nan"), float("inf")])
def test_limits_that_mean_nothing_are_refused(limit):
    with pytest.raises(UsageError, match=r"clamp_indirect: .*; must be radiance above 0"):
        rendered(clamp_indirect=limit)


@pytest.mark.parametrize("integrator", ["direct", "classic", "normal"])
def test_other_light_has_nothing_to_clamp(integrator):
    with pytest.raises(UsageError, match="clamp_indirect"):
        rendered(integrator=integrator, clamp_indirect=1.0)
