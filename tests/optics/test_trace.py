"""Light through one lens: Snell, Fresnel, energy, reversible paths, neighbours in the way."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lippmann.display.lens_array import LensArray
from lippmann.display.lens_profile import LensProfile
from lippmann.optics.lens import Lens
from lippmann.optics.trace import Vectors, trace, trace_back

PITCH = 0.5
LENSES = {
    "circle": Lens(LensProfile(0.3, 0.75, 1.57), LensArray("lenticular", PITCH)),
    "ellipse": Lens(LensProfile(0.32, 0.8, 1.5, conic=-0.44), LensArray("lenticular", PITCH)),
    "hyperbola": Lens(LensProfile(0.2, 0.8, 1.5, conic=-2.2), LensArray("lenticular", PITCH)),
    "gaps": Lens(LensProfile(0.3, 0.75, 1.57, diameter=0.4), LensArray("lenticular", PITCH)),
    "square": Lens(LensProfile(0.45, 1.0, 1.57), LensArray("square", PITCH)),
    "hexagonal": Lens(LensProfile(0.45, 1.0, 1.57), LensArray("hexagonal", PITCH)),
    "round": Lens(LensProfile(0.45, 1.0, 1.57, diameter=0.4), LensArray("square", PITCH)),
}
#: Slopes across and along, so small that no lens here stands in another's light.
OPEN = [(0.0, 0.0), (0.3, 0.0), (-0.2, 0.4), (0.1, -0.7)]


@pytest.fixture(params=LENSES.values(), ids=LENSES)
def lens(request):
    return request.param


def marched_height(lens, x, y):
    """Height of the sheet over points of the plane, by the nearest lens's own sag."""
    x = x - PITCH * np.floor(x / PITCH + 0.5)
    return lens.profile.thickness - np.array([lens.profile.sag(v) for v in np.ravel(x)]).reshape(np.shape(x))


@pytest.mark.parametrize("slopes", OPEN)
def test_a_sheet_is_lit_as_a_flat_one(lens, slopes):
    """Crests turn light away from one flank and toward the other; over a whole lens nothing is lost but to Fresnel."""
    rays = trace(lens, *lens.samples(400 if lens.is_cylinder else 60), *slopes)
    assert rays.area.mean() == pytest.approx(1.0, abs=1e-6)
    assert not rays.strays.any()


@pytest.mark.parametrize("slopes", OPEN)
def test_what_does_not_pass_is_reflected(lens, slopes):
    """Fresnel in angles, by its other form: what both polarisations reflect and what passes are all the light."""
    x, y = lens.samples(40 if lens.is_cylinder else 9)
    rays = trace(lens, x, y, *slopes)
    length = math.sqrt(1 + slopes[0] ** 2 + slopes[1] ** 2)
    # The normal is along n t - i, for unit vectors of the ray before (i) and behind (t).
    before = np.array([-slopes[0] / length, -slopes[1] / length, -1 / length])[:, None]
    behind = np.array(rays.inside)
    normal = lens.profile.index * behind - before
    normal /= np.linalg.norm(normal, axis=0)
    outer, inner = np.arccos(np.sum(before * normal, axis=0)), np.arccos(np.sum(behind * normal, axis=0))
    slanted = outer > 1e-2
    outer, inner = outer[slanted], inner[slanted]
    across = (np.sin(outer - inner) / np.sin(outer + inner)) ** 2
    along = (np.tan(outer - inner) / np.tan(outer + inner)) ** 2
    assert np.count_nonzero(slanted) > 20
    assert rays.transmission[slanted] + 0.5 * (across + along) == pytest.approx(1.0, abs=1e-9)
    assert np.linalg.norm(behind, axis=0) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("slopes", OPEN)
def test_paths_are_reversible(lens, slopes):
    x, y = lens.samples(41 if lens.is_cylinder else 9)
    inside = x**2 + (0 if lens.is_cylinder else y**2) < (0.98 * lens.reach) ** 2
    x, y = x[inside], y[inside]
    rays = trace(lens, x, y, *slopes)
    up = Vectors(*(-part for part in rays.inside))
    slope_x, slope_y, transmission = trace_back(lens, rays.x, rays.y, up)
    assert slope_x == pytest.approx(np.full_like(x, slopes[0]), abs=1e-9)
    assert slope_y == pytest.approx(np.full_like(x, slopes[1]), abs=1e-9)
    assert transmission == pytest.approx(rays.transmission, abs=1e-9)


@pytest.mark.parametrize("name", ["circle", "ellipse", "hyperbola"])
def test_light_and_panel_see_as_much_of_each_other(name):
    """Etendue: ``area dx d(sin)`` outside is ``n dX d(sin)`` inside."""
    lens, small = LENSES[name], 1e-5
    x, slopes = np.linspace(-0.2, 0.2, 9), np.linspace(-0.3, 0.3, 9)

    def land(x, sine):
        rays = trace(lens, x, x * 0, sine / np.sqrt(1 - sine**2))
        return np.array([rays.x, lens.profile.index * rays.inside.x])

    for slope in slopes:
        sine = np.full_like(x, slope / math.hypot(1, slope))
        by_x = (land(x + small, sine) - land(x - small, sine)) / (2 * small)
        by_sine = (land(x, sine + small) - land(x, sine - small)) / (2 * small)
        area = trace(lens, x, x * 0, slope).area
        assert np.abs(by_x[0] * by_sine[1] - by_x[1] * by_sine[0]) == pytest.approx(area, abs=1e-6)


def test_the_crest_is_where_its_sag_says():
    """A ray marched down to the sheet in small steps meets it where the closed form has it, shadow or not."""
    lens = Lens(LensProfile(0.265, 0.7, 1.57), LensArray("lenticular", PITCH))
    slope, steps = 2.0, np.arange(1, 4000) * 1e-4
    x, y = lens.samples(50)
    rays = trace(lens, x, y, slope)
    height = marched_height(lens, x, y)
    path = x[:, None] + slope * steps
    blocked = np.any(marched_height(lens, path, None) > height[:, None] + steps + 1e-9, axis=1)
    assert 5 < np.count_nonzero(blocked) < 45
    assert np.array_equal(rays.area == 0.0, blocked)


@pytest.mark.parametrize("name", ["circle", "square", "hexagonal", "round"])
@pytest.mark.parametrize("slopes", [(2.0, 0.0), (-3.0, 1.0), (1.0, 2.5)])
def test_in_shadow_no_light_is_lost(name, slopes):
    """What one lens has less of, another has more."""
    lens = LENSES[name]
    rays = trace(lens, *lens.samples(20_000 if lens.is_cylinder else 150), *slopes)
    assert rays.area.mean() == pytest.approx(1.0, abs=2e-3)


def test_a_skew_ray_through_a_cylinder_by_hand():
    """Along the crest a cylinder is a flat plate; there Snell's law keeps n sin of the slope along it."""
    lens = LENSES["circle"]
    rays = trace(lens, np.zeros(1), np.zeros(1), 0.0, 1.0)
    sine = math.sqrt(0.5) / 1.57
    assert rays.y[0] == pytest.approx(-0.75 * sine / math.sqrt(1 - sine**2))
    assert rays.x[0] == 0.0


def test_light_that_leaves_again_is_lost():
    """Almost along the sheet, light from a steep flank passes through the crest and out of its other side."""
    lens = Lens(LensProfile(0.2501, 0.7, 1.3), LensArray("lenticular", PITCH))
    rays = trace(lens, np.array([0.24]), np.zeros(1), 30.0)
    assert rays.strays[0] == 1.0
    assert rays.light[0] == 0.0


def test_total_reflection_has_no_direction():
    lens = LENSES["circle"]
    flat = Vectors(np.array([0.9]), np.zeros(1), np.array([math.sqrt(1 - 0.81)]))
    # Over the top of the crest, beyond the critical angle of 39.6 degrees.
    slope_x, _, transmission = trace_back(lens, np.array([-0.75 * 0.9 / math.sqrt(1 - 0.81)]), np.zeros(1), flat)
    assert transmission[0] == 0.0
    assert math.isnan(slope_x[0])
