"""A rendered print, seen through its sheet from its viewing distance, is the scene as Mitsuba's own camera sees it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from mitsuba_cameras import camera_rays, in_display, intersect

from lippmann.calibration.finish import Finish
from lippmann.display.formats.print_sheet import Print
from lippmann.options.placement import PlacementOptions
from lippmann.viewing.replay import replay

pytestmark = pytest.mark.usefixtures("engine")

#: So many pixels to a lens (60) that one camera at the eye agrees with those it sees.
PRINT = Print(ppi=1200, size=(60, 8), lpi=20, viewing_distance=300)
PITCH = 25.4 / 20
#: Three places level with the middle, at the viewing distance; the field of 54 degrees ends at 153 mm.
EYES = [(-80.0, 0.0, 300.0), (11.0, 0.0, 300.0), (145.0, 0.0, 300.0)]


@pytest.fixture(scope="module")
def made(glowing):
    """The teapot's positions (mm) and normals on the print, one ray through every pixel's centre."""
    from lippmann.api import render

    scene, display = glowing("teapot"), PRINT.display()
    options = {"spp": 1, "pixel_filter": "point", "placement": PlacementOptions(place="fit", scale=4.0)}
    return {name: render(scene, display, integrator=name, **options) for name in ("position", "normal")}


def lens_points(rows=40):
    """Places on the lenses' axes, worked out from the lenses per inch; an axis or a valley lies in the middle."""
    count = int(60 / PITCH)
    # 47.2 lenses over the print: not a whole number, so a lens's axis lies in the middle.
    x = (np.arange(count) - count // 2) * PITCH
    y = np.linspace(-3.5, 3.5, rows)
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def seen_through(image, eye, points):
    """What the replay shows at points of the lens plane: the nearest pixels of a fine picture of it."""
    panel = image.display.panel
    width, height = image.display.size_mm
    seen = replay(image, eye, size=(panel.width, panel.height))
    column = np.floor((points[:, 0] / width + 0.5) * panel.width).astype(int)
    row = np.floor((0.5 - points[:, 1] / height) * panel.height).astype(int)
    return seen[row, column]


def direct(built, image, eye, points):
    hit, position, normal, _ = intersect(built, *camera_rays(image.world_from_display, eye[2], eye[:2], points))
    position, normal = in_display(image.world_from_display, position, normal)
    return hit, {"position": position, "normal": normal}


def agreement(made, built, eye, points):
    """Share of points on the scene at which the replay shows what the camera sees, to 0.2 mm at depths of up to 24."""
    position = made["position"]
    hit, seen = direct(built, position, eye, points)
    shown = seen_through(position, eye, points)
    normal = seen_through(made["normal"], eye, points)
    usable = hit & (np.abs(points[:, 0]) < 28)
    near = np.abs(shown - seen["position"]).max(axis=1) < 0.2
    alike = np.abs(normal - seen["normal"]).max(axis=1) < 0.1
    assert usable.sum() > 100
    return float((near & alike)[usable].mean())


@pytest.mark.long
def test_every_eye_at_the_viewing_distance_sees_its_own_perspective(made, glowing, build_once):
    built = build_once(glowing("teapot"))
    shares = [agreement(made, built, eye, lens_points()) for eye in EYES]
    print(shares)
    # The rest are silhouettes, where a pixel's width decides between surfaces.
    assert min(shares) > 0.93


@pytest.mark.slow
def test_without_regard_to_the_distance_it_would_not(glowing, build_once):
    """With micro-images as wide as the lenses the far side of the print flips before the eye leaves the field."""
    from lippmann.api import render

    display = replace(PRINT.display(), viewing_distance=math.inf)
    options = {"spp": 1, "pixel_filter": "point", "placement": PlacementOptions(place="fit", scale=4.0)}
    scene = glowing("teapot")
    wrong = {name: render(scene, display, integrator=name, **options) for name in ("position", "normal")}
    points = lens_points()
    far, near = points[points[:, 0] < -10], points[points[:, 0] > 10]
    assert agreement(wrong, build_once(scene), EYES[2], far) < 0.5
    assert agreement(wrong, build_once(scene), EYES[2], near) > 0.93


@pytest.mark.slow
def test_the_marked_sheet_shows_the_same(made, glowing, build_once):
    built = build_once(glowing("teapot"))
    marked = {name: Finish(margin=5.0).image(image) for name, image in made.items()}
    assert agreement(marked, built, EYES[0], lens_points()) > 0.93
