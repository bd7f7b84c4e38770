"""Scenes whose integral images can be written down by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from handmade_display import APERTURE, Sheet

from lippmann.options.placement import PlacementOptions

pytestmark = pytest.mark.usefixtures("engine")

STRAIGHT = Sheet("lenticular", across=8, width=24 * 8, height=60)
# Three rows down is one pixel across.
SLANTED = Sheet("lenticular", across=8, width=20 * 8, height=60, tangent=1 / 3)
SQUARE = Sheet("square", across=8, down=8, width=20 * 8, height=14 * 8)
HEXAGONAL = Sheet("hexagonal", across=8, down=7, width=20 * 8, height=16 * 7)
SHEETS = {"straight": STRAIGHT, "slanted": SLANTED, "square": SQUARE, "hexagonal": HEXAGONAL}
DISTANCES = [math.inf, 400.0]

RGB_STRIPE = ((-1 / 3, 0.0), (0.0, 0.0), (1 / 3, 0.0))


def glowing_ball(center, radius, color=(1.0, 1.0, 1.0)):
    return {
        "type": "sphere",
        "center": list(center),
        "radius": radius,
        "bsdf": {"type": "diffuse", "reflectance": 0.0},
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": list(color)}},
    }


def shown(objects, display, **options):
    """The integral image of objects placed in the display's own frame; every pixel is what its centre's ray meets."""
    from lippmann.api import load_scene, render

    scene = load_scene({"type": "scene"} | objects, background=(0.0, 0.0, 0.0))
    placement = PlacementOptions(place="display")
    defaults = {
        "placement": placement,
        "integrator": "path",
        "depth": 1,
        "spp": 1,
        "pixel_filter": "point",
        "method": "full",
    }
    return render(scene, display, **(defaults | options))


# ---- A white furnace -----------------------------------------------------------------------------------------------


def furnace(ball):
    return {"sky": {"type": "constant", "radiance": 1.0}, "ball": ball}


@pytest.mark.slow
@pytest.mark.parametrize("name", SHEETS)
def test_glow_of_one_before_a_sky_of_one_is_one_exactly(name):
    from lippmann.api import load_scene, render

    scene = load_scene({"type": "scene"} | furnace(glowing_ball((3, 2, -10), 12)))
    picture = render(
        scene,
        SHEETS[name].display(),
        placement=PlacementOptions(place="display"),
        spp=3,
        subpixels=name == "slanted",
        tone_map="none",
    )
    assert np.abs(picture.pixels - 1).max() <= 2e-7


@pytest.mark.slow
@pytest.mark.parametrize("name", SHEETS)
def test_white_furnace_is_one_in_every_pixel(name):
    from lippmann.api import load_scene, render

    white = {"type": "sphere", "center": [3, 2, -10], "radius": 12, "bsdf": {"type": "diffuse", "reflectance": 1.0}}
    picture = render(
        load_scene({"type": "scene"} | furnace(white)),
        SHEETS[name].display(),
        placement=PlacementOptions(place="display"),
        spp=64,
        tone_map="none",
    )
    # Lamps and lobes are both sampled: means of 64 scatter by 1 % on the ball, and 14 000 pixels within 6 times that.
    assert np.abs(picture.pixels - 1).max() < 0.1
    assert picture.pixels.mean() == pytest.approx(1.0, abs=5e-4)
    assert (picture.pixels != 1).any()


# ---- One small ball ------------------------------------------------------------------------------------------------


def panel_points(sheet, offset=(0.0, 0.0)):
    """``(height * width, 2)`` centres of the (sub-)pixels in mm."""
    column, row = np.meshgrid(np.arange(sheet.width), np.arange(sheet.height))
    x = (column + 0.5 + offset[0] - sheet.width / 2) * sheet.pixel
    y = (sheet.height / 2 - row - 0.5 - offset[1]) * sheet.pixel
    return np.stack([x, y], axis=-1).reshape(-1, 2)


def lines_at(sheet, points, z):
    """``(n, 2)`` where the light lines of panel points are at height ``z``, and where that is clear.

    The line runs from the panel point q through the lens's centre c: at z it is at c + (c - q) z / g. Along a
    cylindrical lens it makes for the viewer's height 0 at D, or runs on level: v (D - z) / (D + g).
    """
    lens, clear = sheet.nearest_lens(points / sheet.stretch)
    if sheet.layout != "lenticular":
        return lens + (lens - points) * z / sheet.gap, clear
    u, v = sheet.to_axes(points).T
    c = lens[:, 0]
    fade = 1.0 if math.isinf(sheet.distance) else (sheet.distance - z) / (sheet.distance + sheet.gap)
    return sheet.from_axes(np.stack([c + (c - u) * z / sheet.gap, v * fade], axis=-1)), clear


def ball_seen(sheet, center, radius, offset=(0.0, 0.0)):
    """``(height * width)``: 1 where a pixel shows the ball, 0 where not, nan where a thousandth of a mm decides."""
    points = panel_points(sheet, offset)
    here, clear = lines_at(sheet, points, center[2])
    there, _ = lines_at(sheet, points, center[2] + 1.0)
    along = np.concatenate([there - here, np.ones((len(here), 1))], axis=1)
    away = np.concatenate([np.array(center[:2]) - here, np.zeros((len(here), 1))], axis=1)
    distance = np.linalg.norm(np.cross(along, away), axis=1) / np.linalg.norm(along, axis=1)
    return np.where(clear & (np.abs(distance - radius) > 1e-3), distance < radius, np.nan)


@pytest.mark.slow
@pytest.mark.parametrize("height", [22.0, -31.0])
@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("name", SHEETS)
def test_a_small_ball_lights_the_pixels_worked_out_by_hand(name, distance, height):
    sheet = replace(SHEETS[name], distance=distance)
    center, radius = (4.3, -2.7, height), 1.3
    offsets = RGB_STRIPE if name == "slanted" else ((0.0, 0.0),)
    pixels = shown({"ball": glowing_ball(center, radius)}, sheet.display(), subpixels=name == "slanted").pixels
    for channel, offset in enumerate(offsets):
        wanted = ball_seen(sheet, center, radius, offset)
        sure = np.isfinite(wanted)
        assert sure.mean() > 0.95
        assert wanted[sure].sum() > 10
        assert np.array_equal(pixels[..., channel].reshape(-1)[sure], wanted[sure])


@pytest.mark.slow
@pytest.mark.parametrize("height", [22.0, -31.0])
@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("name", ["square", "hexagonal"])
def test_each_lens_shows_a_point_where_its_line_through_the_centre_meets_the_panel(name, distance, height):
    """Behind a lens at c, a point P is shown at c + (c - P) g / z, if that is in the lens's own micro-image."""
    sheet = replace(SHEETS[name], distance=distance)
    center = np.array([4.3, -2.7])
    # Large enough to be met by the ray of the pixel that holds the point, wherever in it the point lies.
    radius = 0.75 * sheet.pixel * abs(height) / sheet.gap
    pixels = shown({"ball": glowing_ball((*center, height), radius)}, sheet.display()).pixels[..., 0]
    lenses = 0
    for lens in sheet.centers():
        spot = lens + (lens - center) * sheet.gap / height
        column, row = (
            math.floor(spot[0] / sheet.pixel + sheet.width / 2),
            math.floor(sheet.height / 2 - spot[1] / sheet.pixel),
        )
        if not (0 <= column < sheet.width and 0 <= row < sheet.height):
            continue
        middle = panel_points(sheet)[row * sheet.width + column]
        owner, clear = sheet.nearest_lens(middle[None] / sheet.stretch)
        if clear[0] and np.abs(owner[0] - lens).max() < 1e-6:
            lenses += 1
            assert pixels[row, column] == 1, lens
    assert lenses >= 4
    # No lens shows more of it than its size allows, and nothing else glows.
    assert pixels.sum() < lenses * 1.2 * math.pi * (radius * sheet.gap / (abs(height) * sheet.pixel)) ** 2 + 10


@pytest.mark.parametrize("name", SHEETS)
def test_rays_begin_at_the_aperture(name):
    sheet = SHEETS[name]
    behind, cut = ((0.2, 0.1, APERTURE + offset) for offset in (-2.0, 2.0))
    assert shown({"ball": glowing_ball(behind, 1.5)}, sheet.display()).pixels.max() == 1
    assert shown({"ball": glowing_ball(cut, 1.5)}, sheet.display()).pixels.max() == 0


# ---- A picture in the lens plane -----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("name", SHEETS)
def test_a_picture_in_the_lens_plane_looks_the_same_from_everywhere(name, distance):
    """All pixels of a lens show what lies at its centre; red grows to the right there, green upward."""
    import mitsuba as mi

    sheet = replace(SHEETS[name], distance=distance)
    half = 80.0
    ramp = (np.arange(64) + 0.5) / 64
    picture = np.zeros((64, 64, 3), dtype=np.float32)
    picture[..., 0], picture[..., 1] = ramp, ramp[:, None]
    plane = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().scale([half, half, 1]),
        "bsdf": {"type": "diffuse", "reflectance": 0.0},
        "emitter": {
            "type": "area",
            "radiance": {"type": "bitmap", "bitmap": mi.Bitmap(picture), "raw": True, "filter_type": "bilinear"},
        },
    }
    image = shown({"plane": plane}, sheet.display(), subpixels=False)
    at, clear = lines_at(sheet, panel_points(sheet), 0.0)
    wanted = np.zeros((len(at), 3))
    wanted[:, :2] = (at + half) / (2 * half)
    assert np.abs(image.pixels.reshape(-1, 3) - wanted)[clear].max() < 1e-5
    if name in ("straight", "square"):
        views = image.views()
        assert np.abs(views - views[:1, :1]).max() < 1e-5


# ---- Mirrors and shifts --------------------------------------------------------------------------------------------

BALLS = [
    ((-14.0, 6.0, 12.0), 4.0, (1.0, 0.25, 0.0)),
    ((3.0, -5.0, -8.0), 6.5, (0.0, 0.5, 1.0)),
    ((17.3, 4.1, -26.0), 5.2, (0.5, 0.75, 0.125)),
    ((1.9, 9.7, 31.0), 2.1, (1.0, 1.0, 1.0)),
]


def balls(move=lambda center: center):
    return {f"ball_{number}": glowing_ball(move(np.array(ball[0])), *ball[1:]) for number, ball in enumerate(BALLS)}


def clear_pixels(sheet, subpixels=False):
    """``(height, width)``: whether no (sub-)pixel lies on a line between lenses."""
    clear = [sheet.nearest_lens(panel_points(sheet, offset) / sheet.stretch)[1] for offset in RGB_STRIPE]
    chosen = np.all(clear, axis=0) if subpixels else clear[1]
    return chosen.reshape(sheet.height, sheet.width)


@pytest.mark.slow
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("name", SHEETS)
def test_mirroring_the_scene_mirrors_the_picture(name, distance, axis):
    """The mirror of a slanted sheet leans the other way, and its sub-pixels stand the other way round."""
    sheet = replace(SHEETS[name], distance=distance)
    display = sheet.display()
    mirrored = replace(sheet, tangent=-sheet.tangent).display()
    if axis == 0:
        stripe = tuple((-right, down) for right, down in RGB_STRIPE)
        mirrored = replace(mirrored, panel=replace(mirrored.panel, subpixel_offsets=stripe))
    factors = np.array([-1.0, 1.0, 1.0] if axis == 0 else [1.0, -1.0, 1.0])
    subpixels = name == "slanted"
    one = shown(balls(), display, subpixels=subpixels).pixels
    other = shown(balls(lambda center: factors * center), mirrored, subpixels=subpixels).pixels
    clear = clear_pixels(sheet, subpixels)
    assert clear.mean() > 0.8
    assert (one > 0).mean() > 0.03
    assert np.array_equal(np.flip(other, axis=1 - axis)[clear], one[clear])
    assert not np.array_equal(other, one)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "columns", "rows"),
    [
        ("straight", 8, 0),
        ("straight", 0, 1),
        ("square", 8, 0),
        ("square", 0, 8),
        ("hexagonal", 8, 0),
        ("hexagonal", 4, 7),
    ],
)
def test_shifting_the_scene_by_one_lens_shifts_the_picture_by_one_lens(name, columns, rows):
    """Where the viewer is infinitely far away; of a sheet's row of pixels every one is like the next."""
    sheet = SHEETS[name]
    shift = np.array([columns * sheet.pixel, -rows * sheet.pixel, 0.0])
    one = shown(balls(), sheet.display()).pixels
    other = shown(balls(lambda center: center + shift), sheet.display()).pixels
    height, width = sheet.height - rows, sheet.width - columns
    assert np.array_equal(other[rows:, columns:], one[:height, :width])
    assert not np.array_equal(other[:height, :width], one[:height, :width])


# ---- What an eye makes of it ---------------------------------------------------------------------------------------

DENSE = {
    "straight": Sheet("lenticular", across=20, width=80 * 20, height=60, pixel=0.1, gap=5.0),
    "slanted": Sheet("lenticular", across=20, width=80 * 20, height=60, pixel=0.1, gap=5.0, tangent=1 / 3),
    "square": Sheet("square", across=20, down=20, width=80 * 20, height=5 * 20, pixel=0.1, gap=5.0),
    "hexagonal": Sheet("hexagonal", across=20, down=17, width=80 * 20, height=6 * 17, pixel=0.1, gap=5.0),
}


@pytest.mark.slow
@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("name", DENSE)
def test_the_replayed_scene_is_orthoscopic(name, distance):
    """The near ball hides the far one and moves against the eye, the far one moves with it.

    An eye at (ex, ., ez) sees a point (0, ., Z) at -ex Z / (ez - Z) in the lens plane, and a ball's size there grown
    by ez / (ez - Z).
    """
    sheet = replace(DENSE[name], distance=distance)
    near, far, near_radius, far_radius = 20.0, -40.0, 6.0, 6.0
    objects = {
        "near": glowing_ball((0, 0, near), near_radius, (1, 0, 0)),
        "far": glowing_ball((0, 0, far), far_radius, (0, 1, 0)),
    }
    image = shown(objects, sheet.display())
    x = ((np.arange(800) + 0.5) / 800 - 0.5) * sheet.width * sheet.pixel
    eye_z = 400.0
    for eye_x in (-45.0, 0.0, 45.0):
        middle = image.replay((eye_x, 0.0, eye_z), size=(800, 25))[12]
        red, green = middle[:, 0] > 0.5, middle[:, 1] > 0.5
        near_x, far_x = (-eye_x * z / (eye_z - z) for z in (near, far))
        near_size, far_size = near_radius * eye_z / (eye_z - near), far_radius * eye_z / (eye_z - far)
        # Each edge is seen to a lens.
        lens = sheet.pitch
        assert (x[red].min(), x[red].max()) == pytest.approx((near_x - near_size, near_x + near_size), abs=lens)
        assert red[np.abs(x - near_x) < near_size - lens].all()
        if eye_x == 0:
            assert green.sum() == 0 or np.abs(x[green]).min() > near_size - lens
        else:
            side = math.copysign(1.0, eye_x)
            assert (side * x[green]).min() == pytest.approx(side * near_x + near_size, abs=lens)
            assert (side * x[green]).max() == pytest.approx(side * far_x + far_size, abs=lens)


# ---- Surfaces without holes ----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_no_ray_slips_through_between_triangles():
    """The rays of a straight sheet are level; here each row of them runs along the edges of a mesh."""
    from lippmann.api import load_scene, render
    from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription

    grid = np.arange(-80, 81) * STRAIGHT.pixel
    x, y = np.meshgrid(grid, grid + STRAIGHT.pixel / 2)
    positions = np.stack([x, y, -10 + 0.3 * np.sin(x)], axis=-1).reshape(-1, 3)
    corner = (np.arange(160)[:, None] * 161 + np.arange(160)).reshape(-1, 1)
    faces = np.add(corner, [0, 1, 162, 0, 162, 161]).reshape(-1, 3)
    mesh = Mesh("grid", positions.astype(np.float32), faces.astype(np.uint32), 0)
    scene = load_scene(SceneDescription("grid", [mesh], [Material()], [Instance(0, np.eye(4))]))
    for tangent in (0.0, 1e-9):
        display = replace(STRAIGHT, width=16 * 8, tangent=tangent).display()
        depth = render(
            scene, display, placement=PlacementOptions(place="display"), integrator="depth", spp=1, pixel_filter="point"
        ).pixels
        assert depth.max() < -9
