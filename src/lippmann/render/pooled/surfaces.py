"""What of a surface's light can be shared: its diffuse part, and the rest of a rough one.

Light that leaves a surface is split as ``D * E + rest``. ``E`` is the light that falls on it (over pi: the radiance of
a white diffuse surface), the same from everywhere; ``D`` the share that the diffuse part sends back, textures and all.
The rest is whatever the surface's own formula says beyond that: if ``D`` is a little off, the rest makes up for it, and
the sum stays exact. A rough rest, divided by the reflectance ``M`` of its lobe, can be shared among like directions; a
sharp one cannot, and is followed like a mirror.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.scene.build import microfacet

#: Lobes with a smaller ``alpha`` (glTF's roughness squared) are followed instead of shared.
LEAST_SHARED_ALPHA = 0.04
#: The same where the lobe reflects less than ``FAINT``: what little it shows may be coarser.
LEAST_FAINT_ALPHA, FAINT = 0.008, 0.15
#: Reflectance head-on of what a surface that says nothing of its index reflects.
PLAIN_F0 = 0.04


@dataclass
class Split:
    """A surface at the points of a wavefront.

    Attributes
    ----------
    diffuse:
        ``D``; 0 where there is no diffuse part.
    gloss:
        ``M``; only where ``shares_rest``.
    alpha:
        Width of the lobe of the rest.
    shares_diffuse, shares_rest, follows_rest:
        What there is, and what becomes of it.
    normal:
        The normal that counts for shading, on the viewer's side, in world space.
    opacity:
        Share of the surface that is there.
    """

    diffuse: Any
    gloss: Any
    alpha: Any
    shares_diffuse: Any
    shares_rest: Any
    follows_rest: Any
    normal: Any
    opacity: Any


@dataclass(frozen=True)
class Kinds:
    """What kinds of surfaces a scene has: ``glossy`` ones, such that let rays through (``null``), ``foreign`` plugins
    that do not tell their roughness."""

    glossy: bool
    null: bool
    foreign: bool

    @staticmethod
    def of(scene: Any, has_null: bool) -> Kinds:
        """Look through the shapes of a ``mi.Scene``."""
        surfaces = [shape.bsdf() for shape in scene.shapes()]
        glossy = [b for b in surfaces if b is None or mi.has_flag(b.flags(), mi.BSDFFlags.Glossy)]
        own = [b for b in glossy if str(b).startswith("SurfaceBSDF")]
        return Kinds(bool(glossy), has_null, len(own) < len(glossy))


@cache
def _gloss_albedo(variant: str) -> Any:
    assert variant == mi.variant()
    table = np.ascontiguousarray(microfacet.gloss_albedo_table()[:, :, :2])
    return mi.Texture2f(mi.TensorXf(table), wrap_mode=dr.WrapMode.Clamp, migrate=False)


def prepare() -> None:
    """Fill the table that :func:`split` looks things up in: it must not be made while a kernel is recorded."""
    _gloss_albedo(mi.variant())


def split(si: Any, bsdf: Any, kinds: Kinds, active: Any) -> Split:
    """Split the light of the surfaces at ``si``."""
    flags = bsdf.flags()
    is_diffuse = mi.has_flag(flags, mi.BSDFFlags.Diffuse)
    is_glossy = mi.has_flag(flags, mi.BSDFFlags.Glossy)
    is_delta = mi.has_flag(flags, mi.BSDFFlags.Delta)
    named, alpha, gloss, reflected = mi.Bool(True), mi.Float(1), mi.Color3f(1), mi.Float(0)
    if kinds.glossy:
        roughness = bsdf.eval_attribute_1("roughness", si, active)
        metallic = bsdf.eval_attribute_1("metallic", si, active)
        base = mi.Color3f(bsdf.eval_attribute_3("base_color", si, active))
        through = bsdf.eval_attribute_1("transmission", si, active)
        alpha = dr.square(roughness)
        if kinds.foreign:
            named = bsdf.has_attribute("roughness", active)
            mirrored = mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z)
            peak = bsdf.pdf(mi.BSDFContext(), si, mirrored, active & ~named)
            # A lobe's density towards its mirror direction is 1 / (4 pi alpha^2), where it is drawn from alone.
            alpha = dr.select(named, alpha, dr.rsqrt(dr.maximum(4 * dr.pi * peak, 1)))
        albedo = _gloss_albedo(mi.variant()).eval(mi.Point2f(dr.abs(si.wi.z), dr.sqrt(alpha)))
        reflected = PLAIN_F0 * albedo[0] + albedo[1]
        gloss = dr.lerp(mi.Color3f(reflected) + base * through, base * albedo[0] + albedo[1], metallic)
    diffuse = mi.Color3f(bsdf.eval_diffuse_reflectance(si, active))
    diffuse *= dr.select(is_glossy & named, 1 - reflected, 1)
    # A plugin that knows one side only scatters nothing on the other.
    both_sides = mi.has_flag(flags, mi.BSDFFlags.BackSide)
    diffuse = dr.select(is_diffuse & active & ((si.wi.z > 0) | both_sides), diffuse, 0)
    opacity = mi.Float(1)
    if kinds.null:
        partly = mi.has_flag(flags, mi.BSDFFlags.Null) & (is_diffuse | is_glossy)
        opacity = dr.select(partly, 1 - mi.Color3f(bsdf.eval_null_transmission(si, active)).x, 1)
    normal = mi.Vector3f(si.sh_frame.n) * dr.select(si.wi.z < 0, -1.0, 1.0)
    rough = alpha >= dr.select(named & (dr.max(gloss) < FAINT), LEAST_FAINT_ALPHA, LEAST_SHARED_ALPHA)
    mapped = mi.Vector3f(bsdf.eval_attribute_3("normal", si, active))
    return Split(
        diffuse=diffuse,
        gloss=dr.select(named, dr.maximum(gloss, 1e-3), 1),
        alpha=alpha,
        shares_diffuse=active & (dr.max(diffuse) > 0),
        shares_rest=active & is_glossy & ~is_delta & rough,
        follows_rest=active & (is_delta | (is_glossy & ~rough)),
        normal=dr.select(dr.squared_norm(mapped) > 0.25, dr.normalize(mapped), normal),
        opacity=opacity,
    )
