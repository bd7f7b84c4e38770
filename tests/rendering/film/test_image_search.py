"""Images of small emitters: found where rays that are reflected one by one say that they are."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")

SIDE = 24
#: The emitter: its middle and radius.
AT, RADIUS = np.array([0.8, 0.9, 1.4]), 0.03


def scene(surface, *, radius=RADIUS, at=AT):
    import mitsuba as mi

    return mi.load_dict(
        {
            "type": "scene",
            "ball": {"type": "sphere", "radius": 0.5, "bsdf": surface},
            "floor": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().translate([0, 0, -1]).scale(4),
                "bsdf": {"type": "diffuse"},
            },
            "emitter": {
                "type": "sphere",
                "center": at.tolist(),
                "radius": radius,
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 50.0}},
            },
        }
    )


def mirror():
    return {"type": "conductor", "material": "Al"}


def eye(side=SIDE):
    from lippmann.rendering.transport.ray_source import CameraRays
    from lippmann.scene.values.description import Camera

    pose = np.eye(4)
    pose[2, 3] = 4.0
    return CameraRays(Camera("eye", pose, fov_y=0.35), side, side)


def found(images):
    """Of pixels with boxes: ``{pixel: (boxes, 4)}``."""
    if images is None:
        return {}
    row, number, boxes = np.array(images._row), np.array(images._number), np.array(images._boxes).reshape(-1, 8, 4)
    return {int(pixel): boxes[row[pixel] - 1, : number[row[pixel]]] for pixel in np.flatnonzero(row)}


def searched(scene, source=None, samples=16, memory=1 << 30):
    from lippmann.rendering.film.image_search import search_images

    return search_images(scene, source or eye(), samples, memory)


def shown(scene, source, pixel, box, fineness=64):
    """Share of the points of a box from which a mirrored ray meets the emitter: ray by ray, for one mirror."""
    import mitsuba as mi

    at = (np.arange(fineness) + 0.5) / fineness
    x, y = (part.ravel().astype(np.float32) for part in np.meshgrid(at, at))
    x, y = box[0] + (box[2] - box[0]) * x, box[1] + (box[3] - box[1]) * y
    row, column = divmod(pixel, source.width)
    ray = source.rays(
        mi.UInt32(np.full(len(x), column, np.uint32)),
        mi.UInt32(np.full(len(x), row, np.uint32)),
        mi.UInt32(0),
        mi.Point2f(x, y),
    )
    si = scene.ray_intersect(ray)
    # The ball's normal is that of its points: the way from its middle, which is the origin.
    normal = np.array(si.p).T / np.linalg.norm(np.array(si.p).T, axis=1, keepdims=True)
    toward = np.array(ray.d).T
    away = toward - 2 * (toward * normal).sum(axis=1, keepdims=True) * normal
    way = AT - np.array(si.p).T
    along = (way * away).sum(axis=1, keepdims=True)
    missed = np.linalg.norm(way - along * away, axis=1)
    on_ball = np.abs(np.linalg.norm(np.array(si.p).T, axis=1) - 0.5) < 1e-3
    return float((on_ball & (along[:, 0] > 0) & (missed < RADIUS)).mean())


def test_the_image_in_a_ball_lies_in_its_box():
    mirrored, source = scene(mirror()), eye()
    boxes = found(searched(mirrored).images)
    whole = np.array([0, 0, 1, 1])
    seen = {pixel: shown(mirrored, source, pixel, whole, 512) for pixel in range(SIDE * SIDE)}
    lit = {pixel for pixel, share in seen.items() if share > 0}
    # The middle of one image lies in one pixel; what its edge has in the next is left to chance.
    assert len(boxes) == 1
    (pixel,) = boxes
    assert pixel in lit
    assert seen[pixel] == max(seen.values())
    (box,) = boxes[pixel]
    area = float(np.prod(box[2:] - box[:2]))
    assert area < 0.25
    # As large as a square about a circle 1.5 times as wide as the image, cut by the pixel's edges.
    inside = shown(mirrored, source, pixel, box, 128)
    assert inside * area == pytest.approx(seen[pixel], rel=0.1)
    assert inside > 0.25


@pytest.mark.parametrize(
    "surface",
    [
        {"type": "dielectric", "int_ior": 1.5},
        {"type": "plastic", "diffuse_reflectance": {"type": "rgb", "value": 0.3}},
    ],
)
def test_glass_and_glaze_show_images_too(surface):
    assert found(searched(scene(surface), samples=64).images)


def test_emitters_seen_directly_are_found():
    beside = np.array([0.55, 0.02, 0.0])
    small = searched(scene({"type": "diffuse"}, radius=0.002, at=beside), samples=64)
    (pixel,) = found(small.images)
    assert divmod(pixel, SIDE)[0] == SIDE // 2 - 1
    # A large one fills pixels, and needs no box.
    large = searched(scene({"type": "diffuse"}, radius=0.2, at=beside), samples=64)
    assert large.images is None
    assert large.none_small
    assert not small.none_small


def test_where_nothing_is_mirrored_nothing_is_found():
    matt = searched(scene({"type": "diffuse"}))
    assert matt.images is None
    assert matt.none_small
    # The emitter stands behind the floor.
    hidden = searched(scene(mirror(), at=np.array([0.8, 0.9, -1.4])))
    assert hidden.images is None


def test_without_memory_it_is_not_known():
    search = searched(scene(mirror()), memory=1 << 20)
    assert search.images is None
    assert not search.none_small


def test_scenes_without_emitters_of_a_size_have_none():
    import mitsuba as mi

    def under(sky):
        ball = {"type": "sphere", "bsdf": mirror()}
        return searched(mi.load_dict({"type": "scene", "ball": ball, "sky": sky}))

    even = under({"type": "constant"})
    assert even.none_small
    # Of a sky that differs, images are not looked for.
    uneven = under({"type": "envmap", "bitmap": mi.Bitmap(np.ones((4, 8, 3), np.float32))})
    assert not uneven.none_small


def test_it_finds_the_same_in_wavefronts_of_any_size(monkeypatch):
    from lippmann.rendering.film import memory_model

    mirrored, source = scene(mirror(), radius=0.005), eye(64)
    whole = found(searched(mirrored, source).images)
    monkeypatch.setattr(memory_model, "preferred_lanes", lambda: 1000)
    monkeypatch.setattr(memory_model, "SMALLEST_LANES", 1)
    parts = found(searched(mirrored, source).images)
    assert whole.keys() == parts.keys()
    assert whole
    for pixel, boxes in whole.items():
        np.testing.assert_array_equal(boxes, parts[pixel])


@pytest.mark.parametrize("colors", [False, True])
def test_boxes_are_those_of_the_pixels_behind_lenses(colors):
    """Rays through a box meet the emitter by way of the ball, by pixels and by sub-pixels."""
    import mitsuba as mi

    from lippmann.display import Display, LensArray, Panel
    from lippmann.rendering.transport.ray_source import DisplayRays, PixelRays, SubpixelRays

    panel = Panel(384, 192, 0.0125)
    display = Display("test", panel, LensArray("lenticular", 0.1, slant=0.1), 0.25, "", 300.0, 5.0)
    world_from_display = np.eye(4)
    world_from_display[:3, :3] *= 0.5
    source = DisplayRays(display, world_from_display, subpixels=colors)
    mirrored = scene(mirror(), radius=0.006)
    images = searched(mirrored, source, samples=64).images
    boxes = found(images)
    assert len(boxes) >= 2
    shares = []
    for place, (box, *_) in boxes.items():
        at = (np.arange(16) + 0.5) / 16
        x, y = (part.ravel().astype(np.float32) for part in np.meshgrid(at, at))
        pixel, channel = divmod(place, source.channels)
        row, column = divmod(pixel, source.width)
        lanes = [mi.UInt32(np.full(len(x), value, np.uint32)) for value in (column, row, channel)]
        rays = PixelRays(source, *lanes)
        assert set(np.array(rays.number)) == {place}
        ray = rays.through(mi.Point2f(box[0] + (box[2] - box[0]) * x, box[1] + (box[3] - box[1]) * y))
        si = mirrored.ray_intersect(ray)
        away = si.spawn_ray(si.to_world(mi.reflect(si.wi)))
        met = mirrored.ray_intersect(away)
        shares.append(np.array(met.is_valid() & met.shape.is_emitter()).mean())
    # A square about a circle 1.5 times as wide as the image has a third of it within; ways by two events have none.
    assert np.median(shares) > 0.2
    if colors:
        wide = SubpixelRays(source)
        column, row = mi.UInt32([0, 1, 2, 5]), mi.UInt32([3] * 4)
        assert sorted(np.array(wide.number(column, row)) - 3 * 384 * 3) == [0, 1, 2, 5]
