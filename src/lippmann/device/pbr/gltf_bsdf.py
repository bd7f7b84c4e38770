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

from lippmann.device.kernel_ops import arrays_of
from lippmann.device.pbr import microfacet
from lippmann.device.pbr.gltf_bsdf_parameters import Point, SurfaceModel
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
    SurfaceInteraction3f,
    Vector3f,
)

#: The attribute that tells the normal of a surface's narrow lobe, in the frame of the interaction and on the viewer's
#: side: that of the clear coat, else of the body; 0 where neither is narrow.
SHARP_LOBE = "sharp_lobe"
#: The attribute that tells the albedo of the light which a surface scatters alike in all directions, its opacity
#: included; 0 for surfaces whose other layers dim it by direction (cloth), or whose normal is not the surface's own.
LAMBERTIAN = "lambertian"
#: The attribute that is 1 where no lobe of a surface is too narrow for photons to show it, its sharp one apart.
WIDE_LOBES = "wide_lobes"
#: Asked for among the types of a ``BSDFContext``, beside those of Mitsuba: narrow lobes are drawn from where there are
#: any, wide ones hardly ever. The weight of a sample goes by that; its pdf is that of plain sampling all the same, as
#: MIS with emitters that plain paths sample needs it.
SHARP_FIRST = 1 << 30


def surface_bsdf(model: SurfaceModel) -> BSDF:
    """A ``mi.BSDF`` that evaluates ``model``, for the variant that is set."""
    import mitsuba as mi

    return _bsdf_class(mi.variant())(mi.Properties("lippmann_surface"), model)


@functools.cache
def _bsdf_class(variant: str) -> type[BSDF]:
    """The plugin class of one variant: Mitsuba's base classes differ between them."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.pbr import surface_lobes as lobes
    from lippmann.device.pbr.surface_point import mapped_normal, surface_point

    assert variant == mi.variant()
    sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
    passing = int(mi.BSDFFlags.Null)

    class SurfaceBSDF(mi.BSDF):  # type: ignore[misc, unused-ignore]
        """See the module."""

        # At each launch of a frozen kernel Dr.Jit looks through the attributes of all plugins for arrays. In slots it
        # does not look: through a model with its many parts, most of them not there, it takes longer than the launch.
        __slots__ = ("__dict__", "_is_directional", "_may_be_sharp", "kinds", "model")

        def __init__(self, props: Properties, model: SurfaceModel) -> None:
            super().__init__(props)
            self.model = model
            self.arrays = arrays_of(model)
            present = {
                lobes.SCATTERING: not model.metal,
                lobes.REFLECTING: model.is_glossy or model.clearcoat is not None,
                lobes.TRANSMITTING: model.transmission is not None,
                passing: model.opacity is not None,
            }
            self.kinds = [kind for kind, there in present.items() if there]
            self.m_components = [int(mi.BSDFFlags(kind) | sides) for kind in self.kinds]
            self.m_flags = functools.reduce(lambda a, b: a | b, self.m_components)
            self._is_directional = (
                model.metal or model.sheen_color is not None or model.normal is not None or model.film is not None
            )
            signals = [model.roughness] if model.is_glossy else []
            if model.clearcoat_roughness is not None:
                signals.append(model.clearcoat_roughness)
            self._may_be_sharp = any(signal.may_be_below(math.sqrt(microfacet.NARROW_ALPHA)) for signal in signals)

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
                drawn = lobes.favour_sharp_lobes(self.model, point)
            wo, kind, possible = lobes.sample_lobes(self.model, drawn, u, sample2)
            value, pdf = lobes.scatter(self.model, point, wo)
            density = pdf if drawn is point else lobes.scatter(self.model, drawn, wo)[1]
            pdf = dr.select(possible, pdf, 0)
            weight = dr.select(possible & (density > 0), value / density, 0)
            eta: Float = dr.select(kind == lobes.TRANSMITTING, point.eta, 1) if self.model.solid else mi.Float(1)
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
                sharp = (kind != passing) & microfacet.is_sharp(si.wi, wo, lobes.find_sharp_normal(self.model, point))
                bs.sampled_type |= dr.select(sharp, mi.UInt32(lobes.SHARP_EVENT), 0)
            return bs, weight & place.active

        def eval_pdf(
            self, ctx: BSDFContext, si: SurfaceInteraction3f, wo: Vector3f, active: Bool = True
        ) -> tuple[Color3f, Float]:
            del ctx
            place = Place(si, active)
            return self._eval_at(place, surface_point(self.model, place), wo)

        def _eval_at(self, place: Place, point: Point, wo: Vector3f) -> tuple[Color3f, Float]:
            value, pdf = lobes.scatter(self.model, point, wo)
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
                return lobes.has_wide_lobes(self.model, surface_point(self.model, Place(si, active))) & active
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
                return lobes.find_lambertian(self.model, Place(si, active)) & active
            if name == SHARP_LOBE and self._may_be_sharp:
                return (
                    mi.Color3f(lobes.find_sharp_normal(self.model, surface_point(self.model, Place(si, active))))
                    & active
                )
            return mi.Color3f(0)

        def eval_attribute(self, name: str, si: SurfaceInteraction3f, active: Bool = True) -> Color3f:
            return self.eval_attribute_3(name, si, active)

        def to_string(self) -> str:
            return f"SurfaceBSDF[flags = {self.m_flags:#x}]"

    return SurfaceBSDF
