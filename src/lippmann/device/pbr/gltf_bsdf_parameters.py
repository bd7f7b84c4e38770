"""Parameters of one kind of surface: glTF's material on the device, and its values at a point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lippmann.device.pbr.textures import Lookup, Place, Signal
from lippmann.device.types import Color3f, DeviceTexture, Float, Frame3f, Point2f, Vector3f


@dataclass(eq=False)
class NormalMap:
    """A tangent-space normal map: ``lookup`` of its texels, ``scale`` of its normals' x and y.

    ``tangents`` says that meshes bring tangents of their own.
    """

    lookup: Lookup
    scale: Signal
    tangents: bool = False


@dataclass(eq=False)
class Anisotropy:
    """KHR_materials_anisotropy: ``strength`` in [0, 1], and the cosine and sine of its ``rotation``.

    ``lookup`` of texels whose red and green are a direction in the tangent plane and whose blue scales the strength.
    ``tangents`` says that meshes bring tangents of their own.
    """

    strength: Signal
    cosine: Signal
    sine: Signal
    lookup: Lookup | None = None
    tangents: bool = False


@dataclass(eq=False)
class ThinFilm:
    """KHR_materials_iridescence: ``share`` of the surface under a film, its ``ior``, its thickness in nanometres.

    The thickness is ``thinnest`` plus ``range`` times ``texture`` (1 without one).
    """

    share: Signal
    ior: Signal
    thinnest: Signal
    range: Signal
    texture: Signal

    def thickness(self, place: Place) -> Float:
        """In nanometres at a point."""
        return self.thinnest.eval(place) + self.range.eval(place) * self.texture.eval(place)


@dataclass(eq=False)
class SurfaceModel:
    """A surface that may be metal, plastic, cloth, glass or a mixture. None switches a feature off, at no cost.

    Attributes
    ----------
    base_color, roughness:
        As in glTF.
    ior:
        Refractive index relative to the outside.
    metallic:
        None where ``metal`` decides for all of the surface.
    dull:
        The dielectric reflects nothing at its interface.
    specular, specular_color:
        KHR_materials_specular.
    transmission:
        Share of light that enters instead of being scattered diffusely; ``solid`` says that it enters a body, not a
        sheet.
    gloss_albedo, sheen_albedo:
        Textures over (cosine, roughness) of the light that a microfacet lobe and white sheen send back; see
        :mod:`~lippmann.device.pbr.microfacet`. The former is needed wherever light is scattered below an interface.
    interface_albedo:
        Texture of the light that a rough refracting interface loses; needed for solids that compensate.
    compensates:
        Whether light that is reflected more than once between microfacets is given back (Turquin 2019).
    anisotropy, film:
        KHR_materials_anisotropy and KHR_materials_iridescence.
    opacity, opacity_cutoff:
        Share of the surface that is there; with a cutoff all or nothing.
    front_only:
        Whether only front faces are there; the opacity is then 1.
    tinted, faded:
        The mesh's vertex colours multiply the base colour, their alpha the opacity.
    """

    base_color: Signal
    roughness: Signal
    ior: Signal
    gloss_albedo: DeviceTexture | None = None
    interface_albedo: DeviceTexture | None = None
    compensates: bool = True
    metallic: Signal | None = None
    metal: bool = False
    dull: bool = False
    specular: Signal | None = None
    specular_color: Signal | None = None
    transmission: Signal | None = None
    solid: bool = False
    normal: NormalMap | None = None
    clearcoat: Signal | None = None
    clearcoat_roughness: Signal | None = None
    clearcoat_normal: NormalMap | None = None
    sheen_color: Signal | None = None
    sheen_roughness: Signal | None = None
    sheen_albedo: DeviceTexture | None = None
    anisotropy: Anisotropy | None = None
    film: ThinFilm | None = None
    opacity: Signal | None = None
    opacity_cutoff: Signal | None = None
    front_only: bool = False
    tinted: bool = False
    faded: bool = False

    @property
    def is_glossy(self) -> bool:
        """Whether the body below the coat has a microfacet lobe."""
        return self.metal or not self.dull

    def base(self, place: Place) -> Color3f:
        """Base colour at a point."""
        color = self.base_color.eval(place)
        return color * place.color if self.tinted else color

    def coverage(self, place: Place) -> Float:
        """Opacity at a point, in [0, 1]; only where the model has one."""
        import drjit as dr
        import mitsuba as mi

        assert self.opacity is not None
        alpha = self.opacity.eval(place)
        if self.faded:
            alpha = alpha * place.alpha
        if self.front_only:
            alpha = dr.select(place.si.wi.z > 0, alpha, 0)
        if self.opacity_cutoff is not None:
            return dr.select(alpha >= self.opacity_cutoff.eval(place), mi.Float(1), 0)
        return dr.clip(alpha, 0, 1)

    def metalness(self, place: Place) -> Float:
        """Share of metal at a point."""
        import drjit as dr
        import mitsuba as mi

        if self.metallic is None:
            return mi.Float(1 if self.metal else 0)
        return dr.clip(self.metallic.eval(place), 0, 1)

    def clarity(self, place: Place) -> Float:
        """Share of light that enters rather than being scattered diffusely, at a point."""
        import drjit as dr
        import mitsuba as mi

        return mi.Float(0) if self.transmission is None else dr.clip(self.transmission.eval(place), 0, 1)


@dataclass(eq=False)
class Lobe:
    """A microfacet lobe seen from one direction: ``wi`` in the frame of its own normal (None: the surface's).

    ``tilted`` says that the normal may differ from the surface's; ``alpha`` is the width along the frame's x and y,
    of which that along x is the larger.
    """

    frame: Frame3f | None
    wi: Vector3f
    alpha: Point2f
    tilted: bool = False


@dataclass(eq=False)
class Coat:
    """The clear coat: ``weight`` of its reflection over what lies below, ``chance`` of being sampled.

    ``gain`` compensates for its multiple scattering.
    """

    lobe: Lobe
    weight: Float
    chance: Float
    gain: Float


@dataclass(eq=False)
class Sheen:
    """Cloth fibres above the body: ``albedo`` maps a cosine to the light that white ones send back."""

    color: Color3f
    alpha: Float
    albedo: Callable[[Float], Float]


@dataclass(eq=False)
class Point:
    """All that scattering at one surface point needs, whatever the outgoing direction.

    ``below`` is the share of light that the interface does not reflect. ``metal_gain`` and ``gain`` compensate for the
    light that microfacets of metal and of the dielectric interface reflect more than once. ``film`` is the share of the
    surface under a thin film, with its index and thickness.
    """

    flip: Float
    lobe: Lobe
    base: Color3f
    metallic: Float
    transmission: Float
    eta: Float
    f0: Color3f
    specular: Float
    below: Float = None
    diffuse_chance: Float = None
    metal_gain: Color3f = 1
    gain: Float = 1
    film: tuple[Float, Float, Float] | None = None
    sheen: Sheen | None = None
    coat: Coat | None = None
