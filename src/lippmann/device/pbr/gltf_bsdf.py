"""A surface that scatters light as glTF 2.0 says, as a Mitsuba BSDF.

Mitsuba's own ``principled`` follows another model: its diffuse lobe alone sends back up to 1.3 times the light that
falls on a rough white surface, it knows no specular colour or texture, and its clear coat has another shape. This
plugin writes the specification's formulas down instead (appendix B of glTF 2.0 and KHR_materials_{ior, specular,
transmission, volume, clearcoat, sheen, anisotropy, iridescence}); ``docs/reference/materials.md`` says where it had to
choose.

Inside, all directions are flipped so that the viewer is above the surface (z > 0): both sides of an opaque or thin
surface look alike. A surface that encloses a solid refracts instead. A normal map may tilt a lobe so far that it sends
light below the surface: such light is folded back up, as if the next slope reflected it, so that none is lost.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import replace

from lippmann.device.kernel_ops import arrays_of
from lippmann.device.pbr import microfacet
from lippmann.device.pbr.gltf_bsdf_parameters import Lobe, Point, Sheen, SurfaceModel
from lippmann.device.pbr.textures import Place
from lippmann.device.types import (
    BSDF,
    Bool,
    BSDFContext,
    BSDFSample3f,
    Color3f,
    Float,
    Point2f,
    Properties,
    Spectrum,
    SurfaceInteraction3f,
    UInt32,
    Vector3f,
)

#: The attribute that tells the normal of a surface's narrow lobe, in the frame of the interaction and on the viewer's
#: side: that of the clear coat, else of the body; 0 where neither is narrow.
SHARP_LOBE = "sharp_lobe"
#: Set in the sampled type of an event that keeps an image sharp, whichever lobe was sampled; see
#: :func:`~lippmann.device.pbr.microfacet.is_sharp`.
SHARP_EVENT = 1 << 29
#: The attribute that tells the albedo of the light which a surface scatters alike in all directions, its opacity
#: included; 0 for surfaces whose other layers dim it by direction (cloth), or whose normal is not the surface's own.
LAMBERTIAN = "lambertian"
#: The attribute that is 1 where no lobe of a surface is too narrow for photons to show it, its sharp one apart.
WIDE_LOBES = "wide_lobes"
#: Asked for among the types of a ``BSDFContext``, beside those of Mitsuba: narrow lobes are drawn from where there are
#: any, wide ones hardly ever. The weight of a sample goes by that; its pdf is that of plain sampling all the same, as
#: MIS with emitters that plain paths sample needs it.
SHARP_FIRST = 1 << 30
#: Factor of a wide lobe's chance then. With 0, directions that narrow lobes hardly reach would be rare and bright.
_WIDE_CHANCE = 0.1
#: A lobe is wide whose GGX widths are above this.
WIDE_ALPHA = 0.04


def surface_bsdf(model: SurfaceModel) -> BSDF:
    """A ``mi.BSDF`` that evaluates ``model``, for the variant that is set."""
    import mitsuba as mi

    return _bsdf_class(mi.variant())(mi.Properties("lippmann_surface"), model)


@functools.cache
def _bsdf_class(variant: str) -> type[BSDF]:
    """The plugin class of one variant: Mitsuba's base classes differ between them."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.pbr.surface_point import fresnel, mapped_normal, reflecting_chance, surface_point

    assert variant == mi.variant()
    sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
    reflecting = int(mi.BSDFFlags.GlossyReflection)
    transmitting = int(mi.BSDFFlags.GlossyTransmission)
    scattering = int(mi.BSDFFlags.DiffuseReflection)
    passing = int(mi.BSDFFlags.Null)

    class SurfaceBSDF(mi.BSDF):  # type: ignore[misc, unused-ignore]
        """See the module."""

        # At each launch of a frozen kernel Dr.Jit looks through the attributes of all plugins for arrays. In slots it
        # does not look: through a model with its many parts, most of them not there, it takes longer than the launch.
        __slots__ = ("__dict__", "_is_directional", "_is_glossy", "_may_be_sharp", "kinds", "model")

        def __init__(self, props: Properties, model: SurfaceModel) -> None:
            super().__init__(props)
            self.model = model
            self.arrays = arrays_of(model)
            self._is_glossy = model.metal or not model.dull
            present = {
                scattering: not model.metal,
                reflecting: self._is_glossy or model.clearcoat is not None,
                transmitting: model.transmission is not None,
                passing: model.opacity is not None,
            }
            self.kinds = [kind for kind, there in present.items() if there]
            self.m_components = [int(mi.BSDFFlags(kind) | sides) for kind in self.kinds]
            self.m_flags = functools.reduce(lambda a, b: a | b, self.m_components)
            self._is_directional = (
                model.metal or model.sheen_color is not None or model.normal is not None or model.film is not None
            )
            signals = [model.roughness] if self._is_glossy else []
            if model.clearcoat_roughness is not None:
                signals.append(model.clearcoat_roughness)
            self._may_be_sharp = any(signal.may_be_below(math.sqrt(microfacet.NARROW_ALPHA)) for signal in signals)

        # ---- what integrators call ----

        def sample(
            self, ctx: BSDFContext, si: SurfaceInteraction3f, sample1: Float, sample2: Point2f, active: Bool = True
        ) -> tuple[BSDFSample3f, Color3f]:
            place = Place(si, active)
            return self._sample_at(ctx, place, surface_point(self.model, place), sample1, sample2)

        def _sample_at(
            self, ctx: BSDFContext, place: Place, point: Point, sample1: Float, sample2: Point2f
        ) -> tuple[BSDFSample3f, Color3f]:
            si, drawn = place.si, point
            opacity = None if self.model.opacity is None else self.model.coverage(place)
            u = sample1 if opacity is None else dr.minimum(sample1 / opacity, 1)
            if self._may_be_sharp and ctx.type_mask & SHARP_FIRST:
                drawn = self._sharp_first(point)
            wo, kind, possible = self._sample_lobes(drawn, u, sample2)
            value, pdf = self._scatter(point, wo)
            density = pdf if drawn is point else self._scatter(drawn, wo)[1]
            pdf = dr.select(possible, pdf, 0)
            weight = dr.select(possible & (density > 0), value / density, 0)
            eta: Float = dr.select(kind == transmitting, point.eta, 1) if self.model.solid else mi.Float(1)
            if opacity is not None:
                passes = sample1 >= opacity
                wo, pdf = dr.select(passes, -si.wi, wo), dr.select(passes, 1 - opacity, pdf * opacity)
                kind, eta = dr.select(passes, passing, kind), dr.select(passes, 1, eta)
                weight = dr.select(passes, mi.Color3f(1), weight)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo, bs.pdf, bs.eta, bs.sampled_type = wo, pdf, eta, kind
            for index, flag in enumerate(self.kinds):
                bs.sampled_component = dr.select(kind == flag, index, bs.sampled_component)
            if self._may_be_sharp:
                sharp = (kind != passing) & microfacet.is_sharp(si.wi, wo, self._sharp_normal(point))
                bs.sampled_type |= dr.select(sharp, mi.UInt32(SHARP_EVENT), 0)
            return bs, weight & place.active

        def eval_pdf(
            self, ctx: BSDFContext, si: SurfaceInteraction3f, wo: Vector3f, active: Bool = True
        ) -> tuple[Color3f, Float]:
            del ctx
            place = Place(si, active)
            return self._eval_at(place, surface_point(self.model, place), wo)

        def _eval_at(self, place: Place, point: Point, wo: Vector3f) -> tuple[Color3f, Float]:
            value, pdf = self._scatter(point, wo)
            if self.model.opacity is not None:
                opacity = self.model.coverage(place)
                value, pdf = value * opacity, pdf * opacity
            return value & place.active, pdf & place.active

        def eval_pdf_sample(
            self,
            ctx: BSDFContext,
            si: SurfaceInteraction3f,
            wo: Vector3f,
            sample1: Float,
            sample2: Point2f,
            active: Bool = True,
        ) -> tuple[Color3f, Float, BSDFSample3f, Color3f]:
            place = Place(si, active)
            point = surface_point(self.model, place)
            return *self._eval_at(place, point, wo), *self._sample_at(ctx, place, point, sample1, sample2)

        def eval(self, ctx: BSDFContext, si: SurfaceInteraction3f, wo: Vector3f, active: Bool = True) -> Color3f:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: BSDFContext, si: SurfaceInteraction3f, wo: Vector3f, active: Bool = True) -> Float:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_null_transmission(self, si: SurfaceInteraction3f, active: Bool = True) -> Color3f:
            if self.model.opacity is None:
                return mi.Color3f(0)
            return mi.Color3f(1 - self.model.coverage(Place(si, active))) & active

        def eval_diffuse_reflectance(self, si: SurfaceInteraction3f, active: Bool = True) -> Color3f:
            place = Place(si, active)
            share = (1 - self.model.metalness(place)) * (1 - self.model.clarity(place))
            return (self.model.base(place) * share) & active

        def has_attribute(self, name: str, active: Bool = True) -> Bool:
            del active
            if name == SHARP_LOBE:
                return mi.Bool(self._may_be_sharp)
            if name in (LAMBERTIAN, WIDE_LOBES):
                return mi.Bool(True)
            return mi.Bool(name in ("base_color", "normal", "roughness", "metallic", "transmission"))

        def eval_attribute_1(self, name: str, si: SurfaceInteraction3f, active: Bool = True) -> Float:
            if name == WIDE_LOBES:
                return self._has_wide_lobes(surface_point(self.model, Place(si, active))) & active
            values = {
                "roughness": self.model.roughness.eval,
                "metallic": self.model.metalness,
                "transmission": self.model.clarity,
            }
            return (values[name](Place(si, active)) & active) if name in values else mi.Float(0)

        def eval_attribute_3(self, name: str, si: SurfaceInteraction3f, active: Bool = True) -> Color3f:
            if name == "base_color":
                return self.model.base(Place(si, active)) & active
            if name == "normal":  # in world space, on the viewer's side
                flip = dr.select(si.wi.z < 0, mi.Float(-1), 1)
                n = mapped_normal(self.model.normal, Place(si, active), flip)
                return mi.Color3f(si.to_world(mi.Vector3f(n.x, n.y, n.z * flip))) & active
            if name == LAMBERTIAN and not self._is_directional:
                return self._lambertian(Place(si, active)) & active
            if name == SHARP_LOBE and self._may_be_sharp:
                return mi.Color3f(self._sharp_normal(surface_point(self.model, Place(si, active)))) & active
            return mi.Color3f(0)

        def eval_attribute(self, name: str, si: SurfaceInteraction3f, active: Bool = True) -> Color3f:
            return self.eval_attribute_3(name, si, active)

        def to_string(self) -> str:
            return f"SurfaceBSDF[flags = {self.m_flags:#x}]"

        # ---- narrow lobes ----

        def _narrow(self, lobe: Lobe) -> Bool:
            return lobe.alpha.x < microfacet.NARROW_ALPHA

        def _narrow_body(self, point: Point) -> Bool:
            return self._narrow(point.lobe) if self._is_glossy else mi.Bool(False)

        def _narrow_coat(self, point: Point) -> Bool:
            coat = point.coat
            return mi.Bool(False) if coat is None else self._narrow(coat.lobe) & (coat.weight > 0)

        def _sharp_first(self, point: Point) -> Point:
            """See :data:`SHARP_FIRST`: ``point`` with other chances."""
            body, coat = self._narrow_body(point), point.coat
            diffuse_chance = dr.select(body, _WIDE_CHANCE * point.diffuse_chance, point.diffuse_chance)
            if coat is not None:
                gloss = self._narrow_coat(point)
                above = dr.select(body, coat.chance, 1 - _WIDE_CHANCE * (1 - coat.chance))
                below = dr.select(body, _WIDE_CHANCE * coat.chance, coat.chance)
                coat = replace(coat, chance=dr.select(gloss, above, below))
            return replace(point, diffuse_chance=diffuse_chance, coat=coat)

        def _has_wide_lobes(self, point: Point) -> Float:
            """See :data:`WIDE_LOBES`."""
            lobes = [point.lobe] if self._is_glossy else []
            if point.coat is not None:
                lobes.append(point.coat.lobe)
            wide = mi.Bool(True)
            for lobe in lobes:
                wide &= self._narrow(lobe) | (dr.minimum(lobe.alpha.x, lobe.alpha.y) > WIDE_ALPHA)
            return dr.select(wide, mi.Float(1), 0)

        def _sharp_normal(self, point: Point) -> Vector3f:
            """See :data:`SHARP_LOBE`."""
            up = mi.Vector3f(0, 0, 1)
            n = dr.select(self._narrow_body(point), up if point.lobe.frame is None else point.lobe.frame.n, 0)
            if point.coat is not None:
                frame = point.coat.lobe.frame
                n = dr.select(self._narrow_coat(point), up if frame is None else frame.n, n)
            return mi.Vector3f(n.x, n.y, n.z * point.flip)

        def _lambertian(self, place: Place) -> Color3f:
            """See :data:`LAMBERTIAN`: what the factors of the diffuse term of :meth:`_scatter` make of it."""
            point = surface_point(self.model, place)
            albedo = point.base * (point.below * (1 - point.metallic) * (1 - point.transmission))
            if point.coat is not None:
                albedo = albedo * (1 - point.coat.weight)
            return albedo if self.model.opacity is None else albedo * self.model.coverage(place)

        # ---- scattering ----

        def _sample_lobes(self, point: Point, u: Float, sample: Point2f) -> tuple[Vector3f, UInt32, Bool]:
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
            kind = mi.UInt32(reflecting)
            if self.model.transmission is not None:
                through = ~coated & (u >= reflecting_chance(self.model, point, *fresnel(self.model, point, cosine)))
                beyond = mi.Vector3f(wo.x, wo.y, -wo.z)
                if self.model.solid:
                    _, cos_t, _, eta_ti = mi.fresnel(cosine, point.eta)
                    beyond = mi.refract(wi, mi.Normal3f(h), cos_t, eta_ti)
                    possible = dr.select(through, beyond.z < 0, possible)
                wo = dr.select(through, beyond, wo)
                kind = dr.select(through, transmitting, kind)
            wo = dr.select(diffuse, mi.warp.square_to_cosine_hemisphere(sample), wo)
            kind = dr.select(diffuse, scattering, kind)

            world = wo if lobe.frame is None else lobe.frame.to_world(wo)
            if coat is not None:
                world = dr.select(coated, wo if coat.lobe.frame is None else coat.lobe.frame.to_world(wo), world)
            height = dr.abs(world.z) * dr.select(kind == transmitting, -point.flip, point.flip)
            return mi.Vector3f(world.x, world.y, height), kind, possible | diffuse

        def _scatter(self, point: Point, wo: Vector3f) -> tuple[Color3f, Float]:
            """BSDF times cosine, and the density of :meth:`_sample_lobes`, for ``wo`` in the surface's frame."""
            wo = mi.Vector3f(wo.x, wo.y, wo.z * point.flip)
            above = wo.z > 0
            value, pdf = self._fold_below(point.lobe, wo, lambda way: self._body(point, way, above))
            coat = point.coat
            if coat is not None:
                gloss, gloss_pdf = self._fold_below(coat.lobe, wo, lambda way: self._coat_gloss(coat.lobe, way))
                value = value * (1 - coat.weight) + (gloss * (coat.gain * coat.weight) & above)
                pdf = dr.lerp(pdf, gloss_pdf & above, coat.chance)
            return value, pdf

        def _fold_below(
            self, lobe: Lobe, wo: Vector3f, scatter: Callable[[Vector3f], tuple[Color3f, Float]]
        ) -> tuple[Color3f, Float]:
            """Value and density of a lobe, with what a tilted one sends through the surface folded back about it."""
            wo_local = wo if lobe.frame is None else lobe.frame.to_local(wo)
            value, pdf = scatter(wo_local)
            if lobe.tilted:
                assert lobe.frame is not None
                folded_value, folded_pdf = scatter(lobe.frame.to_local(mi.Vector3f(wo.x, wo.y, -wo.z)))
                value, pdf = value + folded_value, pdf + folded_pdf
            return value, pdf

        def _coat_gloss(self, lobe: Lobe, wo: Vector3f) -> tuple[Float, Float]:
            gloss, pdf, _, _ = self._gloss(lobe, wo)
            return gloss & (wo.z > 0), pdf & (wo.z > 0)

        def _gloss(self, lobe: Lobe, wo: Vector3f) -> tuple[Float, Float, Float, Vector3f]:
            """Microfacet reflection without Fresnel factor, times cosine: value, density, cosine at h, h."""
            h = dr.normalize(lobe.wi + wo)
            cosine = dr.dot(lobe.wi, h)
            facets = microfacet.ggx_density(h, lobe.alpha)
            value = facets * microfacet.ggx_visibility(lobe.wi, wo, lobe.alpha) * wo.z
            pdf = microfacet.visible_normal_pdf(lobe.wi, cosine, facets, lobe.alpha) / (4 * cosine)
            return value, pdf, cosine, h

        def _body(self, point: Point, wo: Vector3f, above: Bool) -> tuple[Color3f, Float]:
            """All below the clear coat; ``wo`` is in the lobe's frame and leaves ``above`` the surface or below it."""
            m, lobe = self.model, point.lobe
            is_visible = (lobe.wi.z > 0) & ((wo.z > 0) == above) & (wo.z != 0)
            mirrored = mi.Vector3f(wo.x, wo.y, dr.abs(wo.z))

            gloss, gloss_pdf, cosine, h = self._gloss(lobe, mirrored)
            metal, dielectric = fresnel(self.model, point, cosine)
            entering = (1 - dr.max(dielectric)) * (1 - point.metallic) * point.base
            reflects = reflecting_chance(self.model, point, metal, dielectric)
            diffuse = mirrored.z * dr.inv_pi
            value = dr.lerp(dielectric * point.gain, metal * point.metal_gain, point.metallic) * gloss
            value += point.base * (point.below * (1 - point.metallic) * (1 - point.transmission) * diffuse)
            pdf = dr.lerp(reflects * gloss_pdf, diffuse, point.diffuse_chance)
            if point.sheen is not None:
                value = self._under_cloth(point.sheen, value, lobe.wi.z, mirrored.z, h.z)
            if m.transmission is None:
                return value & (is_visible & above), pdf & (is_visible & above)

            if m.solid:
                gloss, gloss_pdf, cosine = self._refraction(point, wo)
                metal, dielectric = fresnel(self.model, point, cosine)
                entering = (1 - dr.max(dielectric)) * (1 - point.metallic) * point.base
                reflects = reflecting_chance(self.model, point, metal, dielectric)
            through = entering * (point.transmission * point.gain * gloss)
            through_pdf = (1 - point.diffuse_chance) * (1 - reflects) * gloss_pdf
            return dr.select(above, value, through) & is_visible, dr.select(above, pdf, through_pdf) & is_visible

        def _under_cloth(self, sheen: Sheen, value: Spectrum, cos_i: Float, cos_o: Float, cos_h: Float) -> Color3f:
            """``value`` dimmed by the fibres above it, and their own light."""
            hidden = sheen.albedo(cos_i)
            if not self.model.compensates:  # glTF takes the larger share of the two directions, and so loses light
                hidden = dr.maximum(hidden, sheen.albedo(cos_o))
            hidden *= dr.max(sheen.color)
            fibres = microfacet.charlie_density(cos_h, sheen.alpha)
            fibres *= microfacet.charlie_visibility(cos_i, cos_o, sheen.alpha) * cos_o
            return value * (1 - hidden) + sheen.color * fibres

        def _refraction(self, point: Point, wo: Vector3f) -> tuple[Float, Float, Float]:
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

    return SurfaceBSDF
