"""Films whose interference makes a surface iridescent."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")


def reflectance(cosine, thickness):
    import mitsuba as mi

    from lippmann.device.pbr.thin_film import thin_film_reflectance

    film = mi.Float(cosine), mi.Float(1.5), mi.Float(thickness), mi.Color3f(0.3, 0.5, 0.7)
    return np.array(thin_film_reflectance(*film)).ravel()


@pytest.mark.parametrize("thickness", [150.0, 300.0, 450.0])
def test_a_slanted_film_looks_like_a_thinner_one(thickness):
    """By Snell's law its optical path is shorter by the cosine inside; Schlick's Fresnel is even nearly head-on."""
    inside = math.sqrt(1 - (1 - 0.8**2) / 1.5**2)
    np.testing.assert_allclose(reflectance(0.8, thickness), reflectance(1.0, thickness * inside), atol=2e-3)


def test_without_thickness_there_is_no_film():
    np.testing.assert_allclose(reflectance(1.0, 0.0), (0.3, 0.5, 0.7), atol=0.02)
