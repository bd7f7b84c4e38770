"""Replayed pictures against pictures that Mitsuba's own cameras take in the scene itself.

What "sampled at the same points" means. An eye that looks at a lens sees the panel point behind the lens's centre, and
there a pixel. What the pixel shows was recorded along one line: through the pixel's centre and the centre of its lens.
Continued to the viewing distance D that line passes a *viewpoint*; if D is infinite it has a *direction* instead. So
the replayed colour is one sample of the picture that a perspective camera at the viewpoint (an orthographic one that
looks along the direction) takes, at the place where this camera sees the lens's centre. An eye at a viewpoint that all
lenses share is that camera: then the whole replayed picture is one direct picture. Any other eye sees a mosaic of
direct pictures, one for each view that it sees somewhere.

A lenticular sheet has no parallax along its lenses: its viewpoints lie level with the middle of the panel, and its
directions are level, however high the eye is.

Lenses, panel points, pixels and viewpoints are worked out here from the definitions, by trying all lenses; cameras,
intersections and surfaces are Mitsuba's. Samples where a shift of a ten-thousandth of a millimetre makes the direct
camera see another surface (silhouettes, edges) are left out; all others must agree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from handmade_display import Sheet, lens_plane_points, samples_of
from mitsuba_cameras import camera_rays, direct_pictures, in_display, intersect

SCENES = ("teapot", "fancy teapot", "clear coat")

pytestmark = pytest.mark.usefixtures("engine")

#: The least agreement (dB), and the largest distance (mm) between what any one lens shows and what the camera sees.
LEAST_PSNR, LARGEST_ERROR = 45.0, 2e-3

NO_OFFSET = ((0.0, 0.0),)
RGB_STRIPE = ((-1 / 3, 0.0), (0.0, 0.0), (1 / 3, 0.0))

STRAIGHT = Sheet("lenticular", across=9, width=24 * 9, height=160)
# Three rows down is one pixel across: sub-pixels of neighbouring rows stand behind the same places of their lenses.
SLANTED = Sheet("lenticular", across=8, width=20 * 8, height=120, tangent=1 / 3)
SQUARE = Sheet("square", across=8, down=8, width=24 * 8, height=20 * 8)
HEXAGONAL = Sheet("hexagonal", across=8, down=7, width=24 * 8, height=24 * 7)
SHEETS = {"straight": STRAIGHT, "slanted": SLANTED, "square": SQUARE, "hexagonal": HEXAGONAL}
DISTANCES = [math.inf, 400.0]


def psnr(a, b, peak=1.0):
    return 10 * math.log10(peak**2 / max(float(np.mean(np.square(a - b, dtype=np.float64))), 1e-16))


@dataclass
class Pictures:
    """One integral image for each noise-free shading."""

    position: object
    normal: object
    emission: object
    sheet: Sheet
    subpixels: bool = False
    matrix: np.ndarray = field(init=False)
    depth: float = field(init=False)

    def __post_init__(self):
        self.matrix = self.position.world_from_display
        self.depth = float(np.ptp(self.position.provenance.options["depth_range"]))


def rendered(scene, sheet, subpixels=False, **placement):
    from lippmann.api import render

    common = {"spp": 1, "pixel_filter": "point", "subpixels": subpixels, "place": "fit"} | placement
    display = sheet.display()
    position, normal = (render(scene, display, integrator=name, **common) for name in ("position", "normal"))
    return Pictures(position, normal, render(scene, display, integrator="path", depth=1, **common), sheet, subpixels)


def compare(pictures, built, eye, size=(31, 37)):
    """The replay to an eye against the direct pictures, in dB, with ``error``, the largest one in mm."""
    sheet = pictures.sheet
    kinds = ("position", "normal", "emission")
    seen = {kind: getattr(pictures, kind).replay(eye, size=size).reshape(-1, 3) for kind in kinds}
    figures = []
    for channel, offset in enumerate(RGB_STRIPE if pictures.subpixels else NO_OFFSET):
        samples = samples_of(sheet, lens_plane_points(sheet, *size), eye, offset)
        direct = direct_pictures(built, pictures.matrix, sheet, samples)
        channels = slice(channel, channel + 1) if pictures.subpixels else slice(0, 3)
        figures.append(agreement(seen, samples, direct, pictures.depth, channels))
    worst = {kind: min(figure[kind] for figure in figures) for kind in (*kinds, "own")}
    return worst | {kind: max(figure[kind] for figure in figures) for kind in ("error", "cameras")}


def agreement(seen, samples, direct, depth, channels):
    usable = samples.clear & direct.stable
    assert samples.clear.mean() > 0.75  # the rest lies past the panel or between lenses
    assert usable[samples.clear].mean() > 0.99  # the rest are edges
    hit = usable & direct.hit
    assert hit[usable].mean() > 0.15
    assert (seen["position"][usable & ~direct.hit, channels] == 0).all()
    pairs = {kind: (seen[kind][hit, channels], getattr(direct, kind)[hit, channels]) for kind in seen}
    return {
        "position": psnr(*pairs["position"], depth),
        "normal": psnr(*pairs["normal"]),
        "emission": psnr(*pairs["emission"]),
        "error": float(np.abs(np.subtract(*pairs["position"])).max()),
        "own": float(samples.own[samples.clear].mean()),
        "cameras": direct.cameras,
    }


def check(figures):
    print(figures)
    assert min(figures["position"], figures["normal"], figures["emission"]) >= LEAST_PSNR
    assert figures["error"] <= LARGEST_ERROR


# ---- Proofs --------------------------------------------------------------------------------------------------------


@pytest.fixture
def pictures(glowing, build_once):
    """``pictures(scene, sheet)`` with the built scene."""

    def make(name, sheet, subpixels=False, **placement):
        scene = glowing(name)
        return rendered(scene, sheet, subpixels, **placement), build_once(scene)

    return make


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("name", SHEETS)
@pytest.mark.parametrize("scene", SCENES)
def test_replay_equals_direct_pictures(scene, name, distance, pictures):
    """Eyes on and off the axis, near and far, within the field and beyond it, where lenses show their neighbours'."""
    sheet = replace(SHEETS[name], distance=distance)
    made, built = pictures(scene, sheet, subpixels=name == "slanted")
    for eye in [(0.0, 0.0, 480.0), (37.3, -21.9, 900.0), (-263.0, 35.1, 700.0)]:
        figures = compare(made, built, eye)
        assert (figures["own"] > 0.95) == (abs(eye[0]) < 100)
        check(figures)
    if name != "slanted":
        check_eye_where_views_meet(made, built)


def check_eye_where_views_meet(made, built):
    """All views meet at the viewing distance, parallel ones infinitely far away: one direct camera sees it all."""
    from lippmann.replay import eye_of_view

    sheet = made.sheet
    far = sheet.distance if math.isfinite(sheet.distance) else 1e12
    # From the middle of the micro-image to the middle of a pixel; seen through the lens from the other side.
    right, down = 1 - (sheet.across - 1) / 2, 0 if sheet.layout == "lenticular" else 6 - (sheet.across - 1) / 2
    x, y = -right * sheet.pixel * far / sheet.gap, down * sheet.pixel * far / sheet.gap
    if sheet.layout != "hexagonal":
        assert eye_of_view(sheet.display(), 6 if down else 0, 1) == pytest.approx((x, y, far))
    figures = compare(made, built, (x, y, far))
    assert figures["cameras"] == 1
    check(figures)
    samples = samples_of(sheet, lens_plane_points(sheet, 31, 37), (x, y, far))
    there = np.array([x, y]) / (1 if math.isfinite(sheet.distance) else far)
    assert np.abs(samples.viewpoints[samples.clear] - there).max() < 1e-9


def test_pixels_per_lens_need_not_be_whole(pictures):
    """A corner of a 4K panel's worth: every pixel stands at a place of its own behind its lens."""
    sheet = Sheet("lenticular", 6.2867, 320, 180, distance=600.0, tangent=-0.1666, pixel=0.0899, gap=0.886)
    made, built = pictures("teapot", sheet, subpixels=True, scale=2.5)
    figures = compare(made, built, (21.7, 40.3, 550.0), size=(13, 11))
    assert figures["cameras"] > 40
    check(figures)


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("layout", ["square", "hexagonal", "lenticular"])
@pytest.mark.parametrize("scene", SCENES)
def test_fine_pixels_show_what_a_camera_at_the_very_eye_sees(scene, layout, distance, pictures):
    """With 160 pixels to a lens pixel centres lie so close that one camera at any eye will do for all of them.

    A lenticular sheet shows a true perspective only to eyes level with its middle at the viewing distance.
    """
    from lippmann.replay import replay_at_lens_centers

    eye = (23.3, -17.1, 700.0) if layout != "lenticular" else (23.3, 0.0, 400.0)
    if layout == "lenticular" and math.isinf(distance):
        distance = 400.0
        eye = (-41.1, 0.0, 400.0)
    sizes = {"square": (160, 8 * 160), "hexagonal": (139, 8 * 139), "lenticular": (math.inf, 240)}
    down, height = sizes[layout]
    sheet = Sheet(layout, 160, 10 * 160, height, down=down, distance=distance, pixel=0.025)
    made, built = pictures(scene, sheet)
    seen = {kind: replay_at_lens_centers(getattr(made, kind), eye) for kind in ("position", "normal", "emission")}
    points = seen["position"].points.reshape(-1, 2)
    lens, clear = sheet.nearest_lens(points)
    at_center = sheet.to_axes(points - lens)[:, : 1 if layout == "lenticular" else 2]
    assert clear.all()
    assert np.abs(at_center).max() < 1e-9
    origin, direction = camera_rays(made.matrix, eye[2], np.array(eye[:2]), points)
    hit, position, normal, emission = intersect(built, origin, direction)
    position, normal = in_display(made.matrix, position, normal)
    shown = {kind: sample.colors.reshape(-1, 3) for kind, sample in seen.items()}
    same = seen["position"].own.reshape(-1) & hit & (np.abs(shown["position"] - position)[:, 2] < 1)
    print(
        scene,
        layout,
        distance,
        same.sum(),
        hit.sum(),
        psnr(shown["position"][same], position[same], made.depth),
        psnr(shown["normal"][same], normal[same]),
        psnr(shown["emission"][same], emission[same]),
    )
