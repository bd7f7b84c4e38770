"""Sharp events: scattering that keeps an image sharp, by mirrors, clear glass, smooth gloss and holes.

Light that comes from an emitter by sharp events alone and then meets a rough surface is a *caustic* there; paths from
the eye hardly ever find small emitters so. All other light is left to them.

Whether an event is sharp follows from the surface and the two directions alone, not from the lobe that a direction was
drawn from: so the division is exact however light is sampled. Lobes without width (delta) are sharp by themselves. A
surface with a narrow lobe tells that lobe's normal, as the attribute :data:`~lippmann.device.pbr.gltf_bsdf.SHARP_LOBE`:
reflection is sharp where the half vector lies near it, and all that goes through such a surface is.
"""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi

from lippmann.device.pbr.gltf_bsdf import LAMBERTIAN, SHARP_LOBE, WIDE_LOBES
from lippmann.device.types import Bool, BSDFPtr, BSDFSample3f, Color3f, SurfaceInteraction3f, Vector3f
from lippmann.rendering.transport.tuning import TUNING

#: Sharp events between an emitter and a caustic, at most; light of more is left to paths.
MOST_EVENTS = 6


def sharp_lobe(si: SurfaceInteraction3f, bsdf: BSDFPtr, active: Bool) -> Vector3f:
    """Unit normal of a surface's narrow lobe in the frame of ``si``, on the side of ``si.wi``; 0 where it has none."""
    told = active & bsdf.has_attribute(SHARP_LOBE, active)
    return dr.select(told, mi.Vector3f(bsdf.eval_attribute_3(SHARP_LOBE, si, told)), 0)


def is_sharp(si: SurfaceInteraction3f, lobe: Vector3f, wo: Vector3f) -> Bool:
    """Whether scattering from ``wo`` to ``si.wi`` is sharp, by a lobe from :func:`sharp_lobe`."""
    half = dr.normalize(si.wi + wo)
    reflected = si.wi.z * wo.z > 0
    return (dr.squared_norm(lobe) > 0) & (~reflected | (dr.dot(half, lobe) > math.cos(TUNING.least_cosine_angle)))


def follows_sharply(si: SurfaceInteraction3f, lobe: Vector3f, bs: BSDFSample3f) -> Bool:
    """Whether a sampled direction goes on sharply: by a lobe without width, or by ``lobe`` (:func:`sharp_lobe`)."""
    has_no_width = (bs.sampled_type & int(mi.BSDFFlags.Delta | mi.BSDFFlags.Null)) != 0
    return has_no_width | is_sharp(si, lobe, bs.wo)


def has_wide_lobes(si: SurfaceInteraction3f, bsdf: BSDFPtr, active: Bool) -> Bool:
    """Whether all that a surface reflects but sharply can be told from photons, by its own word."""
    told = active & bsdf.has_attribute(WIDE_LOBES, active)
    return told & (bsdf.eval_attribute_1(WIDE_LOBES, si, told) > 0)


def lambertian_share(si: SurfaceInteraction3f, albedo: Color3f, scattered: Color3f, wo: Vector3f) -> Color3f:
    """Share in [0, 1] of a part of that ``albedo`` in ``scattered``, which is the BSDF for ``wo`` times the cosine.

    What comes through the surface is no part of it.
    """
    lambert = albedo * (dr.abs(wo.z) * dr.inv_pi)
    return dr.select((si.wi.z * wo.z > 0) & (scattered > 0), dr.clip(lambert / scattered, 0, 1), 0)


def facing_normal(si: SurfaceInteraction3f) -> Vector3f:
    """The geometric normal, in world space, on the side of ``si.wi``."""
    return mi.Vector3f(dr.select(si.wi.z * dr.dot(si.n, si.sh_frame.n) < 0, -si.n, si.n))


def lambertian(si: SurfaceInteraction3f, bsdf: BSDFPtr, active: Bool) -> Color3f:
    """Albedo of the part of a surface's scattering that is the same in all directions; 0 where there is none.

    It is the surface's own word (:data:`~lippmann.device.pbr.gltf_bsdf.LAMBERTIAN`), or the reflectance of a surface
    that scatters in no other way.
    """
    told = active & bsdf.has_attribute(LAMBERTIAN, active)
    value = dr.select(told, mi.Color3f(bsdf.eval_attribute_3(LAMBERTIAN, si, told)), 0)
    kinds = bsdf.flags() & int(mi.BSDFFlags.All)
    plain = active & ~told & (kinds == int(mi.BSDFFlags.DiffuseReflection))
    return dr.select(plain, mi.Color3f(bsdf.eval_diffuse_reflectance(si, plain)), value)
