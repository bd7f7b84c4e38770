"""True directions of a display: both maps, each the other's inverse, and nothing of it where there is no lens."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel, load_display
from lippmann.display.array_ops import NUMPY
from lippmann.display.distortion import Distortion
from lippmann.errors import DisplayError
from lippmann.optics.directions import true_directions
from lippmann.optics.lens import Lens
from lippmann.viewing.replay import eye_of_offset

PANEL = Panel(60, 48, 0.1)
BENT = Distortion(0.5, (0.9, 0.95, 1.05, 1.2, 1.3))
ARRAYS = {
    "upright": LensArray("lenticular", 1.0),
    "slanted": LensArray("lenticular", 1.0, slant=12.0),
    "square": LensArray("square", 1.0),
    "hexagonal": LensArray("hexagonal", 1.0),
}


def display(name: str, distortion: Distortion | None = BENT) -> Display:
    return Display(name, PANEL, ARRAYS[name], gap=2.0, viewing_distance=300.0, distortion=distortion)


def places(seed: int = 1):
    rng = np.random.default_rng(seed)
    return PANEL.point(rng.uniform(1, 59, 400), rng.uniform(1, 47, 400))


@pytest.mark.parametrize("name", ARRAYS)
def test_a_ray_meets_the_point_that_an_eye_on_it_sees(name):
    bent, (x, y) = display(name), places()
    (ox, oy, oz), (dx, dy, dz) = bent.light_ray(x, y)
    t = (oz - 40.0) / dz  # of a point in front of the display, and one behind
    for way in (t, -t):
        point = ox + way * dx, oy + way * dy, oz + way * dz
        back = bent.project(*point, *bent.lens_of(x, y))
        np.testing.assert_allclose(back, (x, y), atol=4e-3)  # the tables are coarse
    eye = ox - t * dx, oy - t * dy, oz - t * dz
    at_lens = ox - oz / dz * dx, oy - oz / dz * dy
    if name in ("square", "hexagonal"):  # a cylinder's ray does not converge along it
        np.testing.assert_allclose(bent.visible_panel_point(*eye, *at_lens), (x, y), atol=4e-3)


@pytest.mark.parametrize("name", ["upright", "slanted"])
def test_an_eye_sees_the_place_of_its_direction_across_cylinders(name):
    bent, straight = display(name), display(name, None)
    eye, (x, y) = (70.0, -20.0, 280.0), places()
    seen, before = (d.visible_panel_point(*eye, x, y) for d in (bent, straight))
    axis = bent.lattice.center(*bent.lattice.lens_at(x, y, NUMPY), x, y, NUMPY)
    across = bent.lattice.across(seen[0] - axis[0], seen[1] - axis[1])
    pinhole = bent.lattice.across(before[0] - axis[0], before[1] - axis[1])
    np.testing.assert_allclose(bent.pinhole_place(across), pinhole, atol=4e-3)
    # Along the lens it stays.
    np.testing.assert_allclose(bent.lattice.along(*seen), bent.lattice.along(*before), atol=1e-12)


@pytest.mark.parametrize("name", ARRAYS)
def test_the_eye_of_a_view_sees_its_place(name):
    bent = display(name)
    down = 0.0 if name in ("upright", "slanted") else -1.5
    eye = eye_of_offset(bent, 3.0, down)
    center = bent.lattice.center(*bent.lattice.lens_at(0.0, 0.0, NUMPY), 0.0, 0.0, NUMPY)
    x, y = bent.visible_panel_point(eye[0] + center[0], eye[1] + center[1], eye[2], *center)
    if name == "slanted":
        assert bent.lattice.across(x - center[0], y - center[1]) == pytest.approx(
            bent.lattice.across(0.3, 0.0), abs=4e-3
        )
    else:
        assert (x - center[0], y - center[1]) == pytest.approx((0.3, 0.15 if down else 0.0), abs=4e-3)


def test_without_distortion_all_is_that_of_a_pinhole_to_the_last_bit():
    straight, (x, y) = display("slanted", None), places()
    dx, dy = straight.pinhole_offset(x, y)
    assert dx is x
    assert dy is y
    assert straight.panel_offset(x, y)[0] is x
    assert straight.place(x) is x
    assert straight.edge_factor == 1.0
    cx, cy = straight.lens_center(*straight.lens_of(x, y), x, y)
    _, direction = straight.light_ray(x, y)
    length = np.sqrt(((x - cx) / 2.0) ** 2 + ((y - cy) / 2.0) ** 2 + 1.0)
    np.testing.assert_array_equal(direction[0], (x - cx) / 2.0 / length)
    assert all(one.distortion is None for one in (load_display("seed-lenticular"), load_display("panel-4k")))


def test_prints_of_a_known_sheet_have_the_directions_of_its_lens():
    sheet = load_display("print-60lpi")
    lens = Lens.of(sheet)
    place = np.linspace(-0.5, 0.5, 301) * lens.pitch
    slope = -sheet.pinhole_place(place) / sheet.gap
    np.testing.assert_allclose(slope, true_directions(lens).direction_of(place), atol=1e-4)
    np.testing.assert_allclose(sheet.place(-slope * sheet.gap), place, atol=1e-4)
    assert sheet.field_of_view == pytest.approx(
        2 * np.degrees(np.arctan(0.2117 * sheet.edge_factor / sheet.gap)), rel=1e-3
    )


def test_it_comes_back_from_files():
    bent = display("slanted")
    assert Display.from_dict(json.loads(json.dumps(bent.to_dict()))) == bent
    assert "distortion" not in display("slanted", None).to_dict()


@pytest.mark.parametrize("factors", [(), (1.0,), (1.0, 0.4, 0.1), (1.0, float("nan")), "ab", None])
def test_two_places_with_one_direction_are_refused(factors):
    with pytest.raises(DisplayError, match="factors"):
        replace(BENT, factors=factors)
