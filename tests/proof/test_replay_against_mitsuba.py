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

from lippmann.options.placement import PlacementOptions
from lippmann.viewing.replay import replay_points

SCENES = ("teapot", "fancy teapot", "clear coat")

pytestmark = pytest.mark.usefixtures("engine")

FITTED = PlacementOptions(place="fit", depth_scale=1.0, scale=1.1)
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


def rendered(scene, sheet, subpixels=False, placement=FITTED):
    from lippmann.api import render

    common = {"method": "full", "spp": 1, "pixel_filter": "point", "subpixels": subpixels, "placement": placement}
    display = sheet.display()
    position, normal = (render(scene, display, integrator=name, **common) for name in ("position", "normal"))
    return Pictures(
        position,
        normal,
        render(scene, display, integrator="path", tone_map="none", **common),
        sheet,
        subpixels,
    )


def compare(pictures, built, eye, size=(31, 37)):
    """The replay to an eye against the direct pictures, in dB, with ``error``, the largest one in mm."""
    sheet = pictures.sheet
    kinds = ("position", "normal", "emission")
    seen = {kind: replay_points(getattr(pictures, kind), eye, size).reshape(-1, 3) for kind in kinds}
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
    assert hit[usable].mean() > 0.12
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


@pytest.mark.long_cases(but=["teapot-straight-inf", "teapot-square-400.0"])
@pytest.mark.slow
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
    from lens_samples import eye_of_view

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


@pytest.mark.long
def test_pixels_per_lens_need_not_be_whole(pictures):
    """A corner of a 4K panel's worth: every pixel stands at a place of its own behind its lens."""
    sheet = Sheet("lenticular", 6.2867, 320, 180, distance=600.0, tangent=-0.1666, pixel=0.0899, gap=0.886)
    made, built = pictures("teapot", sheet, subpixels=True, placement=PlacementOptions(place="fit", depth_scale=1.0))
    figures = compare(made, built, (21.7, 40.3, 550.0), size=(9, 7))
    assert figures["cameras"] > 40
    check(figures)


FINE = {
    "square": Sheet("square", across=160, down=160, width=12 * 160, height=9 * 160, pixel=0.025),
    "hexagonal": Sheet("hexagonal", across=160, down=139, width=12 * 160, height=10 * 139, pixel=0.025, distance=400.0),
    "lenticular": Sheet("lenticular", across=160, width=12 * 160, height=400, pixel=0.025, distance=400.0),
}


@pytest.mark.long
@pytest.mark.parametrize("layout", FINE)
@pytest.mark.parametrize("scene", SCENES[:2])
def test_fine_pixels_show_what_a_camera_at_the_very_eye_sees(scene, layout, pictures):
    """With 160 pixels to a lens they lie so close that one camera at any eye agrees with all of them.

    A lenticular sheet shows a true perspective to eyes level with its middle, at the viewing distance. Samples where
    the camera sees another surface when it moves by a pixel are left out.
    """
    from lens_samples import replay_at_lens_centers

    sheet = FINE[layout]
    made, built = pictures(scene, sheet)
    level = layout == "lenticular"
    kinds = ("position", "normal", "emission")
    for eye in [(23.3, 0.0, 400.0), (-41.1, 0.0, 400.0)] if level else [(23.3, -17.1, 700.0), (-66.2, 31.7, 900.0)]:
        shown = {kind: replay_at_lens_centers(getattr(made, kind), eye) for kind in kinds}
        points = shown["position"].points.reshape(-1, 2)
        lens, clear = sheet.nearest_lens(points)
        assert clear.all()
        assert np.abs(points - lens)[:, : 1 if level else 2].max() < 1e-9
        pixel = sheet.pixel * eye[2] / sheet.gap
        moves = np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)]) * pixel
        seen = [seen_from(made, built, np.add(eye, [*move, 0]), points) for move in moves]
        direct = seen[0]
        same = shown["position"].own.reshape(-1) & direct["hit"]
        for moved in seen[1:]:
            same &= moved["hit"] & (np.abs(moved["position"] - direct["position"])[:, 2] < 1)
            same &= np.abs(moved["normal"] - direct["normal"]).max(axis=1) < 0.1
        assert same.sum() > 0.8 * direct["hit"].sum()
        assert same.sum() > 10
        for kind in kinds:
            peak = made.depth if kind == "position" else 1.0
            figure = psnr(shown[kind].colors.reshape(-1, 3)[same], direct[kind][same], peak)
            print(kind, figure)
            assert figure >= LEAST_PSNR, kind


def seen_from(made, built, eye, points):
    """What one perspective camera at ``eye`` sees through ``points`` of the lens plane."""
    hit, position, normal, emission = intersect(built, *camera_rays(made.matrix, eye[2], eye[:2], points))
    position, normal = in_display(made.matrix, position, normal)
    return {"hit": hit, "position": position, "normal": normal, "emission": emission}


@pytest.mark.long
def test_the_scenes_own_camera_is_the_eye_at_the_viewing_point(pictures, glowing):
    """Placed by the teapot's camera, the display shows an eye at (0, 0, D) what Mitsuba's camera there sees."""
    import mitsuba as mi

    sheet = Sheet("square", across=7, down=7, width=22 * 7, height=20 * 7, distance=400.0)
    made, built = pictures("teapot", sheet, placement=PlacementOptions(place="camera"))
    pose = mi.ScalarTransform4d(glowing("teapot").cameras[0].world_from_camera)
    # Mitsuba's cameras look along +z.
    pose = pose @ mi.ScalarTransform4d().rotate([0, 1, 0], 180)
    film = {"type": "hdrfilm", "width": 100, "height": 100, "rfilter": {"type": "box"}}
    sensor = mi.load_dict({"type": "perspective", "to_world": pose, "fov": 45, "film": film, "near_clip": 1.0})
    lens, clear = sheet.nearest_lens(lens_plane_points(sheet, 31, 37))
    place = 0.5 + 0.5 * lens / sheet.distance / math.tan(math.radians(22.5)) * [1, -1]
    ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f(place.T.astype(np.float32)), mi.Point2f(0.5, 0.5))
    origin, direction = (np.broadcast_to(np.array(vector).T, (len(lens), 3)) for vector in (ray.o, ray.d))
    hit, position, normal, _ = intersect(built, origin, direction)
    position, normal = in_display(made.matrix, position, normal)
    eye = (0.0, 0.0, sheet.distance)
    shown = {kind: replay_points(getattr(made, kind), eye, (31, 37)).reshape(-1, 3) for kind in ("position", "normal")}
    both = clear & hit & (shown["position"] != 0).any(axis=1)
    assert both.sum() > 0.99 * (clear & hit).sum() > 200
    assert psnr(shown["position"][both], position[both], made.depth) >= LEAST_PSNR
    assert psnr(shown["normal"][both], normal[both]) >= LEAST_PSNR
