"""Cameras of a quilt against Mitsuba's own perspective cameras, and quilts as they are rendered."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh

import lippmann
from lippmann.display import NUMPY, Display, LensArray, Panel, load_display
from lippmann.display.sheet_layout import trim_of, with_margin
from lippmann.display.view_cone import cone_tangent
from lippmann.errors import PictureError, UsageError
from lippmann.options.placement import PlacementOptions
from lippmann.quilts.quilt import quilt_of_display
from lippmann.quilts.weave import view_fraction, weave

pytestmark = pytest.mark.usefixtures("engine")

#: A placement that moves, turns and scales.
WORLD = np.array([[0.0, -2.0, 0.0, 5.0], [2.0, 0.0, 0.0, -7.0], [0.0, 0.0, 2.0, 1.0], [0.0, 0.0, 0.0, 1.0]])
SHEET = Display(
    "sheet",
    Panel(75, 100, 0.3),
    LensArray("lenticular", 1.9, slant=9.46),
    3.1,
    viewing_distance=240.0,
    aperture_distance=20.0,
)
COLUMNS, ROWS, VIEW = 3, 4, (15, 20)


def rays_of(display=SHEET, jitter=(0.5, 0.5), columns=COLUMNS, rows=ROWS, view=VIEW):
    """Origins and directions ``(H, W, 3)`` of all pixels."""
    import mitsuba as mi

    from lippmann.rendering.transport.ray_source import QuiltRays

    source = QuiltRays(display, WORLD, columns, rows, view)
    row, column = (mi.UInt32(part.ravel()) for part in np.indices((source.height, source.width)))
    ray = source.rays(column, row, mi.UInt32(0), mi.Point2f(*jitter))
    return source, *(np.array(part).T.reshape(source.height, source.width, 3) for part in (ray.o, ray.d))


def mitsuba_camera(x, display=SHEET, view=VIEW):
    """Mitsuba's perspective camera at (x, 0, D), looking straight ahead, off-axis to the panel's rectangle."""
    import mitsuba as mi

    width = display.size_mm[0]
    film = {"type": "hdrfilm", "width": view[0], "height": view[1], "rfilter": {"type": "box"}}
    scale = float(np.cbrt(np.linalg.det(WORLD[:3, :3])))
    pose = WORLD @ np.array([[-1, 0, 0, x], [0, 1, 0, 0], [0, 0, -1, display.viewing_distance], [0, 0, 0, 1.0]])
    pose[:3, :3] /= scale  # Mitsuba's cameras look along +z, with +x to the left, and have no scale
    return mi.load_dict(
        {
            "type": "perspective",
            "to_world": mi.ScalarTransform4d(pose),
            "fov": math.degrees(2 * math.atan(width / 2 / display.viewing_distance)),
            "fov_axis": "x",
            # In parts of the picture's width: the film moves against the camera.
            "principal_point_offset_x": -x / width,
            "near_clip": scale * (display.viewing_distance - display.aperture_distance),
            "far_clip": 1e6,
            "film": film,
        }
    )


@pytest.mark.parametrize("jitter", [(0.5, 0.5), (0.1, 0.9)])
def test_every_tile_is_an_off_axis_camera_of_mitsuba(jitter):
    import mitsuba as mi

    source, origins, directions = rays_of(jitter=jitter)
    half = SHEET.viewing_distance * 0.5 * SHEET.micro_image_pitch / (SHEET.gap * math.cos(math.radians(9.46)))
    row, column = np.indices((VIEW[1], VIEW[0]))
    place = np.stack([(column + jitter[0]) / VIEW[0], (row + jitter[1]) / VIEW[1]]).reshape(2, -1)
    views = COLUMNS * ROWS
    for number in range(views):
        sensor = mitsuba_camera(half * (2 * (number + 0.5) / views - 1))
        ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f(place.astype(np.float32)), mi.Point2f(0.5, 0.5))
        # View 0 is at the bottom left.
        across, below = number % COLUMNS, ROWS - 1 - number // COLUMNS
        tile = slice(below * VIEW[1], (below + 1) * VIEW[1]), slice(across * VIEW[0], (across + 1) * VIEW[0])
        np.testing.assert_allclose(directions[tile].reshape(-1, 3), np.array(ray.d).T, atol=2e-6)
        # Mitsuba's rays begin at the near plane, ours where the display's begin: the same plane.
        np.testing.assert_allclose(origins[tile].reshape(-1, 3), np.array(ray.o).T, atol=2e-3)
    assert [tuple(part.start for part in tile) for tile in source.tiles()][:4] == [
        (60, 0),
        (60, 15),
        (60, 30),
        (40, 0),
    ]


@pytest.mark.parametrize("slant", [0.0, 9.46, -12.0])
@pytest.mark.parametrize("distance", [240.0, math.inf])
def test_a_camera_sees_its_own_part_of_the_cone(distance, slant):
    """Through every lens the camera of view k sees the panel where weaving puts view k: at (k + 0.5) / N."""
    display = replace(SHEET, viewing_distance=distance, lens_array=LensArray("lenticular", 1.9, slant=slant))
    views = 12
    for number in range(views):
        tangent = (2 * (number + 0.5) / views - 1) * cone_tangent(display)
        rng = np.random.default_rng(number)
        x, y = (rng.uniform(-side / 2, side / 2, 50) for side in display.size_mm)
        far = min(distance, 1e9)
        seen = display.visible_panel_point(far * tangent, 0.0, far, x, y, NUMPY)
        # Level cameras: off the lens's axis the height counts, which the weaving takes from the lens plane.
        np.testing.assert_allclose(view_fraction(display, *seen), (number + 0.5) / views, atol=1e-6)


def test_parallel_cameras_for_a_display_without_viewing_distance():
    _, origins, directions = rays_of(replace(SHEET, viewing_distance=math.inf))
    first = directions[-1, 0]
    np.testing.assert_allclose(directions[-VIEW[1] :, : VIEW[0]], np.broadcast_to(first, (20, 15, 3)), atol=1e-6)
    assert np.ptp(origins[-VIEW[1] :, : VIEW[0]].reshape(-1, 3), axis=0).max() > 20


def test_a_woven_quilt_of_a_sheet_meets_the_light_lines_of_its_trim():
    """Positions on a board behind the lens plane are linear in view and pixel: weaving interpolates them exactly."""
    sheet = with_margin(Display("sheet", Panel(60, 40, 0.5), LensArray("lenticular", 2.0), 3.0, "", 240.0), 10)
    board, place = trimesh.creation.box((30.0, 20.0, 0.1)), {"place": "fit", "shift": (0, 0, -20.0), "scale": 5.0}
    asked = {"integrator": "position", "spp": 1, "pixel_filter": "point", "placement": place}
    quilt = lippmann.render_quilt(board, sheet, views=(2, 2), size=(256, 256), **asked)
    assert quilt.layout.aspect == 1.5
    trim = trim_of(sheet)
    row, column = np.indices((sheet.panel.height, sheet.panel.width))[(slice(None), *trim.slices)] + 0.5
    x, y = sheet.subpixel_point(column, row, 0)
    fraction = view_fraction(sheet, x, y)
    (ox, oy, oz), (dx, dy, dz) = sheet.light_ray(x, y, NUMPY)
    (height,) = np.unique(quilt.pixels[..., 2].round(3))
    # Inside of the outermost cameras, and of the outermost pixels of their views.
    inner = (fraction > 1 / 8) & (fraction < 7 / 8)
    inner[:, :1], inner[:, -1:] = False, False
    woven = weave(quilt, sheet, choice="linear").pixels[trim.slices]
    np.testing.assert_allclose(woven[inner, 0], (ox + dx * (height - oz) / dz)[inner], atol=1e-3)
    np.testing.assert_allclose(woven[..., 1], oy + dy * (height - oz) / dz, atol=1e-3)


def small_quilt(**options):
    return lippmann.render_quilt("teapot", SHEET, views=(3, 4), size=(256, 256), **({"tone_map": "none"} | options))


@pytest.mark.slow
def test_a_quilt_is_the_direct_pictures_of_its_cameras():
    """Normals of the first surface: Mitsuba's camera, traced apart, sees the same in every view."""
    import mitsuba as mi

    from lippmann.device.pbr import build
    from lippmann.scene.placement import place

    scene = lippmann.load_scene("teapot")
    quilt = lippmann.render_quilt(
        scene, SHEET, views=(3, 4), size=(256, 256), integrator="normal", spp=1, pixel_filter="point"
    )
    at = place(
        scene.bounds,
        SHEET,
        cameras=scene.cameras,
        home_camera=scene.home_camera,
        contains_home=scene.home_may_move,
        bounds_in=scene.bounds_in,
        extreme_points=lambda: scene.extreme_points,
    )
    built = build(scene)
    rotation = np.linalg.inv(at.world_from_display[:3, :3]) * np.cbrt(np.linalg.det(at.world_from_display[:3, :3]))
    width, height = quilt.view_size
    assert (width, height) == (85, 64)
    row, column = np.indices((height, width))
    x = ((column + 0.5) / width - 0.5).ravel() * SHEET.size_mm[0]
    y = (0.5 - (row + 0.5) / height).ravel() * SHEET.size_mm[1]
    for number in (0, 5, 11):
        eye = SHEET.viewing_distance * cone_tangent(SHEET) * (2 * (number + 0.5) / 12 - 1)
        start = 1 - SHEET.aperture_distance / SHEET.viewing_distance
        target = np.stack([x, y, np.zeros_like(x), np.ones_like(x)])
        origin = np.stack([eye + (x - eye) * start, y * start, np.full_like(x, 20.0), np.ones_like(x)])
        o, p = (np.asarray(at.world_from_display @ points)[:3] for points in (origin, target))
        d = (p - o) / np.linalg.norm(p - o, axis=0)
        found = built.mitsuba.ray_intersect(mi.Ray3f(mi.Point3f(o.astype("f4")), mi.Vector3f(d.astype("f4"))))
        normal = (rotation @ np.array(mi.Vector3f(found.sh_frame.n))).T.reshape(height, width, 3)
        hit = np.array(found.is_valid()).reshape(height, width)
        assert hit.mean() > 0.2
        shown = quilt.view(number)
        same = (np.abs(shown - normal).max(axis=-1) < 1e-3)[hit]
        flipped = (np.abs(shown + normal).max(axis=-1) < 1e-3)[hit]
        assert (same | flipped).mean() > 0.995


@pytest.mark.slow
def test_the_rest_of_the_sides_is_black_and_the_views_tell_their_error():
    quilt = small_quilt(spp=2, method="full", integrator="direct")
    assert quilt.pixels.shape == (256, 256, 3)
    assert (quilt.pixels[:, 255:] == 0).all()
    assert (quilt.pixels[:, :255].max(axis=-1) > 0).mean() > 0.9
    estimate = quilt.provenance.estimate
    assert estimate["worst"] <= estimate["psnr"] + 1
    assert estimate["worst_lens"][1] == 0
    assert estimate["worst_lens"][0] < 12
    _, _, width, height = quilt.provenance.options["window"]
    assert quilt.provenance.rays["primary"] == 12 * width * height * 2


def test_estimates_are_those_of_the_views():
    """One view is far noisier than the others, and is named."""
    from lippmann.rendering.estimate.denoised_psnr import PictureEstimator
    from lippmann.rendering.estimate.psnr import Parts, PixelErrors

    parts = Parts.views(3, 4, (20, 10))
    assert parts.owner[-1, 0] == 0
    assert parts.owner[0, -1] == 11
    errors = np.random.default_rng(1).chisquare(1, (40, 60)).astype(np.float32) * 1e-4
    errors[10:20, 20:40] *= 30
    found = PictureEstimator(parts).estimate(PixelErrors(errors), 64)
    assert found.worst_lens == (7, 0)
    assert found.worst == pytest.approx(-10 * math.log10(3e-3), abs=1.5)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_quilt_and_more_samples_a_better_one():
    first, again, other = (small_quilt(spp=4, integrator="direct", method="full", seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.pixels, again.pixels)
    assert not np.array_equal(first.pixels, other.pixels)
    fine = small_quilt(spp=24, integrator="direct", method="full", seed=5)
    coarse = np.mean(np.square(first.pixels - fine.pixels))
    assert np.mean(np.square(0.5 * (first.pixels + other.pixels) - fine.pixels)) < 0.7 * coarse


@pytest.mark.long
def test_noise_is_taken_out_view_by_view():
    fine = small_quilt(spp=64, seed=5).pixels
    noisy, clean = (small_quilt(spp=2, denoise=way).pixels for way in ("none", "oidn"))
    assert np.mean(np.square(clean - fine)) < 0.2 * np.mean(np.square(noisy - fine))


@pytest.mark.long
def test_a_woven_quilt_is_near_the_direct_picture():
    """Many views of a flat scene in and near the lens plane, woven: what the display's own rays see."""
    place = PlacementOptions(place="fit")
    options = {"integrator": "albedo", "spp": 16, "seed": 3}
    direct = lippmann.render("teapot", SHEET, subpixels=True, placement=PlacementOptions(place="fit"), **options)
    # A view as fine as the panel, 60 of them.
    quilt = lippmann.render_quilt("teapot", SHEET, views=(10, 6), size=(1500, 1200), placement=place, **options)
    woven = weave(quilt, SHEET)
    near = np.mean(np.square(woven.pixels - direct.pixels))
    # Mirrored order, or views as seen from the other side, are far off.
    turned = replace(quilt, values=np.ascontiguousarray(quilt.pixels[::-1, ::-1]).reshape(quilt.pixels.shape))
    assert near < 0.01
    assert np.mean(np.square(weave(turned, SHEET).pixels - direct.pixels)) > 5 * near


def test_the_quilts_of_devices_are_known_by_name_serial_and_calibration():
    portrait = load_display("portrait")
    assert quilt_of_display(portrait)[:3] == ("looking-glass-portrait", 3360, 3360)
    assert quilt_of_display(portrait).layout.ending == "_qs8x6a0.75"
    serial = replace(portrait, name="LKG-E00042")
    assert quilt_of_display(serial)[1:3] == (4092, 4092)
    landscape = load_display("16-gen3-landscape")
    assert quilt_of_display(landscape).layout[:2] == (7, 7)
    assert quilt_of_display(landscape, (8, 6))[1:3] == (7680, 4320)
    assert quilt_of_display(portrait, size=(1680, 1680)).layout[:2] == (8, 6)
    with pytest.raises(UsageError, match="no quilt is known"):
        quilt_of_display(SHEET)
    with pytest.raises(UsageError, match=r"say views=\.\.\., too"):
        quilt_of_display(SHEET, size=(800, 800))
    with pytest.raises(UsageError, match="no quilt of 9x9 views"):
        quilt_of_display(portrait, (9, 9))
    with pytest.raises(UsageError, match="1 to 32"):
        quilt_of_display(portrait, (64, 1), (640, 640))
    with pytest.raises(PictureError, match="no multiple of 8"):
        quilt_of_display(portrait, size=(1681, 1680))


def test_what_cannot_be_a_quilt_is_refused():
    with pytest.raises(PictureError, match="has square lenses"):
        lippmann.render_quilt("teapot", "mla-square", views=(4, 4), size=(400, 400))
