"""Pixels of one diffuse surface, told from those that mix several."""

from __future__ import annotations

import numpy as np


def test_a_pixel_whose_mean_lies_off_its_middle_shows_several_surfaces(engine):
    import mitsuba as mi

    from lippmann.device.pbr.diffuse_pixels import DiffusePixels

    # A wall in the plane z = 0. The second pixel shows, beside it, something 1 mm before it that faces the same way.
    scene = mi.load_dict({"type": "scene", "wall": {"type": "rectangle", "bsdf": {"type": "diffuse"}}})
    height, normal = np.array([[0.0, 0.3]], np.float32), np.tile(np.array([0, 0, 1], np.float32), (1, 2, 1))

    def rays(column, row, channel, point):
        return mi.Ray3f(mi.Point3f(0.25, 0, 5), mi.Vector3f(0, 0, -1))

    pixels = DiffusePixels(scene, rays, np.eye(4), height, normal, np.ones((1, 2, 3), np.float32))
    pixel = mi.UInt32([0, 1])
    ray, up = pixels.ray(pixel), pixels.normal(pixel)
    is_one = pixels.is_diffuse(ray, up, pixels.point(pixel, ray), mi.Float(0.8))
    assert list(is_one) == [True, False]
