"""The built-in studio."""

import numpy as np
import pytest

from lippmann.scene.studio_light import BACKDROP, directions_of, studio


def irradiance(normal):
    """Irradiance over pi: the radiance of a white diffuse surface that faces along ``normal``."""
    pixels = studio().pixels[..., 0].astype(float)
    directions, solid_angles = directions_of(len(pixels))
    cosine = np.maximum(directions @ (np.asarray(normal) / np.linalg.norm(normal)), 0)
    return float((pixels * cosine * solid_angles).sum() / np.pi)


def test_it_is_a_white_panorama():
    pixels = studio().pixels
    assert pixels.shape == (64, 128, 3)
    assert pixels.dtype == np.float32
    assert np.isfinite(pixels).all()
    assert pixels.min() > 0
    assert (pixels == pixels[..., :1]).all()
    assert not pixels.flags.writeable
    assert studio() is studio()


def test_directions_cover_the_sphere():
    directions, solid_angles = directions_of(64)
    assert np.linalg.norm(directions, axis=-1) == pytest.approx(np.ones((64, 128)))
    assert solid_angles.sum() == pytest.approx(4 * np.pi)
    assert (directions[0, :, 1] > 0.99).all()  # row 0 is up
    assert directions[32, 0] == pytest.approx([0, 0, 1], abs=0.05)  # the first column is the viewer's own place
    assert directions[32, 64] == pytest.approx([0, 0, -1], abs=0.05)  # the middle lies behind the scene
    assert directions[32, 96] == pytest.approx([1, 0, 0], abs=0.05)


def test_white_comes_out_white():
    assert irradiance((0, 0.5, np.sqrt(0.75))) == pytest.approx(1.0, rel=1e-4)


def test_it_models_form():
    """The key comes from the left, no side is black, none burns out badly."""
    left, right, front, below, top, back = (
        irradiance(normal) for normal in ((-1, 0, 1), (1, 0, 1), (0, 0, 1), (0, -1, 0.2), (0, 1, 0), (0, 0, -1))
    )
    assert left > 1.3 * right
    assert top > front > below
    assert min(left, right, front, below, top, back) > 0.05
    assert max(left, right, front, below, top, back) < 1.3


def test_the_backdrop_is_a_middle_grey():
    assert BACKDROP == (0.18, 0.18, 0.18)
