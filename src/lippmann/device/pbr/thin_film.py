"""Fresnel reflectance of a surface under a thin film, whose interference makes it iridescent.

Source: KHR_materials_iridescence of the Khronos group, which writes down Belcour and Barla 2017: two interfaces, two
orders of interference, and the eye's response to each in closed form.
"""

from __future__ import annotations

import math
from typing import cast

from lippmann.device.pbr.microfacet import schlick_weight
from lippmann.device.types import Color3f, Float

#: Gaussian fits of the CIE 1931 sensitivities in the frequency domain: weight, centre and variance of x, y, z.
_WEIGHTS = (5.4856e-13, 4.4201e-13, 5.2481e-13)
_CENTERS = (1.6810e06, 1.7953e06, 2.2084e06)
_VARIANCES = (4.3278e09, 9.3046e09, 6.6121e09)
#: The second lobe of x, and what normalises all of them.
_SECOND_WEIGHT, _SECOND_CENTER, _SECOND_VARIANCE = 9.7470e-14, 2.2399e06, 4.5282e09
_NORMALIZATION = 1.0685e-7
_RGB_FROM_XYZ = (
    (3.2404542, -1.5371385, -0.4985314),
    (-0.9692660, 1.8760108, 0.0415560),
    (0.0556434, -0.2040259, 1.0572252),
)


def thin_film_reflectance(cosine: Float, film_ior: Float, thickness: Float, f0: Color3f) -> Color3f:
    """Reflectance in [0, 1] of a film in air over a base.

    Parameters
    ----------
    cosine:
        Between light and normal, in [0, 1].
    film_ior:
        Index of refraction of the film, 1 or more.
    thickness:
        Of the film in nanometres; it fades out below 0.03 nm.
    f0:
        Reflectance of the base in air, head-on.
    """
    import drjit as dr
    import mitsuba as mi

    fade = dr.clip(thickness * (1 / 0.03), 0, 1)
    ior = dr.lerp(1, film_ior, dr.square(fade) * (3 - 2 * fade))
    cos2_squared = 1 - (1 - dr.square(cosine)) / dr.square(ior)
    cos2 = dr.safe_sqrt(cos2_squared)
    # First interface, air to film.
    r12 = _schlick(dr.square((ior - 1) / (ior + 1)), cosine)
    t121 = 1 - r12
    # Second interface, film to base.
    root = dr.sqrt(dr.clip(mi.Color3f(f0), 0, 0.9999))
    base_ior = (1 + root) / (1 - root)
    r23 = _schlick(dr.square((base_ior - ior) / (base_ior + ior)), cos2)
    # Reflection at a denser medium turns the phase by half a wave: always outside the film, inside by the base.
    phase = dr.pi + dr.select(base_ior < ior, mi.Color3f(dr.pi), 0)
    path = 2 * ior * thickness * cos2
    r123 = dr.clip(r12 * r23, 1e-5, 0.9999)
    amplitude = dr.sqrt(r123)
    together = dr.square(t121) * r23 / (1 - r123)
    total = mi.Color3f(r12 + together)
    order = together - t121
    for m in (1, 2):
        order = order * amplitude
        total += order * 2 * _sensitivity(m * path, m * phase)
    return dr.select(cos2_squared < 0, mi.Color3f(1), dr.clip(total, 0, 1))


def _schlick(f0: Color3f, cosine: Float) -> Color3f:
    return f0 + (1 - f0) * schlick_weight(cosine)


def _sensitivity(path: Float, shift: Color3f) -> Color3f:
    """Linear RGB of the interference of an optical path in nanometres, with a phase ``shift`` per channel."""
    import drjit as dr
    import mitsuba as mi

    phase = 2 * dr.pi * path * 1e-9

    def lobe(weight: float, center: float, variance: float, shift: Float) -> Float:
        scale = weight * math.sqrt(2 * math.pi * variance)
        return scale * dr.cos(center * phase + shift) * dr.exp(-variance * dr.square(phase))

    lobes = [lobe(*fit, shift[k]) for k, fit in enumerate(zip(_WEIGHTS, _CENTERS, _VARIANCES, strict=True))]
    lobes[0] += lobe(_SECOND_WEIGHT, _SECOND_CENTER, _SECOND_VARIANCE, shift[0])
    rows = [sum(factor * lobe for factor, lobe in zip(row, lobes, strict=True)) for row in _RGB_FROM_XYZ]
    return cast("Color3f", mi.Color3f(*rows) / _NORMALIZATION)
