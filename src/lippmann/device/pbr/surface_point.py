"""A glTF surface at one point: lobes, normals, reflectances, and the light that microfacets give back.

Imports Mitsuba, and so only once its variant is set.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.pbr import microfacet
from lippmann.device.pbr.gltf_bsdf_parameters import (
    Anisotropy,
    Coat,
    Lobe,
    NormalMap,
    Point,
    Sheen,
    SurfaceModel,
)
from lippmann.device.pbr.textures import Place, Signal
from lippmann.device.types import Bool, Color3f, Float, Vector3f

#: Reflectance of the clear coat seen head-on (refractive index 1.5).
COAT_F0 = 0.04
#: GGX width from which on what a lobe shows is much the same for all samples.
MUCH_THE_SAME_ALPHA = 0.1
#: Least cosine between a shading normal and the direction from which it is seen.
_GRAZING = 1e-4


def surface_point(model: SurfaceModel, place: Place) -> Point:
    """All that scattering needs to know of ``model`` at a point, seen from the direction of its interaction."""
    outside = place.si.wi.z >= 0
    ior = dr.maximum(model.ior.eval(place), microfacet.MIN_IOR) if model.solid else model.ior.eval(place)
    f0 = mi.Color3f(dr.square((ior - 1) / (ior + 1)))
    if model.specular_color is not None:
        f0 = dr.minimum(f0 * model.specular_color.eval(place), 1)
    flip = dr.select(outside, mi.Float(1), -1)
    point = Point(
        flip=flip,
        lobe=_lobe(model.normal, model.roughness, place, flip, model.anisotropy),
        base=model.base(place),
        metallic=model.metalness(place),
        transmission=model.clarity(place),
        eta=dr.select(outside, ior, dr.rcp(ior)) if model.solid else ior,
        f0=f0,
        specular=mi.Float(0 if model.dull else 1) if model.specular is None else model.specular.eval(place),
    )
    if model.sheen_color is not None:
        point.sheen = _sheen(model, place)
    if model.film is not None:
        share = dr.clip(model.film.share.eval(place), 0, 1)
        point.film = share, dr.maximum(model.film.ior.eval(place), 1), model.film.thickness(place)
    _weigh_lobes(model, point, place, outside)
    return point


def _lobe(
    normal_map: NormalMap | None,
    roughness: Signal,
    place: Place,
    flip: Float,
    anisotropy: Anisotropy | None = None,
) -> Lobe:
    # Normals that all point up, as leaves have them, lie at a right angle to level rays: they would see black.
    wi = mi.Vector3f(place.si.wi.x, place.si.wi.y, dr.maximum(dr.abs(place.si.wi.z), _GRAZING))
    alpha = mi.Point2f(dr.clip(dr.square(roughness.eval(place)), microfacet.MIN_ALPHA, 1))
    if normal_map is None and anisotropy is None:
        return Lobe(None, wi, alpha)
    normal = mapped_normal(normal_map, place, flip)
    frame = mi.Frame3f(normal)
    if anisotropy is not None:
        along, strength = _direction(anisotropy, place)
        frame.s = dr.normalize(along - normal * dr.dot(along, normal))
        frame.t = dr.cross(normal, frame.s)
        alpha.x = dr.lerp(alpha.x, 1, dr.square(strength))
    return Lobe(frame, frame.to_local(wi), alpha, tilted=normal_map is not None)


def _direction(anisotropy: Anisotropy, place: Place) -> tuple[Vector3f, Float]:
    """The direction along which the surface is rougher, in the surface's frame, and the strength there."""
    strength = anisotropy.strength.eval(place)
    x, y = anisotropy.cosine.eval(place), anisotropy.sine.eval(place)
    if anisotropy.lookup is not None:
        texel = anisotropy.lookup.eval(place)
        u, v = texel.x * 2 - 1, texel.y * 2 - 1
        x, y = x * u - y * v, y * u + x * v
        strength = strength * texel.z
    tx, ty, up = _tangent(place, anisotropy.tangents)
    y = y * up
    along = mi.Vector3f(x * tx - y * ty, x * ty + y * tx, 0)
    return dr.select(dr.squared_norm(along) > 0, along, mi.Vector3f(1, 0, 0)), dr.clip(strength, 0, 1)


def _tangent(place: Place, own: bool) -> tuple[Float, Float, Float]:
    """Unit tangent in the surface's plane, x and y, and the sign of the bitangent on its left.

    The tangent runs along +u and the bitangent up the picture, against v, unless the mesh has its ``own``.
    """
    along_u, along_v = place.si.to_local(place.si.dp_du), place.si.to_local(place.si.dp_dv)
    up = dr.select(along_u.x * along_v.y - along_u.y * along_v.x > 0, mi.Float(-1), 1)
    along = along_u
    if own:
        carried = place.tangent
        along = along_u * carried.x + along_v * carried.y
        up = dr.select(carried.z < 0, -up, up)
    length = dr.sqrt(dr.square(along.x) + dr.square(along.y))
    return dr.select(length > 0, along.x / length, 1), dr.select(length > 0, along.y / length, 0), up


def mapped_normal(normal_map: NormalMap | None, place: Place, flip: Float) -> Vector3f:
    """The mapped normal in the flipped local frame."""
    if normal_map is None:
        return mi.Vector3f(0, 0, 1)
    si = place.si
    texel = normal_map.lookup.eval(place) * 2 - 1
    # The map's x runs along the tangent, its y along the bitangent. Seen from behind, a bump is a dent: the normal
    # turns around as a whole.
    tx, ty, up = _tangent(place, normal_map.tangents)
    scale = normal_map.scale.eval(place)
    x, y = texel.x * scale * flip, texel.y * scale * up * flip
    # No normal points into the surface; blue below the middle is an error of the map, such as one of its compression.
    n = dr.normalize(mi.Vector3f(x * tx - y * ty, x * ty + y * tx, dr.maximum(texel.z, _GRAZING)))
    # A normal that faces away from the viewer cannot be seen; its mirror image about z can.
    away = n.x * si.wi.x + n.y * si.wi.y + n.z * dr.abs(si.wi.z) <= 0
    return mi.Vector3f(dr.select(away, -n.x, n.x), dr.select(away, -n.y, n.y), n.z)


def _sheen(model: SurfaceModel, place: Place) -> Sheen:
    assert model.sheen_color is not None
    assert model.sheen_roughness is not None
    table = model.sheen_albedo
    assert table is not None
    roughness = dr.clip(model.sheen_roughness.eval(place), 0, 1)

    def albedo(cosine: Float) -> Float:
        return table.eval(mi.Point2f(cosine, roughness))[0]

    alpha = dr.maximum(dr.square(roughness), microfacet.MIN_ALPHA)
    return Sheen(model.sheen_color.eval(place), alpha, albedo)


def _weigh_lobes(model: SurfaceModel, point: Point, place: Place, outside: Bool) -> None:
    """The share of light that gets below the interface, and lobes' chances by the light that they send back."""
    cosine = point.lobe.wi.z
    if model.gloss_albedo is None:
        metal, point.below = fresnel(model, point, cosine)[0], mi.Float(1)
    else:
        albedo = _gloss_albedo(model, point.lobe)
        whole = albedo.x + albedo.y
        f0, base = (_under_film(point, cosine, bare, bare) for bare in (point.f0, point.base))
        metal = base * albedo.x + albedo.y
        if model.compensates:
            point.metal_gain = 1 + base * (1 - whole) / whole
            if model.transmission is not None:
                point.gain = dr.rcp(_interface_albedo(model, point, outside) if model.solid else whole)
        reflected = dr.max(f0 * albedo.x + albedo.y) * point.specular * point.gain
        point.below = mi.Float(1) if model.metal or model.dull else 1 - dr.clip(reflected, 0, 1)
    entering = (1 - point.metallic) * point.below * dr.mean(point.base)
    diffuse = entering * (1 - point.transmission)
    if point.sheen is not None:
        diffuse += dr.max(point.sheen.color) * point.sheen.albedo(cosine)
    sharp = dr.lerp(1 - point.below, dr.mean(metal), point.metallic) + entering * point.transmission
    total = diffuse + sharp
    point.diffuse_chance = dr.select(total > 0, 1 - _chance(sharp / total, point.lobe), 1)
    if model.clearcoat is None:
        return
    assert model.clearcoat_roughness is not None
    lobe = _lobe(model.clearcoat_normal, model.clearcoat_roughness, place, point.flip)
    weight = dr.lerp(mi.Float(COAT_F0), 1, microfacet.schlick_weight(lobe.wi.z))
    weight *= dr.clip(model.clearcoat.eval(place), 0, 1)
    if model.solid:
        weight = dr.select(outside, weight, 0)
    chance = dr.select(weight > 0, _chance(weight / (weight + (1 - weight) * total), lobe), 0)
    gain = mi.Float(1)
    if model.compensates:
        albedo = _gloss_albedo(model, lobe)
        gain = dr.rcp(albedo.x + albedo.y)
    point.coat = Coat(lobe, weight, chance, gain)


def _chance(share: Float, lobe: Lobe) -> Float:
    """Chance of sampling a lobe that sends back a ``share`` of the light: the root of it where the lobe is narrow.

    What narrow lobes show differs from sample to sample, what wide ones do is much the same; and samples are best
    shared out by how their light varies.
    """
    width = dr.maximum(lobe.alpha.x, lobe.alpha.y) / MUCH_THE_SAME_ALPHA
    return dr.lerp(dr.sqrt(share), share, dr.minimum(width, 1))


def _gloss_albedo(model: SurfaceModel, lobe: Lobe) -> Color3f:
    """Light that the lobe reflects: its share of head-on reflectance, and the rest."""
    assert model.gloss_albedo is not None
    rows = microfacet.GLOSS_ROWS
    at = mi.Point2f(lobe.wi.z, microfacet.roughness_row(lobe.alpha, rows) / rows)
    return mi.Color3f(*model.gloss_albedo.eval(at)[:3])


def _interface_albedo(model: SurfaceModel, point: Point, outside: Bool) -> Float:
    """Share of light that a rough interface of a solid reflects or lets through at its first encounter."""
    known, rows, table = len(microfacet.INTERFACE_F0), microfacet.INTERFACE_ROWS, model.interface_albedo
    assert table is not None
    ior = dr.select(outside, point.eta, dr.rcp(point.eta))
    root = (ior - 1) / (ior + 1)
    place = dr.minimum(dr.sqrt(root / microfacet.INTERFACE_F0[-1]) * (known - 1), known - 1.0001)
    first = dr.floor(place)
    row = microfacet.roughness_row(point.lobe.alpha, rows)

    def albedo(block: Float) -> Float:
        start = block * rows + dr.select(outside, mi.Float(0), known * rows)
        return table.eval(mi.Point2f(point.lobe.wi.z, (start + row) / (2 * known * rows)))[0]

    return dr.lerp(albedo(first), albedo(first + 1), place - first)


def _under_film(point: Point, cosine: Float, f0: Color3f, bare: Color3f) -> Color3f:
    """Reflectance ``bare`` at ``cosine``, blended with that of a thin film over a base of ``f0``."""
    if point.film is None:
        return bare
    from lippmann.device.pbr.thin_film import thin_film_reflectance

    share, ior, thickness = point.film
    return dr.lerp(bare, thin_film_reflectance(cosine, ior, thickness, f0), share)


def fresnel(model: SurfaceModel, point: Point, cosine: Float) -> tuple[Color3f, Color3f]:
    """Reflectance of the metal and of the dielectric for light that meets a microfacet at ``cosine``."""
    weight = microfacet.schlick_weight(cosine)
    metal = _under_film(point, cosine, point.base, dr.lerp(point.base, mi.Color3f(1), weight))
    if not model.solid:
        dielectric = _under_film(point, cosine, point.f0, dr.lerp(point.f0, mi.Color3f(1), weight))
        return metal, dielectric * point.specular
    # Refraction needs the true curve: Schlick's knows no total reflection. Tints hold only short of that.
    exact = mi.fresnel(cosine, point.eta)[0]
    tint = point.f0 * point.specular / dr.square((point.eta - 1) / (point.eta + 1))
    dielectric = dr.minimum(exact * tint, 1)
    if point.film is not None:
        film = _under_film(point, cosine, point.f0, dielectric)
        dielectric = dr.select(point.eta > 1, film, dielectric)
    return metal, dr.select(exact < 1, dielectric, 1)


def reflecting_chance(model: SurfaceModel, point: Point, metal: Color3f, dielectric: Color3f) -> Float:
    """Chance that a sampled microfacet reflects light instead of letting it through."""
    if model.transmission is None:
        return mi.Float(1)
    reflected = dr.lerp(dr.max(dielectric), dr.mean(metal), point.metallic)
    through = (1 - point.metallic) * point.transmission * (1 - dr.max(dielectric)) * dr.mean(point.base)
    return dr.select(reflected + through > 0, reflected / (reflected + through), 1)
