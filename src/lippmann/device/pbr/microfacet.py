"""Formulas of glTF's surface model: Fresnel, GGX and Charlie lobes, and how to sample directions from them.

All directions live in a local frame whose z axis is the surface normal; ``alpha`` is the GGX width along x and y, for
isotropic surfaces the square of glTF's roughness twice. The functions take Dr.Jit arrays and are recorded into kernels.

Sources: the Khronos glTF 2.0 specification, appendix B, and its ``KHR_materials_*`` extensions, which build on Walter
et al. 2007 (microfacets), Heitz 2014 (height-correlated masking, anisotropy), Schlick 1994, and Estevez and Kulla 2017
(sheen). The tables of directional albedo serve the compensation of multiple scattering (Turquin 2019).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.device.types import Bool, Float, Point2f, Vector3f

#: Smallest ``alpha``: below it single precision cannot resolve the lobe, and it looks like a mirror anyway.
MIN_ALPHA = 1e-3
#: A lobe is narrow whose ``alpha`` is below this.
NARROW_ALPHA = 0.02
#: Radians between half vector and normal up to which a narrow lobe's reflection is sharp.
SHARP_ANGLE = 2.5 * NARROW_ALPHA
#: Smallest index of refraction of a solid: at exactly 1 the half vector of light that passes straight through vanishes.
MIN_IOR = 1.001
#: Square roots of the head-on reflectances, (ior - 1) / (ior + 1), that :func:`interface_albedo_table` knows.
#: Dense near 0, where total reflection from inside sets in.
INTERFACE_F0 = tuple(0.96 * (step / 12) ** 2 for step in range(13))
#: Roughnesses of that table.
INTERFACE_ROWS = 16


def schlick_weight(cosine: Float) -> Float:
    """``(1 - cosine)^5``, the weight of grazing reflectance."""
    import drjit as dr

    m = dr.clip(1 - cosine, 0, 1)
    return dr.square(dr.square(m)) * m


def ggx_density(h: Vector3f, alpha: Point2f) -> Float:
    """Density of microfacet normals D(h), written without the difference ``1 - (n.h)^2`` that loses small alphas."""
    import drjit as dr

    stretch = alpha.x / alpha.y
    spread = dr.square(h.x) / stretch + dr.square(h.y) * stretch + alpha.x * alpha.y * dr.square(h.z)
    return alpha.x * alpha.y / (dr.pi * dr.square(spread))


def is_sharp(wi: Vector3f, wo: Vector3f, lobe: Vector3f) -> Bool:
    """Whether scattering from ``wo`` to ``wi`` keeps an image sharp, by the normal of a narrow ``lobe``; 0 for none.

    All in the surface's frame. Every transmission through a surface with a narrow lobe is sharp.
    """
    import drjit as dr

    reflected = wi.z * wo.z > 0
    is_near = dr.dot(dr.normalize(wi + wo), lobe) > math.cos(SHARP_ANGLE)
    return (dr.squared_norm(lobe) > 0) & (~reflected | is_near)


def _smith_root(w: Vector3f, alpha: Point2f) -> Float:
    import drjit as dr

    return dr.sqrt(dr.square(alpha.x * w.x) + dr.square(alpha.y * w.y) + dr.square(w.z))


def ggx_visibility(wi: Vector3f, wo: Vector3f, alpha: Point2f) -> Float:
    """Height-correlated masking and shadowing over ``4 cos_i cos_o`` (glTF's V)."""
    return 0.5 / (wo.z * _smith_root(wi, alpha) + wi.z * _smith_root(wo, alpha))


def ggx_masking(w: Vector3f, alpha: Point2f) -> Float:
    """Smith's masking G1 of one direction above the surface."""
    return 2 * w.z / (w.z + _smith_root(w, alpha))


def visible_normal_pdf(wi: Vector3f, i_dot_h: Float, density: Float, alpha: Point2f) -> Float:
    """Density of :func:`sample_visible_normal`, per solid angle of h."""
    return 2 * i_dot_h * density / (wi.z + _smith_root(wi, alpha))


def sample_visible_normal(wi: Vector3f, alpha: Point2f, sample: Point2f) -> Vector3f:
    """A microfacet normal among those that ``wi`` sees (Dupuy and Benyoub 2023, spherical caps)."""
    import drjit as dr

    stretched = dr.normalize(type(wi)(wi.x * alpha.x, wi.y * alpha.y, wi.z))
    sin_phi, cos_phi = dr.sincos(2 * dr.pi * sample.x)
    z = dr.fma(1 - sample.y, 1 + stretched.z, -stretched.z)
    radius = dr.safe_sqrt(1 - dr.square(z))
    h = type(wi)(radius * cos_phi, radius * sin_phi, z) + stretched
    return dr.normalize(type(wi)(h.x * alpha.x, h.y * alpha.y, dr.maximum(h.z, 0)))


#: Roughnesses of :func:`gloss_albedo_table`.
GLOSS_ROWS = 32


def roughness_row(alpha: Point2f, rows: int) -> Float:
    """Place of a GGX lobe among ``rows`` texels of a table, in texels: between the first's centre and the last's.

    An anisotropic lobe stands where an isotropic one of its root mean square width does.
    """
    import drjit as dr

    return dr.power((dr.square(alpha.x) + dr.square(alpha.y)) / 2, 0.25) * (rows - 1) + 0.5


def gloss_albedo_table(columns: int = 64, rows: int = GLOSS_ROWS, samples: int = 256) -> NDArray[np.float32]:
    """Light that a GGX lobe reflects, ``(rows, columns, 3)``: rows along roughness, columns along the cosine.

    With Schlick's Fresnel factor of head-on reflectance f0 it is ``f0 * first + second`` of the first two channels
    (the third is idle). Cosines at texel centres, roughness from 0 to 1; ``samples`` microfacets each. Needs a running
    engine.
    """
    import drjit as dr

    wi, alpha, sample = _grid(columns, rows, samples)
    h = sample_visible_normal(wi, alpha, sample)
    cosine = dr.dot(wi, h)
    weight = _reflection_weight(wi, h, alpha)
    grazing = weight * schlick_weight(cosine)
    head_on = weight - grazing
    dr.eval(head_on, grazing)  # in one kernel: each sum alone would sample all microfacets again
    means = [_means(part, rows, columns) for part in (head_on, grazing)]
    return np.stack([*means, np.zeros_like(means[0])], axis=-1)


def _grid(columns: int, rows: int, samples: int) -> tuple[Vector3f, Point2f, Point2f]:
    """Directions and widths at the texels of an albedo table, ``samples`` points of the unit square each.

    Cosines lie at texel centres, roughness runs from 0 in the first row to 1 in the last: see :func:`roughness_row`.
    The points are a Fibonacci lattice: 256 of them leave less than half of the error of a grid of 32 by 32.
    """
    import drjit as dr
    import mitsuba as mi

    row, column, number = _indices(rows, columns, samples)
    alpha = dr.maximum(dr.square(row / (rows - 1)), MIN_ALPHA)
    cosine, around = (column + 0.5) / columns, number * ((math.sqrt(5) - 1) / 2)
    sample = mi.Point2f(around - dr.floor(around), (number + 0.5) / samples)
    return mi.Vector3f(dr.sqrt(1 - dr.square(cosine)), 0, cosine), mi.Point2f(alpha), sample


def _indices(*shape: int) -> list[Float]:
    """The indices of every entry of an array of this shape, counted on the device: arrays of them would be large."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.kernel_ops import divide

    number = dr.arange(mi.UInt32, math.prod(shape))
    indices = []
    for length in reversed(shape):
        number, index = divide(number, length)
        indices.append(mi.Float(index))
    return indices[::-1]


def _means(values: Float, rows: int, columns: int) -> NDArray[np.float32]:
    """Mean of the samples of each texel, ``(rows, columns)``."""
    import drjit as dr

    steps = dr.width(values) // (rows * columns)
    return np.array(dr.block_sum(values, steps) / steps, dtype=np.float32).reshape(rows, columns)


def _reflection_weight(wi: Vector3f, h: Vector3f, alpha: Point2f) -> Float:
    """Weight of the reflection at a sampled microfacet: G2 / G1, 0 below the surface."""
    import drjit as dr

    wo = h * (2 * dr.dot(wi, h)) - wi
    # The visibility over what the density of visible normals already holds of it.
    weight = ggx_visibility(wi, wo, alpha) * 4 * wi.z * wo.z / ggx_masking(wi, alpha)
    return dr.select(wo.z > 0, weight, 0)


def interface_albedo_table(columns: int = 32, rows: int = INTERFACE_ROWS, samples: int = 256) -> NDArray[np.float32]:
    """Share of light that a rough refracting interface reflects or lets through, ``(2 n rows, columns, 1)``.

    The rest is lost to microfacets that send light to the wrong side. One block of ``rows`` (along roughness) by
    ``columns`` (along the cosine) for each of the n :data:`INTERFACE_F0` seen from outside, then from inside. Cosines
    at texel centres, roughness from 0 to 1; ``samples`` microfacets each. Needs a running engine.
    """
    import drjit as dr
    import mitsuba as mi

    wi, alpha, sample = _grid(columns, rows, samples)
    h = sample_visible_normal(wi, alpha, sample)
    cosine = dr.dot(wi, h)
    reflected = _reflection_weight(wi, h, alpha)
    blocks = []
    for inside in (False, True):
        for root in INTERFACE_F0:
            ior = max((1 + root) / (1 - root), MIN_IOR)
            fresnel, cos_t, _, eta_ti = mi.fresnel(cosine, mi.Float(1 / ior if inside else ior))
            wo = mi.refract(wi, mi.Normal3f(h), cos_t, eta_ti)
            through = dr.select(wo.z < 0, ggx_masking(mi.Vector3f(wo.x, wo.y, dr.abs(wo.z)), alpha), 0)
            blocks.append(_means(fresnel * reflected + (1 - fresnel) * through, rows, columns))
    return np.concatenate(blocks)[..., None]


def charlie_density(cos_h: Float, alpha: Float) -> Float:
    """Density of the fibres of a cloth (KHR_materials_sheen)."""
    import drjit as dr

    inverse = dr.rcp(alpha)
    return (2 + inverse) * dr.power(dr.maximum(1 - dr.square(cos_h), 1e-7), inverse * 0.5) / (2 * dr.pi)


# Fit of Charlie's Smith lambda by Estevez and Kulla: (value at alpha 1, value at alpha 0) of a/(1 + b x^c) + d x + e.
_CHARLIE_FIT = ((21.5473, 25.3245), (3.82987, 3.32435), (0.19823, 0.16801), (-1.97760, -1.27393), (-4.32054, -4.85967))


def _charlie_lambda(cosine: Float, alpha: Float) -> Float:
    import drjit as dr

    t = dr.square(1 - alpha)
    a, b, c, d, e = (dr.fma(t, smooth - rough, rough) for rough, smooth in _CHARLIE_FIT)

    def fit(x: Float) -> Float:
        return a / (1 + b * dr.power(dr.maximum(x, 1e-6), c)) + d * x + e

    return dr.select(cosine < 0.5, dr.exp(fit(cosine)), dr.exp(2 * fit(0.5) - fit(1 - cosine)))


def charlie_visibility(cos_i: Float, cos_o: Float, alpha: Float) -> Float:
    """Masking and shadowing of cloth over ``4 cos_i cos_o``."""
    return 1 / ((1 + _charlie_lambda(cos_i, alpha) + _charlie_lambda(cos_o, alpha)) * 4 * cos_i * cos_o)


def sheen_albedo_table(size: int = 32, steps: tuple[int, int] = (64, 32)) -> NDArray[np.float32]:
    """Light that white sheen sends back, ``(size, size, 1)``: rows along roughness, columns along the cosine.

    Texel centres; integrated over the hemisphere by the midpoint rule with ``steps`` in cosine and half turn. Needs a
    running engine.
    """
    import drjit as dr
    import mitsuba as mi

    row, column, *step = _indices(size, size, *steps)
    roughness, cos_i, cos_o = (
        (part + 0.5) / count for part, count in ((row, size), (column, size), (step[0], steps[0]))
    )
    angle = (step[1] + 0.5) * (math.pi / steps[1])  # the lobe is even in phi: half a turn suffices
    alpha = dr.maximum(dr.square(roughness), MIN_ALPHA)
    sin_i, sin_o = dr.sqrt(1 - dr.square(cos_i)), dr.sqrt(1 - dr.square(cos_o))
    h = dr.normalize(mi.Vector3f(sin_i + sin_o * dr.cos(angle), sin_o * dr.sin(angle), cos_i + cos_o))
    value = charlie_density(h.z, alpha) * charlie_visibility(cos_i, cos_o, alpha) * cos_o
    sums = dr.block_sum(value, math.prod(steps)) * (2 * math.pi / math.prod(steps))
    return np.clip(np.array(sums, dtype=np.float32), 0, 1).reshape(size, size, 1)
