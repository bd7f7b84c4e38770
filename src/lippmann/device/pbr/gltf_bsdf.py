"""A surface that scatters light as glTF 2.0 says, as a Mitsuba BSDF.

Mitsuba's own ``principled`` follows another model: its diffuse lobe alone sends back up to 1.3 times the light that
falls on a rough white surface, it knows no specular colour or texture, and its clear coat has another shape. This
plugin writes the specification's formulas down instead (appendix B of glTF 2.0 and KHR_materials_{ior, specular,
transmission, volume, clearcoat, sheen}); ``docs/reference/materials.md`` says where it had to choose.

Inside, all directions are flipped so that the viewer is above the surface (z > 0): both sides of an opaque or thin
surface look alike. A surface that encloses a solid refracts instead.
"""

from __future__ import annotations

import functools
from typing import Any

from lippmann.device.pbr import microfacet
from lippmann.device.pbr.gltf_bsdf_parameters import Coat, Lobe, NormalMap, Point, Sheen, SurfaceModel
from lippmann.device.pbr.texture_lookup import Place, Signal

#: Reflectance of the clear coat seen head-on (refractive index 1.5).
COAT_F0 = 0.04


def surface_bsdf(model: SurfaceModel) -> Any:
    """A ``mi.BSDF`` that evaluates ``model``, for the variant that is set."""
    import mitsuba as mi

    return _bsdf_class(mi.variant())(mi.Properties("lippmann_surface"), model)


@functools.cache
def _bsdf_class(variant: str) -> Any:
    """The plugin class of one variant: Mitsuba's base classes differ between them."""
    import drjit as dr
    import mitsuba as mi

    assert variant == mi.variant()
    sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
    reflecting = int(mi.BSDFFlags.GlossyReflection)
    transmitting = int(mi.BSDFFlags.GlossyTransmission)
    scattering = int(mi.BSDFFlags.DiffuseReflection)
    passing = int(mi.BSDFFlags.Null)

    class SurfaceBSDF(mi.BSDF):  # type: ignore[misc, unused-ignore]
        """See the module."""

        def __init__(self, props: Any, model: SurfaceModel) -> None:
            super().__init__(props)
            self.model = model
            present = {
                scattering: not model.metal,
                reflecting: model.metal or not model.dull or model.clearcoat is not None,
                transmitting: model.transmission is not None,
                passing: model.opacity is not None,
            }
            self.kinds = [kind for kind, there in present.items() if there]
            self.m_components = [int(mi.BSDFFlags(kind) | sides) for kind in self.kinds]
            self.m_flags = functools.reduce(lambda a, b: a | b, self.m_components)

        # ---- what integrators call ----

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            del ctx
            place = Place(si, active)
            opacity = None if self.model.opacity is None else self.model.coverage(place)
            u = sample1 if opacity is None else dr.minimum(sample1 / opacity, 1)
            point = self._point(place)
            wo, kind, possible = self._draw(point, u, sample2)
            value, pdf = self._scatter(point, wo)
            pdf = dr.select(possible, pdf, 0)
            weight = dr.select(pdf > 0, value / pdf, 0)
            eta: Any = dr.select(kind == transmitting, point.eta, 1) if self.model.solid else mi.Float(1)
            if opacity is not None:
                passes = sample1 >= opacity
                wo, pdf = dr.select(passes, -si.wi, wo), dr.select(passes, 1 - opacity, pdf * opacity)
                kind, eta = dr.select(passes, passing, kind), dr.select(passes, 1, eta)
                weight = dr.select(passes, mi.Color3f(1), weight)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo, bs.pdf, bs.eta, bs.sampled_type = wo, pdf, eta, kind
            for index, flag in enumerate(self.kinds):
                bs.sampled_component = dr.select(kind == flag, index, bs.sampled_component)
            return bs, weight & active

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            del ctx
            place = Place(si, active)
            value, pdf = self._scatter(self._point(place), wo)
            if self.model.opacity is not None:
                opacity = self.model.coverage(place)
                value, pdf = value * opacity, pdf * opacity
            return value & active, pdf & active

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            if self.model.opacity is None:
                return mi.Color3f(0)
            return mi.Color3f(1 - self.model.coverage(Place(si, active))) & active

        def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
            place = Place(si, active)
            share = (1 - self.model.metalness(place)) * (1 - self.model.clarity(place))
            return (self.model.base(place) * share) & active

        def has_attribute(self, name: str, active: Any = True) -> Any:
            del active
            return mi.Bool(name in ("base_color", "normal", "roughness", "metallic", "transmission"))

        def eval_attribute_1(self, name: str, si: Any, active: Any = True) -> Any:
            values = {
                "roughness": self.model.roughness.eval,
                "metallic": self.model.metalness,
                "transmission": self.model.clarity,
            }
            return (values[name](Place(si, active)) & active) if name in values else mi.Float(0)

        def eval_attribute_3(self, name: str, si: Any, active: Any = True) -> Any:
            if name == "base_color":
                return self.model.base(Place(si, active)) & active
            if name == "normal":  # in world space, on the viewer's side
                flip = dr.select(si.wi.z < 0, mi.Float(-1), 1)
                n = self._normal(self.model.normal, Place(si, active), flip)
                return mi.Color3f(si.to_world(mi.Vector3f(n.x, n.y, n.z * flip))) & active
            return mi.Color3f(0)

        def eval_attribute(self, name: str, si: Any, active: Any = True) -> Any:
            return self.eval_attribute_3(name, si, active)

        def to_string(self) -> str:
            return f"SurfaceBSDF[flags = {self.m_flags:#x}]"

        # ---- the surface at a point ----

        def _point(self, place: Place) -> Point:
            m = self.model
            outside = place.si.wi.z >= 0
            ior = m.ior.eval(place)
            f0 = mi.Color3f(dr.square((ior - 1) / (ior + 1)))
            if m.specular_color is not None:
                f0 = dr.minimum(f0 * m.specular_color.eval(place), 1)
            flip = dr.select(outside, mi.Float(1), -1)
            point = Point(
                flip=flip,
                lobe=self._lobe(m.normal, m.roughness, place, flip),
                base=m.base(place),
                metallic=m.metalness(place),
                transmission=m.clarity(place),
                eta=dr.select(outside, ior, dr.rcp(ior)) if m.solid else ior,
                f0=f0,
                specular=mi.Float(0 if m.dull else 1) if m.specular is None else m.specular.eval(place),
            )
            if m.sheen_color is not None:
                point.sheen = self._sheen(place)
            self._weigh_lobes(point, place, outside)
            return point

        def _lobe(self, normal_map: NormalMap | None, roughness: Signal, place: Place, flip: Any) -> Lobe:
            wi = mi.Vector3f(place.si.wi.x, place.si.wi.y, dr.abs(place.si.wi.z))
            alpha = dr.clip(dr.square(roughness.eval(place)), microfacet.MIN_ALPHA, 1)
            if normal_map is None:
                return Lobe(None, wi, alpha)
            frame = mi.Frame3f(self._normal(normal_map, place, flip))
            return Lobe(frame, frame.to_local(wi), alpha)

        def _normal(self, normal_map: NormalMap | None, place: Place, flip: Any) -> Any:
            """The mapped normal in the flipped local frame."""
            if normal_map is None:
                return mi.Vector3f(0, 0, 1)
            si = place.si
            texel = normal_map.lookup.eval(place) * 2 - 1
            # The map's x runs along +u and its y up the picture, against v. Seen from behind, a bump is a dent: the
            # normal turns around as a whole.
            along_u, along_v = si.to_local(si.dp_du), si.to_local(si.dp_dv)
            length = dr.sqrt(dr.square(along_u.x) + dr.square(along_u.y))
            tx = dr.select(length > 0, along_u.x / length, 1)
            ty = dr.select(length > 0, along_u.y / length, 0)
            up = dr.select(tx * along_v.y - ty * along_v.x > 0, mi.Float(-1), 1)
            scale = normal_map.scale.eval(place)
            x, y = texel.x * scale * flip, texel.y * scale * up * flip
            n = dr.normalize(mi.Vector3f(x * tx - y * ty, x * ty + y * tx, texel.z))
            # A normal that faces away from the viewer cannot be seen; its mirror image about z can.
            away = n.x * si.wi.x + n.y * si.wi.y + n.z * dr.abs(si.wi.z) <= 0
            return mi.Vector3f(dr.select(away, -n.x, n.x), dr.select(away, -n.y, n.y), n.z)

        def _sheen(self, place: Place) -> Sheen:
            m = self.model
            assert m.sheen_color is not None
            assert m.sheen_roughness is not None
            roughness = dr.clip(m.sheen_roughness.eval(place), 0, 1)

            def albedo(cosine: Any) -> Any:
                at = dr.zeros(mi.SurfaceInteraction3f)
                at.uv = mi.Point2f(cosine, roughness)
                return m.sheen_albedo.eval_1(at)

            alpha = dr.maximum(dr.square(roughness), microfacet.MIN_ALPHA)
            return Sheen(m.sheen_color.eval(place), alpha, albedo)

        def _weigh_lobes(self, point: Point, place: Place, outside: Any) -> None:
            """The share of light that gets below the interface, and lobes' chances by the light that they send back."""
            m = self.model
            cosine = point.lobe.wi.z
            if m.metal or m.dull:
                metal, point.below = self._fresnel(point, cosine)[0], mi.Float(1)
            else:
                at = dr.zeros(mi.SurfaceInteraction3f)
                at.uv = mi.Point2f(cosine, dr.sqrt(point.lobe.alpha))
                albedo = m.gloss_albedo.eval_3(at)
                metal = point.base * albedo.x + albedo.y
                point.below = 1 - dr.clip(dr.max(point.f0 * albedo.x + albedo.y) * point.specular, 0, 1)
            entering = (1 - point.metallic) * point.below * dr.mean(point.base)
            diffuse = entering * (1 - point.transmission)
            if point.sheen is not None:
                diffuse += dr.max(point.sheen.color) * point.sheen.albedo(cosine)
            sharp = dr.lerp(1 - point.below, dr.mean(metal), point.metallic) + entering * point.transmission
            total = diffuse + sharp
            point.diffuse_chance = dr.select(total > 0, diffuse / total, 1)
            if m.clearcoat is None:
                return
            assert m.clearcoat_roughness is not None
            lobe = self._lobe(m.clearcoat_normal, m.clearcoat_roughness, place, point.flip)
            weight = dr.lerp(mi.Float(COAT_F0), 1, microfacet.schlick_weight(lobe.wi.z))
            weight *= dr.clip(m.clearcoat.eval(place), 0, 1)
            if m.solid:
                weight = dr.select(outside, weight, 0)
            chance = dr.select(weight > 0, weight / (weight + (1 - weight) * total), 0)
            point.coat = Coat(lobe, weight, chance)

        # ---- scattering ----

        def _fresnel(self, point: Point, cosine: Any) -> tuple[Any, Any]:
            """Reflectance of the metal and of the dielectric for light that meets a microfacet at ``cosine``."""
            weight = microfacet.schlick_weight(cosine)
            metal = dr.lerp(point.base, mi.Color3f(1), weight)
            if not self.model.solid:
                return metal, dr.lerp(point.f0, mi.Color3f(1), weight) * point.specular
            # Refraction needs the true curve: Schlick's knows no total reflection. Tints hold only short of that.
            exact = mi.fresnel(cosine, point.eta)[0]
            tint = point.f0 * point.specular / dr.square((point.eta - 1) / (point.eta + 1))
            return metal, dr.select(exact < 1, dr.minimum(exact * tint, 1), 1)

        def _reflecting_chance(self, point: Point, metal: Any, dielectric: Any) -> Any:
            """Chance that a drawn microfacet reflects light instead of letting it through."""
            if self.model.transmission is None:
                return mi.Float(1)
            reflected = dr.lerp(dr.max(dielectric), dr.mean(metal), point.metallic)
            through = (1 - point.metallic) * point.transmission * (1 - dr.max(dielectric)) * dr.mean(point.base)
            return dr.select(reflected + through > 0, reflected / (reflected + through), 1)

        def _draw(self, point: Point, u: Any, sample: Any) -> tuple[Any, Any, Any]:
            """An outgoing direction in the surface's frame, the flag of its lobe, and whether light can go there.

            A microfacet may send light to the wrong side of the surface; such a draw counts as absorbed.
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
                through = ~coated & (u >= self._reflecting_chance(point, *self._fresnel(point, cosine)))
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
            possible = (possible | diffuse) & ((world.z > 0) == (kind != transmitting))
            return mi.Vector3f(world.x, world.y, world.z * point.flip), kind, possible

        def _scatter(self, point: Point, wo: Any) -> tuple[Any, Any]:
            """BSDF times cosine, and the density of :meth:`_draw`, for ``wo`` in the surface's frame."""
            wo = mi.Vector3f(wo.x, wo.y, wo.z * point.flip)
            value, pdf = self._body(point, wo)
            coat = point.coat
            if coat is not None:
                local = wo if coat.lobe.frame is None else coat.lobe.frame.to_local(wo)
                gloss, gloss_pdf, _, _ = self._gloss(coat.lobe, local)
                seen = (local.z > 0) & (wo.z > 0)
                value = value * (1 - coat.weight) + dr.select(seen, gloss * coat.weight, 0)
                pdf = dr.lerp(pdf, dr.select(seen, gloss_pdf, 0), coat.chance)
            return value, pdf

        def _gloss(self, lobe: Lobe, wo: Any) -> tuple[Any, Any, Any, Any]:
            """Microfacet reflection without Fresnel factor, times cosine: value, density, cosine at h, h."""
            h = dr.normalize(lobe.wi + wo)
            cosine = dr.dot(lobe.wi, h)
            facets = microfacet.ggx_density(h, lobe.alpha)
            value = facets * microfacet.ggx_visibility(lobe.wi.z, wo.z, lobe.alpha) * wo.z
            pdf = microfacet.visible_normal_pdf(lobe.wi.z, cosine, facets, lobe.alpha) / (4 * cosine)
            return value, pdf, cosine, h

        def _body(self, point: Point, wo_surface: Any) -> tuple[Any, Any]:
            """All below the clear coat."""
            m, lobe = self.model, point.lobe
            wo = wo_surface if lobe.frame is None else lobe.frame.to_local(wo_surface)
            above = wo_surface.z > 0
            seen = (lobe.wi.z > 0) & ((wo.z > 0) == above) & (wo.z != 0)
            mirrored = mi.Vector3f(wo.x, wo.y, dr.abs(wo.z))

            gloss, gloss_pdf, cosine, h = self._gloss(lobe, mirrored)
            metal, dielectric = self._fresnel(point, cosine)
            entering = (1 - dr.max(dielectric)) * (1 - point.metallic) * point.base
            reflecting_chance = self._reflecting_chance(point, metal, dielectric)
            diffuse = mirrored.z * dr.inv_pi
            value = dr.lerp(dielectric, metal, point.metallic) * gloss
            value += point.base * (point.below * (1 - point.metallic) * (1 - point.transmission) * diffuse)
            pdf = dr.lerp(reflecting_chance * gloss_pdf, diffuse, point.diffuse_chance)
            if point.sheen is not None:
                value = self._under_cloth(point.sheen, value, lobe.wi.z, mirrored.z, h.z)
            if m.transmission is None:
                return value & (seen & above), pdf & (seen & above)

            if m.solid:
                gloss, gloss_pdf, cosine = self._refraction(point, wo)
                metal, dielectric = self._fresnel(point, cosine)
                entering = (1 - dr.max(dielectric)) * (1 - point.metallic) * point.base
                reflecting_chance = self._reflecting_chance(point, metal, dielectric)
            through = entering * (point.transmission * gloss)
            through_pdf = (1 - point.diffuse_chance) * (1 - reflecting_chance) * gloss_pdf
            return dr.select(above, value, through) & seen, dr.select(above, pdf, through_pdf) & seen

        def _under_cloth(self, sheen: Sheen, value: Any, cos_i: Any, cos_o: Any, cos_h: Any) -> Any:
            """``value`` dimmed by the fibres above it, and their own light."""
            hidden = dr.max(sheen.color) * dr.maximum(sheen.albedo(cos_i), sheen.albedo(cos_o))
            fibres = microfacet.charlie_density(cos_h, sheen.alpha)
            fibres *= microfacet.charlie_visibility(cos_i, cos_o, sheen.alpha) * cos_o
            return value * (1 - hidden) + sheen.color * fibres

        def _refraction(self, point: Point, wo: Any) -> tuple[Any, Any, Any]:
            """Rough refraction (Walter et al. 2007, eq. 21) without Fresnel factor: value, density, cosine at h."""
            wi, alpha = point.lobe.wi, point.lobe.alpha
            h = dr.normalize(wi + wo * point.eta)
            h = dr.select(h.z < 0, -h, h)
            cos_i, cos_o = dr.dot(wi, h), dr.dot(wo, h)
            facets = microfacet.ggx_density(h, alpha)
            masking = microfacet.ggx_masking(wi.z, alpha) * microfacet.ggx_masking(dr.abs(wo.z), alpha)
            stretch = dr.square(point.eta) * dr.abs(cos_o) / dr.square(cos_i + point.eta * cos_o)
            # Radiance is squeezed into a smaller solid angle on the dense side: traced backwards, eta squared cancels.
            value = facets * masking * cos_i * stretch / (wi.z * dr.square(point.eta))
            pdf = microfacet.visible_normal_pdf(wi.z, cos_i, facets, alpha) * stretch
            fits = (cos_i > 0) & (cos_o < 0)
            return value & fits, pdf & fits, dr.maximum(cos_i, 0)

    return SurfaceBSDF
