"""Outlines, found by depth or by edges, within micro-images and from lens to lens."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.image.micro_images import Permutation
from lippmann.metrics import find_silhouettes
from lippmann.metrics.silhouettes import DEPTH_JUMP


def test_a_plain_picture_has_none(any_display, picture):
    found = find_silhouettes(picture(any_display, 0.5))
    assert found.source == "edges"
    assert not found.mask.any()


def test_an_edge_inside_a_micro_image_marks_both_sides(display, picture):
    codes = np.full((32, 64, 3), 0.5)
    codes[:, 4:8] = 0.7  # the right half of the first lens
    mask = find_silhouettes(picture(display(), codes)).mask
    expected = np.zeros((32, 64), dtype=bool)
    expected[:, 3:5] = True  # within the lens
    expected[:, 4:8] = True  # against the same places of the next lens
    expected[:, 12:16] = True
    np.testing.assert_array_equal(mask, expected)


def test_weak_edges_are_none(display, picture):
    codes = np.full((32, 64, 3), 0.5)
    codes[:, :32] = 0.59
    assert not find_silhouettes(picture(display(), codes)).mask.any()


def test_pixels_on_either_side_of_a_lens_boundary_are_no_neighbours(display, picture):
    # A gradient over each micro-image, alike in all: a jump from 0.7 to 0 at every boundary, and no edge anywhere.
    ramp = np.tile(np.arange(8) / 10 * 0.99, 8)
    assert not find_silhouettes(picture(display(), ramp[None, :, None])).mask.any()


@pytest.mark.parametrize(("far", "is_outline"), [(-5.0, True), (-3.0, False), (-np.inf, True)])
def test_depth_decides_where_it_is_known(display, picture, far, is_outline):
    depth = np.full((32, 64), 0.0, dtype=np.float32)
    depth[:16] = far  # lenses are 2 mm apart: 4 mm is the limit
    checker = np.indices((32, 64)).sum(axis=0)[..., None] % 2  # edges everywhere, which do not count
    found = find_silhouettes(picture(display(), checker, maps={"depth": depth}))
    assert found.source == "depth"
    expected = np.zeros((32, 64), dtype=bool)
    expected[15:17] = is_outline
    np.testing.assert_array_equal(found.mask, expected)
    assert found.share == expected.mean()


def test_an_outline_is_found_under_every_layout(any_display, picture):
    codes = np.full((32, 64, 3), 0.2)
    codes[:, 32:] = 0.8
    mask = find_silhouettes(picture(any_display, codes)).mask
    assert 0 < mask.mean() < 0.75
    assert not mask[:, :8].any()


def expected_marks(image, values, differ):
    """Both of every pair of neighbours that differ, along the four axes of the micro-images, one after the other."""
    permutation = Permutation(image.display)
    split, present = permutation.split(values), permutation.mask
    marks = np.zeros(present.shape, dtype=bool)
    for axis in range(4):
        low = (slice(None),) * axis + (slice(0, -1),)
        high = (slice(None),) * axis + (slice(1, None),)
        both = present[low] & present[high] & differ(split[low], split[high])
        marks[low] |= both
        marks[high] |= both
    return permutation.join(marks)


@pytest.mark.parametrize("seed", [1, 2])
def test_every_neighbour_counts_and_no_other_pixel(any_display, picture, seed):
    codes = np.random.default_rng(seed).uniform(0.45, 0.58, (32, 64, 3)).astype(np.float32)
    image = picture(any_display, codes)
    marks = expected_marks(image, codes.astype(float), lambda a, b: (np.abs(a - b) > 0.1).any(axis=-1))
    assert 0.1 < marks.mean() < 0.9
    np.testing.assert_array_equal(find_silhouettes(image).mask, marks)


def test_every_neighbour_counts_by_depth(any_display, picture):
    random = np.random.default_rng(4)
    depth = random.uniform(0, 1.1 * DEPTH_JUMP * any_display.lens_array.pitch, (32, 64)).astype(np.float32)
    depth[random.uniform(size=depth.shape) < 0.02] = np.inf
    depth[random.uniform(size=depth.shape) < 0.02] = -np.inf

    def differ(a, b):
        seen = np.isfinite(a), np.isfinite(b)
        step = np.abs(np.where(seen[0], a, 0.0) - np.where(seen[1], b, 0.0))
        return (seen[0] != seen[1]) | (seen[0] & seen[1] & (step > DEPTH_JUMP * any_display.lens_array.pitch))

    image = picture(any_display, 0.5, maps={"depth": depth})
    marks = expected_marks(image, depth.astype(float), differ)
    assert 0.05 < marks.mean() < 0.9
    np.testing.assert_array_equal(find_silhouettes(image).mask, marks)
