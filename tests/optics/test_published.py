"""Published figures and other people's formulas against ours: the table of docs/background/optics.md."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lippmann.display import Display, load_display
from lippmann.display.formats.print_sheet import TYPICAL_SHEETS
from lippmann.display.lens_array import LensArray
from lippmann.display.lens_profile import LensProfile
from lippmann.display.panel import Panel
from lippmann.optics.first_order import extreme_ray_field, rule_of_depth
from lippmann.optics.fitting import fit_profile, gap_of
from lippmann.optics.lens import Lens
from lippmann.optics.light_table import light_table
from lippmann.optics.moire import wave_period
from lippmann.optics.pixel_profile import kernel, pixel_trapezoid, width_at_half_height
from lippmann.optics.trace import trace
from lippmann.optics.zone import ViewingZone


def lens_of(name):
    sheet = TYPICAL_SHEETS[name]
    return Lens(LensProfile(sheet.radius, sheet.thickness, sheet.index), LensArray("lenticular", 25.4 / sheet.lpi))


# ---- The worked example of the encyclopaedia's article on lenticular lenses ------------------------------------------


def test_the_encyclopaedias_example():
    profile = LensProfile(0.1905, 0.457, 1.557)
    assert 64.4 <= extreme_ray_field(profile, 0.33665) <= 64.6
    # Its focal length counts from the principal plane: R / (n - 1), and t / n less of it from the back.
    from_principal_plane = profile.radius / (profile.index - 1)
    assert from_principal_plane == pytest.approx(0.342, abs=5e-4)
    assert from_principal_plane - profile.thickness / profile.index == pytest.approx(0.048, abs=1e-3)


# ---- Johnson and Jacobsen, Proc. SPIE 5874-06 (2005): an ellipse without spherical aberration -----------------------


@pytest.mark.parametrize("index", [1.49, 1.57, 1.64])
@pytest.mark.parametrize("layout", ["lenticular", "square", "hexagonal"])
def test_an_ellipse_focuses_to_a_point(index, layout):
    thickness = 0.66
    lens = Lens(
        LensProfile(thickness * (index - 1) / index, thickness, index, conic=-1 / index**2), LensArray(layout, 0.3)
    )
    rays = trace(lens, *lens.samples(101 if lens.is_cylinder else 21), 0.0)
    assert np.abs(rays.x).max() < 1e-12
    assert np.abs(rays.y).max() < 1e-12


# ---- Eight typical sheets --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "half_over_radius", "focus", "pinhole", "field", "gap", "width"),
    [
        ("18lpi", 0.57, 0.909, 40.6, 43.5, 0.951, 24),
        ("25lpi", 0.30, 0.848, 23.2, 26.7, 0.983, 9),
        ("32lpi", 0.33, 0.970, 22.5, 23.1, 0.984, 73),
        ("42lpi", 0.39, 0.947, 26.8, 28.1, 0.978, 37),
        ("50lpi", 0.94, 0.846, 70.4, 75.8, 0.853, 17),
        ("75lpi", 0.74, 0.901, 55.3, 59.0, 0.915, 27),
        ("100lpi", 0.85, 1.061, 54.0, 43.8, 0.946, 6),
        ("161lpi", 0.79, 0.959, 55.4, 54.5, 0.922, 25),
    ],
)
def test_eight_sheets(name, half_over_radius, focus, pinhole, field, gap, width):
    lens = lens_of(name)
    profile, pitch = lens.profile, lens.pitch
    air = profile.thickness / profile.index
    assert pitch / (2 * profile.radius) == pytest.approx(half_over_radius, abs=0.006)
    paraxial_focus = profile.index * profile.radius / (profile.index - 1)
    assert profile.thickness / paraxial_focus == pytest.approx(focus, rel=0.002)
    assert math.degrees(2 * math.atan(0.5 * pitch / air)) == pytest.approx(pinhole, rel=0.01)
    assert extreme_ray_field(profile, pitch) == pytest.approx(field, rel=0.01)
    assert gap_of(profile, lens.array) / air == pytest.approx(gap, rel=0.01)
    # Given to whole numbers: within half of one, and one part in a hundred.
    finely = light_table(lens, 0.0, places_per_lens=2000, neighbours=0)
    assert pitch / finely.widths(0.8)[0] == pytest.approx(width, abs=0.5 + 0.01 * width)


@pytest.mark.parametrize(
    ("strips", "shares"),
    [
        (6, (0.12, 0, 0)),
        (8, (0.18, 0, 0)),
        (12, (0.26, 0.01, 0.20)),
        (16, (0.32, 0.04, 0.56)),
        (24, (0.39, 0.08, 0.74)),
    ],
)
def test_light_from_other_strips(strips, shares):
    """60 lenses per inch, 26 mil, index 1.57: the crest of paraxial focus, and 10 and 20 % flatter ones."""
    pitch, thickness = 25.4 / 60, 0.6604
    for factor, share in zip((1.0, 1.1, 1.2), shares, strict=True):
        profile = LensProfile(factor * thickness * 0.57 / 1.57, thickness)
        table = light_table(Lens(profile, LensArray("lenticular", pitch)), 0.0, places_per_lens=24 * 40)
        own = np.abs(table.places) < 0.5 * pitch / strips
        assert 1 - table.shares[0][own].sum() / table.light[0] == pytest.approx(share, abs=0.006)


# ---- US patent 6 726 858: thickness and radius that suit a number of strips ------------------------------------------


@pytest.mark.parametrize("strips", [8, 12, 16, 24])
@pytest.mark.parametrize("thickness", [0.4064, 0.6604])
def test_the_best_focus_is_the_patents(strips, thickness):
    """The crest that we find best for a thickness has a thickness by the patent's formula within its own 15 %."""
    profile = fit_profile(LensArray("lenticular", 0.6 * thickness), thickness=thickness)
    of_patent = (profile.index * strips - 1) * profile.radius / (strips * (profile.index - 1))
    assert of_patent == pytest.approx(thickness, rel=0.15)


# ---- The trade's rule of depth --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TYPICAL_SHEETS)
def test_depth_is_of_the_order_of_the_rule(name):
    """Ours, N g on both sides, with the gap of the true lens; theirs, 2 N t / n in all."""
    lens, strips = lens_of(name), 12
    ours = 2 * strips * gap_of(lens.profile, lens.array)
    assert 0.8 < ours / rule_of_depth(lens.profile, strips) < 1.0


# ---- A slanted sub-pixel ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("slant", [-20.0, 0.0, 9.46, 30.0, 60.0])
def test_a_slanted_sub_pixel_is_a_trapezoid(slant):
    panel = load_display("panel-4k")
    display = replace(panel, lens_array=replace(panel.lens_array, slant=slant))
    width, height, s = display.panel.pixel_pitch / 3, display.panel.pixel_pitch, math.radians(abs(slant))
    shape = pixel_trapezoid(display)
    assert shape.base == pytest.approx((width + height * math.tan(s)) * math.cos(s), rel=1e-12)
    assert shape.half_height == pytest.approx(max(width, height * math.tan(s)) * math.cos(s), rel=1e-12)
    # By points of the rectangle: their distances across the lens.
    x, y = (a.ravel() for a in np.meshgrid(*[(np.arange(1000) + 0.5) / 1000 - 0.5] * 2))
    across = x * width * math.cos(s) - y * height * math.sin(s)
    edges = np.linspace(-0.6, 0.6, 37) * shape.base
    counted = np.histogram(across, edges)[0] / len(across)
    assert shape.shares(edges) == pytest.approx(counted, abs=2e-3)
    assert shape.shares(edges).sum() == pytest.approx(1, abs=1e-12)


def test_the_independent_directions_of_a_slanted_panel():
    """6.2 pixels a lens, slant 9.46 degrees, sub-pixels of 1/3 x 1: base .493, half height .329, 18.6 directions."""
    lenses = LensArray("lenticular", 6.2 * math.cos(math.radians(9.46)), 9.46)
    display = Display("slanted", Panel(620, 400, 1.0), lenses, gap=15.0)
    shape = pixel_trapezoid(display)
    assert shape.base == pytest.approx(0.493, abs=5e-4)
    assert shape.half_height == pytest.approx(0.329, abs=5e-4)
    assert display.micro_image_pitch / shape.half_height == pytest.approx(18.6, abs=0.05)
    step = 0.002
    assert width_at_half_height(kernel(shape, 0.0, step), step) == pytest.approx(shape.half_height, abs=step / 2)


# ---- Moire (Saveljev and Kim) ----------------------------------------------------------------------------------------


def sheet_on(pixel, slant):
    return Display("moire", Panel(900, 900, pixel), LensArray("lenticular", 0.508, slant), 1.0)


def seen_period(display, order, count=256):
    """Period of a wave of the panel in the picture that the lenses make of it, by a Fourier transform of it."""
    lattice, panel = display.lattice, display.panel
    i, v = np.meshgrid(np.arange(count), np.arange(count) * 0.2 * panel.pixel_pitch)
    x, y = lattice.from_axes(lattice.origin_x + i * lattice.pitch, v)
    column, row = panel.coordinates(x, y)
    wave = np.exp(2j * np.pi * (order[0] * column + order[1] * row))
    wave = wave * np.outer(np.hanning(count), np.hanning(count))
    size = 4 * count
    spectrum = np.abs(np.fft.fft2(wave, (size, size)))
    k_v, k_i = np.unravel_index(spectrum.argmax(), spectrum.shape)
    across = np.fft.fftfreq(size, lattice.pitch)[k_i]
    along = np.fft.fftfreq(size, 0.2 * panel.pixel_pitch)[k_v]
    return 1 / math.hypot(across, along)


@pytest.mark.parametrize("pixel", [0.18, 0.266])
@pytest.mark.parametrize("slant", [3.0, 11.0, 17.0, 24.0, 33.0, 42.0])
def test_moire_periods_are_those_of_the_picture(pixel, slant):
    display = sheet_on(pixel, slant)
    for order in ((1, 0), (1, 1), (2, -1)):
        period = wave_period(display, order)
        assert seen_period(display, order) == pytest.approx(period, rel=0.02)


@pytest.mark.parametrize("pixel", [0.18, 0.266])
@pytest.mark.parametrize(("order", "slope"), [((1, 0), 0.0), ((2, 1), 0.5), ((3, 1), 1 / 3), ((1, 1), 1.0)])
def test_moire_is_slowest_near_rational_slopes(pixel, order, slope):
    """The wave of such an order has its bars along the lens there: what is left of its frequency lies across."""
    at = math.degrees(math.atan(slope))
    angles = at + np.linspace(-6, 6, 1201)
    periods = np.array([wave_period(sheet_on(pixel, angle), order) for angle in angles])
    slowest = angles[periods.argmax()]
    # Beside the rational slope by no more than the remaining frequency across makes up for.
    assert abs(slowest - at) < 3.0
    frequency = 1 / wave_period(sheet_on(pixel, at), order)
    waves = math.hypot(*order) / pixel * 0.508
    assert frequency == pytest.approx(abs(waves - round(waves)) / 0.508, rel=1e-9)


# ---- Viewing zones (Dodgson, Proc. SPIE 4660, 2002) ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("diagonal", "views", "distance"), [(10, 8, 700), (10, 16, 700), (25, 7, 1500), (25, 28, 1500), (50, 15, 3000)]
)
def test_viewing_zones_are_where_every_lens_shows_its_own_views(diagonal, views, distance):
    """The screens of the paper, with views 20 mm apart at the distance: zones by walking an eye past all lenses."""
    width, gap = 0.8 * 25.4 * diagonal, 4.0
    box = 20.0 * views
    # The eye box is a micro-image as the lens throws it to the distance; the lens is narrower by D / (D + g).
    micro_image = box * gap / distance
    lenses = 400
    panel = Panel(lenses * views, 100, micro_image / views)
    display = Display("zone", panel, LensArray("lenticular", micro_image / (1 + gap / distance)), gap, "", distance)
    display = replace(display, panel=replace(panel, width=max(views, views * round(width / micro_image))))
    screen = display.size_mm[0] / display.magnification
    zone = ViewingZone(screen, distance, 0.5 * micro_image / gap)
    assert 2 * zone.slope * distance == pytest.approx(box)

    grid = display.lens_grid
    centers = display.lattice.origin_x + np.arange(grid.columns) * display.lattice.pitch
    lens = 0.5 * display.lens_array.pitch  # the screen reaches half a lens beyond the last centre

    def sees_one_set(x, z):
        place, _ = display.visible_panel_point(
            np.full_like(centers, x), centers * 0, centers * 0 + z, centers, centers * 0
        )
        i, _ = display.lens_of(place, place * 0)
        return bool(np.all(i == np.arange(grid.columns)))

    for z in (0.5 * distance, 0.8 * distance, distance, 1.3 * distance, 2 * distance):
        expected = zone.width_at(z)
        slack = lens * abs(1 - z / distance) + 1e-6 * z
        if expected > 2 * slack:
            assert sees_one_set(0.5 * expected - slack, z)
        assert not sees_one_set(0.5 * expected + 2 * slack + 1e-3, z)
    assert zone.width_at(distance) == pytest.approx(box)
    if zone.nearest < distance:
        assert zone.width_at(zone.nearest) == pytest.approx(0, abs=1e-9)
        assert zone.width_at(1.01 * zone.nearest) > 0
    assert math.isinf(zone.farthest) == (box >= screen)


# ---- Optiland, another tracer: benchmarks/optics_second_tracer.py ----------------------------------------------------


def test_another_tracer_lands_rays_where_we_do():
    path = Path(__file__).parents[2] / "benchmarks" / "results" / "optics_second_tracer.json"
    compared = json.loads(path.read_text(encoding="utf-8"))
    assert compared["tracer"] == "Optiland 0.6.3"
    for found in compared["lenses"].values():
        lens = Lens(LensProfile(**found["profile"]), LensArray(found["layout"], found["pitch"]))
        assert len(found["rays"]) == 24
        assert found["largest_distance_mm"] < 1e-6
        for ray in found["rays"]:
            x, y = (np.array([value]) for value in ray["through"])
            rays = trace(lens, x, y, *ray["slopes"])
            assert np.hypot(rays.x[0] - ray["lands"][0], rays.y[0] - ray["lands"][1]) < 1e-6
