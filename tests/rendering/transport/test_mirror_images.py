"""Points of pixels that are aimed at boxes: their weights are one over the density, boxes or none."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytestmark = pytest.mark.usefixtures("engine")


def density(point, boxes):
    """The twin of the kernel: half evenly over the pixel, half evenly over one of its boxes."""
    from lippmann.rendering.transport.mirror_images import AIMED

    if not len(boxes):
        return 1.0
    within = [(low <= point).all() and (point <= high).all() for low, high in boxes]
    over = [inside / np.prod(high - low) for inside, (low, high) in zip(within, boxes, strict=True)]
    return (1 - AIMED) + AIMED * sum(over) / len(boxes)


def points(images, pixel, samples, seed=3):
    """``(pixels, samples, 2)`` points and ``(pixels, samples)`` weights."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.sobol import SampleStream

    pixel = np.repeat(np.asarray(pixel, np.uint32), samples)
    sample = np.tile(np.arange(samples, dtype=np.uint32), len(pixel) // samples)
    stream = SampleStream.of_pixels(mi.UInt32(pixel), mi.UInt32(sample), mi.UInt32(seed))
    point, weight = images.point(mi.UInt32(pixel), stream)
    dr.eval(point, weight)
    return np.array(point).T.reshape(-1, samples, 2), np.array(weight).reshape(-1, samples)


def images_of(boxes, pixels):
    """``boxes``: of each pixel that has some, a list of corners."""
    from lippmann.rendering.transport.mirror_images import MirrorImages

    pixel = [number for number, those in boxes.items() for _ in those]
    low, high = (np.array([box[k] for those in boxes.values() for box in those], np.float32) for k in (0, 1))
    return MirrorImages(pixels, np.array(pixel), low, high)


corners = st.tuples(*[st.tuples(st.floats(0, 0.9), st.floats(0.05, 0.3)) for _ in range(2)])


@settings(max_examples=25)
@given(st.lists(corners, min_size=1, max_size=8))
def test_weights_are_one_over_the_density(sides):
    from lippmann.rendering.transport.mirror_images import AIMED

    boxes = [
        (np.float32([x, y]), np.float32([min(1, x + width), min(1, y + height)])) for (x, width), (y, height) in sides
    ]
    images = images_of({2: boxes}, 4)
    found, weight = points(images, [0, 2, 3, 9], 64)
    assert (weight[[0, 2, 3]] == 1).all()  # pixel 9 lies beyond the picture
    assert (weight <= 1 / (1 - AIMED) + 1e-5).all()
    expected = [1 / density(point, boxes) for point in found[1]]
    np.testing.assert_allclose(weight[1], expected, rtol=1e-3)


def test_means_are_those_over_the_whole_pixel():
    boxes = [(np.float32([0.1, 0.2]), np.float32([0.15, 0.21])), (np.float32([0.12, 0.0]), np.float32([0.5, 1.0]))]
    images = images_of({0: boxes, 1: boxes[:1]}, 2)
    found, weight = points(images, [0, 1], 1 << 15)
    inside = (found >= boxes[0][0]).all(axis=2) & (found <= boxes[0][1]).all(axis=2)
    for of, expected in ((np.ones_like(weight), 1.0), (found[..., 0], 0.5), (np.square(found[..., 1]), 1 / 3)):
        np.testing.assert_allclose((weight * of).mean(axis=1), expected, rtol=0.01)
    # What is in the small box has a two thousandth of the pixel, and a quarter or half of the points.
    np.testing.assert_allclose((weight * inside).mean(axis=1), 0.05 * 0.01, rtol=0.02)
    np.testing.assert_allclose(inside.mean(axis=1), [0.25, 0.5], atol=0.02)


def test_samples_without_boxes_are_those_of_the_pixel():
    import mitsuba as mi

    from lippmann.device.sobol import PIXEL_DIMENSION, SampleStream

    images = images_of({1: [(np.float32([0.4, 0.4]), np.float32([0.6, 0.6]))]}, 2)
    found, _ = points(images, [0], 16)
    stream = SampleStream.of_pixels(mi.UInt32([0] * 16), mi.UInt32(np.arange(16, dtype=np.uint32)), mi.UInt32(3))
    np.testing.assert_array_equal(found[0], np.array(stream.next_2d(PIXEL_DIMENSION)).T)
