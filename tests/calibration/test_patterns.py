"""Test patterns: what they are by the formula, and that they stand still on a display with the right values only."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.calibration import NAMES, Pattern, draw, fields, whole
from lippmann.calibration.patterns import COLORS, LIT, step_of
from lippmann.display import Panel
from lippmann.display.formats.monitor import Monitor
from lippmann.display.panel import PixelWindow
from lippmann.errors import UsageError
from lippmann.image import IntegralImage, Provenance
from lippmann.viewing.replay import replay

#: Some 12 pixels to a lens, so that each of three views has four pixels of its own.
MONITOR = Monitor("small", Panel(480, 264, 0.3), pitch=7.1, slope=-4.7, center=0.31, viewing_distance=700.0)
#: Where the eye is at the middle of each of three views.
EYES = [(side * 700 * math.tan(math.radians(35 / 2)) * 2 / 3, 0.0, 700.0) for side in (-1, 0, 1)]


def by_formula(pattern, monitor, i, j, c):
    """The value of one sub-pixel, transcribed from the words at the top of the module."""
    panel = monitor.panel
    W, H, dpi = panel.width, panel.height, 25.4 / panel.pixel_pitch
    right, down = panel.subpixel_offsets[c]

    def rates(pitch, lean):
        a = pitch / dpi * math.cos(math.atan(lean))
        return a, a * lean

    lean = 1 / monitor.slope
    A, B = rates(monitor.pitch, lean)
    u, w = i + 0.5 + right, H - j - 0.5 - down
    if pattern.name == "stripes":
        v = 1 - (u * A + w * B - monitor.center) % 1
        return COLORS[min(int(v * pattern.views), pattern.views - 1) % len(COLORS)][c]
    n, step = pattern.fields, step_of(pattern, monitor)
    place, size = (i, W) if pattern.name == "slope" else (j, H)
    k = next(k for k in range(n) if k * size // n <= place < (k + 1) * size // n)
    s, middle = k - (n - 1) / 2, (k * size // n + (k + 1) * size // n) / 2
    u0, w0 = (middle, H / 2) if pattern.name == "slope" else (W / 2, H - middle)
    if pattern.name == "center":
        phase = u * A + w * B - (monitor.center + s * step)
    else:
        is_pitch = pattern.name == "pitch"
        A_k, B_k = rates(monitor.pitch + s * step, lean) if is_pitch else rates(monitor.pitch, lean + s * step)
        phase = u0 * A + w0 * B - monitor.center + (u - u0) * A_k + (w - w0) * B_k
    return float(abs(phase % 1 - 0.5) < LIT[pattern.name])


@pytest.mark.parametrize("slope", [-4.7, 5.2, math.inf])
@pytest.mark.parametrize("name", NAMES)
def test_every_subpixel_follows_the_formula(name, slope):
    monitor = replace(
        MONITOR, slope=slope, panel=replace(MONITOR.panel, subpixel_offsets=((0.3, 0.1), (0, 0), (-0.3, 0)))
    )
    pattern = Pattern(name, views=5, fields=7)
    pixels = draw(pattern, monitor)
    rng = np.random.default_rng(5)
    for i, j, c in zip(*(rng.integers(0, top, 400).tolist() for top in (480, 264, 3)), strict=True):
        assert pixels[j, i, c] == by_formula(pattern, monitor, i, j, c), (i, j, c)


@given(
    name=st.sampled_from(NAMES),
    window=st.builds(PixelWindow, st.integers(0, 400), st.integers(0, 200), st.integers(1, 80), st.integers(1, 64)),
    count=st.integers(2, 30),
)
@settings(deadline=None, max_examples=40)
def test_windows_are_cut_from_the_whole(name, window, count):
    pattern = Pattern(name, views=count, fields=count)
    every = draw(pattern, MONITOR)
    part = every[window.top : window.top + window.height, window.left : window.left + window.width]
    np.testing.assert_array_equal(draw(pattern, MONITOR, window), part)
    assert whole(MONITOR) == PixelWindow(0, 0, 480, 264)


def test_a_wide_panel_is_drawn_in_windows_without_the_rest():
    monitor = replace(MONITOR, panel=Panel(900_000, 600_000, 25.4 / 1200), pitch=75.0)
    window = PixelWindow(899_900, 599_900, 100, 100)
    for name in NAMES:
        assert draw(Pattern(name), monitor, window).shape == (100, 100, 3)


# ---- What an eye sees ----------------------------------------------------------------------------------------------


def seen(pixels, eye, monitor=MONITOR):
    """The panel as an eye sees it through the lenses of the display, but for the lenses that its edges cut."""
    image = IntegralImage(pixels, monitor.display(), provenance=Provenance(subpixels=True))
    return replay(image, eye, size=(480, 264))[14:-14, 14:-14]


def test_stripes_stand_still_at_the_right_values():
    """From each of three places the whole panel has one colour."""
    pixels = draw(Pattern("stripes", views=3), MONITOR)
    for view, eye in enumerate(EYES):
        assert (seen(pixels, eye) == COLORS[view]).all(), view


@pytest.mark.parametrize("display", ["pitch", "slope"])
def test_stripes_stand_on_the_panel_and_wander_at_wrong_values(display):
    """A pitch (slope) that is off by a lens over the panel's width (height) shows every colour once."""
    lean = 1 / MONITOR.slope
    wrong = {
        "pitch": replace(MONITOR, pitch=MONITOR.pitch * (1 + 1 / (480 * MONITOR.lenses_right))),
        "slope": replace(MONITOR, slope=1 / (lean + 1 / (264 * MONITOR.lenses_right))),
    }[display]
    pixels = draw(Pattern("stripes", views=3), wrong)
    along = []
    for eye in EYES:
        picture = seen(pixels, eye)
        # Across the stripes: along the middle row, or the middle column.
        colors = picture[118] if display == "pitch" else picture[:, 226]
        shares = [(picture == color).all(axis=2).mean() for color in COLORS[:3]]
        assert min(shares) > 0.2, "all three colours are seen at once"
        along.append(np.argmax(colors, axis=1))
    # The eye's next place shows the stripes a third of the panel further.
    for first, second in ((0, 1), (1, 2)):
        shifts = range(-len(along[0]) // 2, len(along[0]) // 2)
        best = max(shifts, key=lambda shift: np.mean(np.roll(along[first], shift) == along[second]))
        assert abs(abs(best) / (480 if display == "pitch" else 264) - 1 / 3) < 0.06


@pytest.mark.slow
def test_a_wrong_centre_shifts_all_at_once():
    pixels = draw(Pattern("stripes", views=3), replace(MONITOR, center=MONITOR.center + 1 / 3))
    # A larger centre: a smaller place under the lens, the view further right.
    assert [COLORS.index(tuple(seen(pixels, eye)[0, 0].astype(int))) for eye in EYES] == [1, 2, 0]
    assert all(len(np.unique(seen(pixels, eye).reshape(-1, 3), axis=0)) == 1 for eye in EYES)


def test_a_wrong_order_of_subpixels_fringes():
    swapped = replace(MONITOR.panel, subpixel_offsets=tuple(reversed(MONITOR.panel.subpixel_offsets)))
    # An eye at the edge between two views sees red where it should see green: the edges lie elsewhere for each colour.
    edge = (EYES[1][0] + EYES[0][0]) / 2, 0.0, 700.0
    right, wrong = (draw(Pattern("stripes", views=3), replace(MONITOR, panel=p)) for p in (MONITOR.panel, swapped))
    assert (right != wrong).mean() > 0.05
    assert (seen(right, edge) != seen(wrong, edge)).any(axis=2).mean() > 0.2


def lit_shares(pattern, eye):
    """How much of each field an eye sees lit, but for the field's rim."""
    picture = np.pad(seen(draw(pattern, MONITOR), eye), ((14, 14), (14, 14), (0, 0)), constant_values=np.nan)
    shares = []
    for field in fields(pattern, MONITOR):
        left, top, width, height = (getattr(field.window, name) for name in ("left", "top", "width", "height"))
        shares.append(np.nanmean(picture[max(14, top + 4) : top + height - 4, left + 8 : left + width - 8]))
    return np.array(shares)


@pytest.mark.parametrize("name", ["pitch", "slope"])
def test_the_right_field_changes_all_at_once(name):
    """Fields about values that are right in the middle: of all only that one is always wholly lit or wholly dark."""
    pattern = Pattern(name, fields=7)
    made = fields(pattern, MONITOR)
    assert made[3].value == pytest.approx(getattr(MONITOR, name))
    half = 700 * math.tan(math.radians(35 / 2))
    mixed = np.zeros(7)
    for part in (-0.9, -0.7, -0.3, -0.1, 0.1, 0.3, 0.7, 0.9):
        shares = lit_shares(pattern, (part * half, 0.0, 700.0))
        mixed = np.maximum(mixed, np.minimum(shares, 1 - shares))
    assert mixed[3] < 0.01
    assert np.delete(mixed, 3).min() > 0.1


def test_the_field_with_the_right_centre_is_lit_in_the_middle():
    pattern = Pattern("center", fields=11)
    lit = lit_shares(pattern, (0.0, 0.0, 700.0))
    assert lit[5] == 1
    assert max(*lit[:4], *lit[7:]) == 0


# ---- What can be asked for -----------------------------------------------------------------------------------------


def test_fields_share_the_panel_and_surround_the_value():
    for name in ("pitch", "slope", "center"):
        made = fields(Pattern(name, fields=11), MONITOR)
        assert sum(field.window.width * field.window.height for field in made) == 480 * 264
        assert made[5].value == pytest.approx(getattr(MONITOR, name))
        assert float(made[5].text) == pytest.approx(getattr(MONITOR, name), abs=1e-3)
    assert [field.value for field in fields(Pattern("pitch", fields=3, step=0.5), MONITOR)] == [6.6, 7.1, 7.6]
    leans = [1 / field.value for field in fields(Pattern("slope", fields=3, step=0.01), MONITOR)]
    assert np.diff(leans) == pytest.approx(0.01)


def test_upright_lenses_have_slopes_on_both_sides():
    values = [field.value for field in fields(Pattern("slope", fields=3), replace(MONITOR, slope=math.inf))]
    assert values[0] < 0 < values[2]
    assert values[1] == math.inf


def test_steps_are_round_and_half_a_lens_at_most():
    for width in (200, 480, 5000):
        monitor = replace(MONITOR, panel=replace(MONITOR.panel, width=width))
        step = step_of(Pattern("pitch"), monitor)
        lenses = step / monitor.pitch * width * monitor.lenses_right
        assert 0.2 <= lenses <= 0.5 + 1e-9
        assert f"{step:.0e}"[0] in "125"


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"name": "moire"}, "unknown pattern 'moire'; known are stripes, pitch, slope, center"),
        ({"name": "stripes", "views": 1}, "views: 1 is out of range"),
        ({"name": "pitch", "fields": 0}, "fields: 0 is out of range"),
        ({"name": "pitch", "step": 0.0}, "step: 0 is out of range"),
        ({"name": "pitch", "step": -1.0}, "step: -1 is out of range"),
        ({"name": "pitch", "step": math.nan}, "step: nan is out of range"),
        ({"name": "pitch", "step": 2.0}, "a field is out of range: pitch is -2.9"),
        ({"name": "slope", "step": 5.0}, "a field is out of range: slope is"),
    ],
)
def test_nonsense_is_refused(asked, said):
    with pytest.raises(UsageError) as caught:
        draw(Pattern(**asked), MONITOR)
    assert said in str(caught.value)


def test_more_fields_than_pixels_are_refused():
    with pytest.raises(UsageError, match="the panel has 20 pixels in that direction"):
        fields(Pattern("pitch", fields=21), replace(MONITOR, panel=replace(MONITOR.panel, height=20)))
