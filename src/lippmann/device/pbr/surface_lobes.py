"""Lobes of a glTF surface: sampling, BSDF values and pdfs, and the normals of narrow lobes.

Formulas are those of glTF 2.0, appendix B, and of its extensions. All directions are flipped so that the viewer is
above the surface; see :mod:`~lippmann.device.pbr.gltf_bsdf`. Imports Mitsuba, and so only once its variant is set.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import drjit as dr
import mitsuba as mi

from lippmann.device.pbr import microfacet
from lippmann.device.pbr.gltf_bsdf_parameters import Lobe, Point, Sheen, SurfaceModel
from lippmann.device.pbr.surface_point import fresnel, reflecting_chance, surface_point
from lippmann.device.pbr.textures import Place
from lippmann.device.types import Bool, BSDFSample3f, Color3f, Float, Point2f, Spectrum, UInt32, Vector3f

#: Flags of the lobes.
REFLECTING = int(mi.BSDFFlags.GlossyReflection)
TRANSMITTING = int(mi.BSDFFlags.GlossyTransmission)
SCATTERING = int(mi.BSDFFlags.DiffuseReflection)
#: Set in the sampled type of an event that keeps an image sharp, whichever lobe was sampled; see
#: :func:`~lippmann.device.pbr.microfacet.is_sharp`.
SHARP_EVENT = 1 << 29
#: A lobe is wide whose GGX widths are above this.
WIDE_ALPHA = 0.04
#: Factor of a wide lobe's chance where narrow ones are sampled first. With 0, directions that narrow lobes hardly reach
#: would be rare and bright.
_WIDE_CHANCE = 0.1


def is_sharp_event(bs: BSDFSample3f) -> Bool:
    """Whether a sampled event is sharp: by a lobe without width or by a narrow one, or straight through."""
    return (bs.sampled_type & (int(mi.BSDFFlags.Delta | mi.BSDFFlags.Null) | SHARP_EVENT)) != 0


def _is_narrow(lobe: Lobe) -> Bool:
    return lobe.alpha.x < microfacet.NARROW_ALPHA


def _is_body_narrow(model: SurfaceModel, point: Point) -> Bool:
    return _is_narrow(point.lobe) if model.is_glossy else mi.Bool(False)


def _is_coat_narrow(point: Point) -> Bool:
    coat = point.coat
    return mi.Bool(False) if coat is None else _is_narrow(coat.lobe) & (coat.weight > 0)


def favour_sharp_lobes(model: SurfaceModel, point: Point) -> Point:
    """See :data:`~lippmann.device.pbr.gltf_bsdf.SHARP_FIRST`: ``point`` with other chances."""
    body, coat = _is_body_narrow(model, point), point.coat
    diffuse_chance = dr.select(body, _WIDE_CHANCE * point.diffuse_chance, point.diffuse_chance)
    if coat is not None:
        gloss = _is_coat_narrow(point)
        above = dr.select(body, coat.chance, 1 - _WIDE_CHANCE * (1 - coat.chance))
        below = dr.select(body, _WIDE_CHANCE * coat.chance, coat.chance)
        coat = replace(coat, chance=dr.select(gloss, above, below))
    return replace(point, diffuse_chance=diffuse_chance, coat=coat)


def has_wide_lobes(model: SurfaceModel, point: Point) -> Float:
    """See :data:`~lippmann.device.pbr.gltf_bsdf.WIDE_LOBES`."""
    lobes = [point.lobe] if model.is_glossy else []
    if point.coat is not None:
        lobes.append(point.coat.lobe)
    wide = mi.Bool(True)
    for lobe in lobes:
        wide &= _is_narrow(lobe) | (dr.minimum(lobe.alpha.x, lobe.alpha.y) > WIDE_ALPHA)
    return dr.select(wide, mi.Float(1), 0)


def find_sharp_normal(model: SurfaceModel, point: Point) -> Vector3f:
    """See :data:`~lippmann.device.pbr.gltf_bsdf.SHARP_LOBE`."""
    up = mi.Vector3f(0, 0, 1)
    n = dr.select(_is_body_narrow(model, point), up if point.lobe.frame is None else point.lobe.frame.n, 0)
    if point.coat is not None:
        frame = point.coat.lobe.frame
        n = dr.select(_is_coat_narrow(point), up if frame is None else frame.n, n)
    return mi.Vector3f(n.x, n.y, n.z * point.flip)


def find_lambertian(model: SurfaceModel, place: Place) -> Color3f:
    """See :data:`~lippmann.device.pbr.gltf_bsdf.LAMBERTIAN`: base colour times the factors of :func:`scatter`."""
    point = surface_point(model, place)
    albedo = point.base * (point.below * (1 - point.metallic) * (1 - point.transmission))
    if point.coat is not None:
        albedo = albedo * (1 - point.coat.weight)
    return albedo if model.opacity is None else albedo * model.coverage(place)


def sample_lobes(model: SurfaceModel, point: Point, u: Float, sample: Point2f) -> tuple[Vector3f, UInt32, Bool]:
    """An outgoing direction in the surface's frame, the flag of its lobe, and whether light can go there.

    A microfacet may send light to the wrong side of its lobe's plane; such a sample counts as absorbed.
    """
    lobe, coat = point.lobe, point.coat
    wi, alpha, coated = lobe.wi, lobe.alpha, mi.Bool(False)
    if coat is not None:
        coated = u < coat.chance
        u = dr.select(coated, 0, (u - coat.chance) / (1 - coat.chance))
        wi, alpha = dr.select(coated, coat.lobe.wi, wi), dr.select(coated, coat.lobe.alpha, alpha)
    diffuse = ~coated & (u < point.diffuse_chance)
    u = (u - point.diffuse_chance) / (1 - point.diffuse_chance)

    h = microfacet.sample_visible_normal(wi, alpha, sample)
    cosine = dr.dot(wi, h)
    wo = h * (2 * cosine) - wi
    possible = wo.z > 0
    kind = mi.UInt32(REFLECTING)
    if model.transmission is not None:
        through = ~coated & (u >= reflecting_chance(model, point, *fresnel(model, point, cosine)))
        beyond = mi.Vector3f(wo.x, wo.y, -wo.z)
        if model.solid:
            _, cos_t, _, eta_ti = mi.fresnel(cosine, point.eta)
            beyond = mi.refract(wi, mi.Normal3f(h), cos_t, eta_ti)
            possible = dr.select(through, beyond.z < 0, possible)
        wo = dr.select(through, beyond, wo)
        kind = dr.select(through, TRANSMITTING, kind)
    wo = dr.select(diffuse, mi.warp.square_to_cosine_hemisphere(sample), wo)
    kind = dr.select(diffuse, SCATTERING, kind)

    world = wo if lobe.frame is None else lobe.frame.to_world(wo)
    if coat is not None:
        world = dr.select(coated, wo if coat.lobe.frame is None else coat.lobe.frame.to_world(wo), world)
    height = dr.abs(world.z) * dr.select(kind == TRANSMITTING, -point.flip, point.flip)
    return mi.Vector3f(world.x, world.y, height), kind, possible | diffuse


def scatter(model: SurfaceModel, point: Point, wo: Vector3f) -> tuple[Color3f, Float]:
    """BSDF times cosine, and the density of :func:`sample_lobes`, for ``wo`` in the surface's frame."""
    wo = mi.Vector3f(wo.x, wo.y, wo.z * point.flip)
    above = wo.z > 0
    value, pdf = _fold_below(point.lobe, wo, lambda way: _scatter_body(model, point, way, above))
    coat = point.coat
    if coat is not None:
        gloss, gloss_pdf = _fold_below(coat.lobe, wo, lambda way: _reflect_coat(coat.lobe, way))
        value = value * (1 - coat.weight) + (gloss * (coat.gain * coat.weight) & above)
        pdf = dr.lerp(pdf, gloss_pdf & above, coat.chance)
    return value, pdf


def _fold_below(
    lobe: Lobe, wo: Vector3f, evaluate: Callable[[Vector3f], tuple[Color3f, Float]]
) -> tuple[Color3f, Float]:
    """Value and density of a lobe, with what a tilted one sends through the surface folded back about it."""
    wo_local = wo if lobe.frame is None else lobe.frame.to_local(wo)
    value, pdf = evaluate(wo_local)
    if lobe.tilted:
        assert lobe.frame is not None
        folded_value, folded_pdf = evaluate(lobe.frame.to_local(mi.Vector3f(wo.x, wo.y, -wo.z)))
        value, pdf = value + folded_value, pdf + folded_pdf
    return value, pdf


def _reflect_coat(lobe: Lobe, wo: Vector3f) -> tuple[Float, Float]:
    gloss, pdf, _, _ = _reflect(lobe, wo)
    return gloss & (wo.z > 0), pdf & (wo.z > 0)


def _reflect(lobe: Lobe, wo: Vector3f) -> tuple[Float, Float, Float, Vector3f]:
    """Microfacet reflection without Fresnel factor, times cosine: value, density, cosine at h, h."""
    h = dr.normalize(lobe.wi + wo)
    cosine = dr.dot(lobe.wi, h)
    facets = microfacet.ggx_density(h, lobe.alpha)
    value = facets * microfacet.ggx_visibility(lobe.wi, wo, lobe.alpha) * wo.z
    pdf = microfacet.visible_normal_pdf(lobe.wi, cosine, facets, lobe.alpha) / (4 * cosine)
    return value, pdf, cosine, h


def _scatter_body(model: SurfaceModel, point: Point, wo: Vector3f, above: Bool) -> tuple[Color3f, Float]:
    """All below the clear coat; ``wo`` is in the lobe's frame and leaves ``above`` the surface or below it."""
    lobe = point.lobe
    is_visible = (lobe.wi.z > 0) & ((wo.z > 0) == above) & (wo.z != 0)
    mirrored = mi.Vector3f(wo.x, wo.y, dr.abs(wo.z))

    gloss, gloss_pdf, cosine, h = _reflect(lobe, mirrored)
    metal, dielectric = fresnel(model, point, cosine)
    entering = (1 - dr.max(dielectric)) * (1 - point.metallic) * point.base
    reflects = reflecting_chance(model, point, metal, dielectric)
    diffuse = mirrored.z * dr.inv_pi
    value = dr.lerp(dielectric * point.gain, metal * point.metal_gain, point.metallic) * gloss
    value += point.base * (point.below * (1 - point.metallic) * (1 - point.transmission) * diffuse)
    pdf = dr.lerp(reflects * gloss_pdf, diffuse, point.diffuse_chance)
    if point.sheen is not None:
        value = _put_under_cloth(model, point.sheen, value, lobe.wi.z, mirrored.z, h.z)
    if model.transmission is None:
        return value & (is_visible & above), pdf & (is_visible & above)

    if model.solid:
        gloss, gloss_pdf, cosine = _refract(point, wo)
        metal, dielectric = fresnel(model, point, cosine)
        entering = (1 - dr.max(dielectric)) * (1 - point.metallic) * point.base
        reflects = reflecting_chance(model, point, metal, dielectric)
    through = entering * (point.transmission * point.gain * gloss)
    through_pdf = (1 - point.diffuse_chance) * (1 - reflects) * gloss_pdf
    return dr.select(above, value, through) & is_visible, dr.select(above, pdf, through_pdf) & is_visible


def _put_under_cloth(
    model: SurfaceModel, sheen: Sheen, value: Spectrum, cos_i: Float, cos_o: Float, cos_h: Float
) -> Color3f:
    """``value`` dimmed by the fibres above it, and their own light."""
    hidden = sheen.albedo(cos_i)
    if not model.compensates:  # glTF takes the larger share of the two directions, and so loses light
        hidden = dr.maximum(hidden, sheen.albedo(cos_o))
    hidden *= dr.max(sheen.color)
    fibres = microfacet.charlie_density(cos_h, sheen.alpha)
    fibres *= microfacet.charlie_visibility(cos_i, cos_o, sheen.alpha) * cos_o
    return value * (1 - hidden) + sheen.color * fibres


def _refract(point: Point, wo: Vector3f) -> tuple[Float, Float, Float]:
    """Rough refraction (Walter et al. 2007, eq. 21) without Fresnel factor: value, density, cosine at h."""
    wi, alpha = point.lobe.wi, point.lobe.alpha
    h = dr.normalize(wi + wo * point.eta)
    h = dr.select(h.z < 0, -h, h)
    cos_i, cos_o = dr.dot(wi, h), dr.dot(wo, h)
    facets = microfacet.ggx_density(h, alpha)
    beyond = mi.Vector3f(wo.x, wo.y, dr.abs(wo.z))
    masking = microfacet.ggx_masking(wi, alpha) * microfacet.ggx_masking(beyond, alpha)
    stretch = dr.square(point.eta) * dr.abs(cos_o) / dr.square(cos_i + point.eta * cos_o)
    # Radiance is squeezed into a smaller solid angle on the dense side: traced backwards, eta squared cancels.
    value = facets * masking * cos_i * stretch / (wi.z * dr.square(point.eta))
    pdf = microfacet.visible_normal_pdf(wi, cos_i, facets, alpha) * stretch
    fits = (cos_i > 0) & (cos_o < 0)
    return value & fits, pdf & fits, dr.maximum(cos_i, 0)
