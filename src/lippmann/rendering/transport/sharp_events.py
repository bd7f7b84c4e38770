"""Sharp events: scattering that keeps an image sharp, by mirrors, clear glass, smooth gloss and holes.

Light that comes from an emitter by sharp events alone and then meets a rough surface is a *caustic* there. Paths from
the eye hardly ever sample it where the emitter is small; they sample all other light.

Whether an event is sharp follows from the surface and the two directions alone, not from the sampled lobe. So the
division of light into sharp and rough is exact however light is sampled. Delta lobes are sharp. A surface with a narrow
lobe has that lobe's normal as the attribute :data:`~lippmann.device.pbr.gltf_bsdf.SHARP_LOBE`: a reflection is sharp
where the half vector lies near this normal, and every transmission through such a surface is sharp.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.pbr.gltf_bsdf import LAMBERTIAN, SHARP_LOBE, WIDE_LOBES
from lippmann.device.types import Bool, BSDFPtr, Color3f, SurfaceInteraction3f, Vector3f

#: Most sharp events between an emitter and a caustic (paths sample light of more events), most straight-through
#: surfaces among them, and most specular surfaces in front of the one whose features a denoiser gets.
MOST_EVENTS = 6


def sharp_lobe(si: SurfaceInteraction3f, bsdf: BSDFPtr, active: Bool) -> Vector3f:
    """Unit normal of a surface's narrow lobe in the frame of ``si``, on the side of ``si.wi``; 0 where it has none."""
    has_word = active & bsdf.has_attribute(SHARP_LOBE, active)
    return dr.select(has_word, mi.Vector3f(bsdf.eval_attribute_3(SHARP_LOBE, si, has_word)), 0)


def has_wide_lobes(si: SurfaceInteraction3f, bsdf: BSDFPtr, active: Bool) -> Bool:
    """Whether the BSDF says that photons can estimate all of its reflection but the sharp part."""
    has_word = active & bsdf.has_attribute(WIDE_LOBES, active)
    return has_word & (bsdf.eval_attribute_1(WIDE_LOBES, si, has_word) > 0)


def lambertian_share(si: SurfaceInteraction3f, albedo: Color3f, scattered: Color3f, wo: Vector3f) -> Color3f:
    """Share in [0, 1] of a Lambertian part with that ``albedo`` in ``scattered``, the BSDF for ``wo`` times the cosine.

    0 for transmission.
    """
    lambert = albedo * (dr.abs(wo.z) * dr.inv_pi)
    return dr.select((si.wi.z * wo.z > 0) & (scattered > 0), dr.clip(lambert / scattered, 0, 1), 0)


def facing_normal(si: SurfaceInteraction3f) -> Vector3f:
    """The geometric normal, in world space, on the side of ``si.wi``."""
    return mi.Vector3f(dr.select(si.wi.z * dr.dot(si.n, si.sh_frame.n) < 0, -si.n, si.n))


def lambertian(si: SurfaceInteraction3f, bsdf: BSDFPtr, active: Bool) -> Color3f:
    """Albedo of the Lambertian part of a BSDF; 0 without one.

    From the attribute :data:`~lippmann.device.pbr.gltf_bsdf.LAMBERTIAN`, or the reflectance of a purely diffuse BSDF.
    """
    has_word = active & bsdf.has_attribute(LAMBERTIAN, active)
    value = dr.select(has_word, mi.Color3f(bsdf.eval_attribute_3(LAMBERTIAN, si, has_word)), 0)
    kinds = bsdf.flags() & int(mi.BSDFFlags.All)
    plain = active & ~has_word & (kinds == int(mi.BSDFFlags.DiffuseReflection))
    return dr.select(plain, mi.Color3f(bsdf.eval_diffuse_reflectance(si, plain)), value)
