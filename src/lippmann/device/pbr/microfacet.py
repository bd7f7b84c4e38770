"""Formulas of glTF's surface model: Fresnel, GGX and Charlie lobes, and how to draw directions from them.

All directions live in a local frame whose z axis is the surface normal; ``alpha`` is the square of glTF's roughness.
The functions take Dr.Jit arrays and are recorded into kernels.

Sources: the Khronos glTF 2.0 specification, appendix B, and its ``KHR_materials_*`` extensions, which build on Walter
et al. 2007 (microfacets), Heitz 2014 (height-correlated masking), Schlick 1994, and Estevez and Kulla 2017 (sheen).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Smallest ``alpha``: below it single precision cannot resolve the lobe, and it looks like a mirror anyway.
MIN_ALPHA = 1e-3


def schlick_weight(cosine: Any) -> Any:
    """``(1 - cosine)^5``, the weight of grazing reflectance."""
    import drjit as dr

    m = dr.clip(1 - cosine, 0, 1)
    return dr.square(dr.square(m)) * m


def ggx_density(h: Any, alpha: Any) -> Any:
    """Density of microfacet normals D(h), written without the difference ``1 - (n.h)^2`` that loses small alphas."""
    import drjit as dr

    a2 = dr.square(alpha)
    spread = dr.fma(a2, dr.square(h.z), dr.square(h.x) + dr.square(h.y))
    return a2 / (dr.pi * dr.square(spread))


def _smith_root(cosine: Any, alpha: Any) -> Any:
    import drjit as dr

    a2 = dr.square(alpha)
    return dr.sqrt(dr.fma(1 - a2, dr.square(cosine), a2))


def ggx_visibility(cos_i: Any, cos_o: Any, alpha: Any) -> Any:
    """Height-correlated masking and shadowing over ``4 cos_i cos_o`` (glTF's V)."""
    return 0.5 / (cos_o * _smith_root(cos_i, alpha) + cos_i * _smith_root(cos_o, alpha))


def ggx_masking(cosine: Any, alpha: Any) -> Any:
    """Smith's masking G1 of one direction."""
    return 2 * cosine / (cosine + _smith_root(cosine, alpha))


def visible_normal_pdf(cos_i: Any, i_dot_h: Any, density: Any, alpha: Any) -> Any:
    """Density of :func:`sample_visible_normal`, per solid angle of h."""
    return 2 * i_dot_h * density / (cos_i + _smith_root(cos_i, alpha))


def sample_visible_normal(wi: Any, alpha: Any, sample: Any) -> Any:
    """A microfacet normal among those that ``wi`` sees (Dupuy and Benyoub 2023, spherical caps)."""
    import drjit as dr

    stretched = dr.normalize(type(wi)(wi.x * alpha, wi.y * alpha, wi.z))
    sin_phi, cos_phi = dr.sincos(2 * dr.pi * sample.x)
    z = dr.fma(1 - sample.y, 1 + stretched.z, -stretched.z)
    radius = dr.safe_sqrt(1 - dr.square(z))
    h = type(wi)(radius * cos_phi, radius * sin_phi, z) + stretched
    return dr.normalize(type(wi)(h.x * alpha, h.y * alpha, dr.maximum(h.z, 0)))


def gloss_albedo_table(columns: int = 64, rows: int = 32, steps: int = 32) -> NDArray[np.float32]:
    """Light that a GGX lobe reflects, ``(rows, columns, 3)``: rows along roughness, columns along the cosine.

    With Schlick's Fresnel factor of head-on reflectance f0 it is ``f0 * first + second`` of the first two channels
    (the third is idle). Texel centres; ``steps`` squared draws of microfacets each. Needs a running engine.
    """
    import drjit as dr
    import mitsuba as mi

    across, down, even = ((np.arange(count) + 0.5) / count for count in (columns, rows, steps))
    roughness, cos_i, u, v = (
        mi.Float(part.ravel().astype(np.float32)) for part in np.meshgrid(down, across, even, even, indexing="ij")
    )
    alpha = dr.maximum(dr.square(roughness), MIN_ALPHA)
    wi = mi.Vector3f(dr.sqrt(1 - dr.square(cos_i)), 0, cos_i)
    h = sample_visible_normal(wi, alpha, mi.Point2f(u, v))
    cosine = dr.dot(wi, h)
    cos_o = 2 * cosine * h.z - cos_i
    # Draws weigh G2 / G1: the visibility over what the density of visible normals already holds of it.
    weight = ggx_visibility(cos_i, cos_o, alpha) * 4 * cos_i * cos_o / ggx_masking(cos_i, alpha)
    weight = dr.select(cos_o > 0, weight, 0)
    grazing = weight * schlick_weight(cosine)
    sums = [dr.block_sum(part, steps**2) / steps**2 for part in (weight - grazing, grazing, dr.zeros(mi.Float, len(u)))]
    return np.stack([np.array(part, dtype=np.float32).reshape(rows, columns) for part in sums], axis=-1)


def charlie_density(cos_h: Any, alpha: Any) -> Any:
    """Density of the fibres of a cloth (KHR_materials_sheen)."""
    import drjit as dr

    inverse = dr.rcp(alpha)
    return (2 + inverse) * dr.power(dr.maximum(1 - dr.square(cos_h), 1e-7), inverse * 0.5) / (2 * dr.pi)


# Fit of Charlie's Smith lambda by Estevez and Kulla: (value at alpha 1, value at alpha 0) of a/(1 + b x^c) + d x + e.
_CHARLIE_FIT = ((21.5473, 25.3245), (3.82987, 3.32435), (0.19823, 0.16801), (-1.97760, -1.27393), (-4.32054, -4.85967))


def _charlie_lambda(cosine: Any, alpha: Any) -> Any:
    import drjit as dr

    t = dr.square(1 - alpha)
    a, b, c, d, e = (dr.fma(t, smooth - rough, rough) for rough, smooth in _CHARLIE_FIT)

    def fit(x: Any) -> Any:
        return a / (1 + b * dr.power(dr.maximum(x, 1e-6), c)) + d * x + e

    return dr.select(cosine < 0.5, dr.exp(fit(cosine)), dr.exp(2 * fit(0.5) - fit(1 - cosine)))


def charlie_visibility(cos_i: Any, cos_o: Any, alpha: Any) -> Any:
    """Masking and shadowing of cloth over ``4 cos_i cos_o``."""
    return 1 / ((1 + _charlie_lambda(cos_i, alpha) + _charlie_lambda(cos_o, alpha)) * 4 * cos_i * cos_o)


def sheen_albedo_table(size: int = 32, steps: tuple[int, int] = (64, 32)) -> NDArray[np.float32]:
    """Light that white sheen sends back, ``(size, size, 1)``: rows along roughness, columns along the cosine.

    Texel centres; integrated over the hemisphere by the midpoint rule with ``steps`` in cosine and half turn. Needs a
    running engine.
    """
    import drjit as dr
    import mitsuba as mi

    centres = (np.arange(size) + 0.5) / size
    z = (np.arange(steps[0]) + 0.5) / steps[0]
    phi = (np.arange(steps[1]) + 0.5) * (math.pi / steps[1])  # the lobe is even in phi: half a turn suffices
    roughness, cos_i, cos_o, angle = (
        mi.Float(part.ravel().astype(np.float32)) for part in np.meshgrid(centres, centres, z, phi, indexing="ij")
    )
    alpha = dr.maximum(dr.square(roughness), MIN_ALPHA)
    sin_i, sin_o = dr.sqrt(1 - dr.square(cos_i)), dr.sqrt(1 - dr.square(cos_o))
    h = dr.normalize(mi.Vector3f(sin_i + sin_o * dr.cos(angle), sin_o * dr.sin(angle), cos_i + cos_o))
    value = charlie_density(h.z, alpha) * charlie_visibility(cos_i, cos_o, alpha) * cos_o
    sums = dr.block_sum(value, math.prod(steps)) * (2 * math.pi / math.prod(steps))
    return np.clip(np.array(sums, dtype=np.float32), 0, 1).reshape(size, size, 1)
