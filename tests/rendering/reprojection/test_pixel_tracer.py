"""Tracing lists of pixels into a point image."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")


class Wall:
    """An integrator that sees a wall at height ``z`` of the display, whose colour is where it is met."""

    name, depth = "wall", 1

    def __init__(self, z, edge=None):
        self.z, self.edge = z, edge

    def sample_with_hit(self, ray, stream, active):
        import drjit as dr
        import mitsuba as mi

        from lippmann.rendering.transport.integrator import FirstHit, RayCounts

        # World and display are the same here.
        distance = (self.z - ray.o.z) / ray.d.z
        p = ray(distance)
        if self.edge is not None:
            distance = dr.select(p.x < self.edge, distance, dr.inf)
        one = dr.full(mi.UInt32, 1, dr.width(p))
        color = mi.Color3f(p.x, p.y, dr.select(p.x > 5, dr.nan, 1))
        return color, RayCounts(one, one * 2), FirstHit(distance, p.y > 0)


def tracer_of(integrator, samples=1, box_filter=False, most_lanes=1 << 20):
    from lippmann.display import Display, LensArray, Panel
    from lippmann.rendering.reprojection.pixel_tracer import PixelTracer
    from lippmann.rendering.transport.ray_source import DisplayRays
    from lippmann.runtime.row_threads import Bands

    display = Display("w", Panel(16, 6, 1.0), LensArray("lenticular", 8.0), 4.0, aperture_distance=30.0)
    source = DisplayRays(display, np.eye(4))
    return display, PixelTracer(
        integrator,
        source,
        samples=samples,
        seed=3,
        box_filter=box_filter,
        most_lanes=most_lanes,
        display_from_world=np.eye(4),
        bands=Bands(1),
    )


def test_points_colors_and_rays_are_entered():
    from lippmann.rendering.reprojection.point_image import MISSED, TRACED, PointImage

    display, tracer = tracer_of(Wall(-20.0))
    points = PointImage.empty(6, 16)
    numbers = np.array([0, 3, 17, 47, 90], np.uint32)
    tracer.trace(numbers, points)
    row, column = np.divmod(numbers.astype(int), 16)
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(*display.panel_point(column + 0.5, row + 0.5))
    t = (-20.0 - oz) / dz
    x, y = ox + t * dx, oy + t * dy
    finite = x <= 5
    assert finite.any()
    assert not finite.all()
    assert np.allclose(points.color[row, column], np.stack([x, y, 1 + 0 * x], -1) * finite[:, None], atol=1e-4)
    assert np.allclose(points.disparity[row, column], 4.0 / -20.0, rtol=1e-5)
    assert np.array_equal(points.fragile[row, column], y > 0)
    assert np.all(points.status[row, column] == TRACED)
    assert np.count_nonzero(points.status == MISSED) == 96 - 5
    rays = tracer.rays
    assert (rays.primary, rays.secondary, rays.shadow, rays.discarded) == (5, 5, 10, np.count_nonzero(~finite))


def test_a_pixel_of_several_surfaces_is_fragile_and_takes_the_nearest():
    from lippmann.rendering.reprojection.point_image import BACKGROUND, PointImage

    _, tracer = tracer_of(Wall(-20.0, edge=0.0), samples=16, box_filter=True)
    points = PointImage.empty(6, 16)
    tracer.trace(np.arange(96, dtype=np.uint32), points)
    below = slice(3, 6)  # not view-dependent there
    fragile, disparity = points.fragile[below], points.disparity[below]
    assert np.allclose(disparity[fragile], -0.2, rtol=1e-4)
    plain = disparity[~fragile]
    assert fragile.any()
    assert np.any(plain == np.float32(BACKGROUND))
    assert np.all(np.isclose(plain, -0.2, rtol=1e-4) | (plain == np.float32(BACKGROUND)))


def test_one_recording_serves_all_lists():
    """Telling the device anew what to compute takes longer than computing it."""
    from lippmann.rendering.reprojection.point_image import PointImage

    _, tracer = tracer_of(Wall(-20.0))
    points = PointImage.empty(6, 16)
    everything = np.arange(96, dtype=np.uint32)
    for start, stop in ((0, 96), (1, 40), (2, 5), (5, 90), (7, 8)[:2], (3, 64)):
        tracer.trace(everything[start:stop], points)
    # A list of one is another kernel: there everything is the same for all lanes.
    assert tracer._kernel._recorded.n_recordings <= 2


def test_lists_longer_than_a_wavefront_are_traced_in_parts():
    from lippmann.rendering.reprojection.point_image import PointImage

    pictures = []
    for most in (1 << 20, 40):
        _, tracer = tracer_of(Wall(-20.0), samples=4, box_filter=True, most_lanes=most)
        points = PointImage.empty(6, 16)
        tracer.trace(np.arange(96, dtype=np.uint32), points)
        assert tracer.rays.primary == 96 * 4
        pictures.append(points)
    for one, other in zip(*pictures, strict=True):
        assert np.array_equal(one, other)


def test_nothing_to_trace():
    from lippmann.rendering.reprojection.point_image import PointImage

    _, tracer = tracer_of(Wall(-20.0))
    tracer.trace(np.empty(0, np.uint32), PointImage.empty(6, 16))
    assert tracer.rays.primary == 0
