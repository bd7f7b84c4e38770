"""What one kind of surface evaluates at a point: glTF's material with its textures on the device."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from lippmann.scene.textures import Lookup, Signal

#: Mesh attributes with which a mesh colours its material.
COLOR_ATTRIBUTE, ALPHA_ATTRIBUTE = "vertex_color", "vertex_alpha"


@dataclass(eq=False)
class NormalMap:
    """A tangent-space normal map: ``scale`` multiplies the x and y of its normals."""

    lookup: Lookup
    scale: Any


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
    sheen_albedo:
        Texture of light that white sheen sends back, over (cosine, roughness).
    opacity, opacity_cutoff:
        Share of the surface that is there; with a cutoff all or nothing.
    tinted, faded:
        The mesh's vertex colours multiply the base colour, their alpha the opacity.
    """

    base_color: Signal
    roughness: Signal
    ior: Signal
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
    sheen_albedo: Any = None
    opacity: Signal | None = None
    opacity_cutoff: Signal | None = None
    tinted: bool = False
    faded: bool = False

    def base(self, si: Any, active: Any) -> Any:
        """Base colour at a point."""
        color = self.base_color.eval(si, active)
        return color * si.shape.eval_attribute_3(COLOR_ATTRIBUTE, si, active) if self.tinted else color

    def coverage(self, si: Any, active: Any) -> Any:
        """Opacity at a point, in [0, 1]; only where the model has one."""
        import drjit as dr
        import mitsuba as mi

        assert self.opacity is not None
        alpha = self.opacity.eval(si, active)
        if self.faded:
            alpha = alpha * si.shape.eval_attribute_1(ALPHA_ATTRIBUTE, si, active)
        if self.opacity_cutoff is not None:
            return dr.select(alpha >= self.opacity_cutoff.eval(si, active), mi.Float(1), 0)
        return dr.clip(alpha, 0, 1)

    def metalness(self, si: Any, active: Any) -> Any:
        """Share of metal at a point."""
        import drjit as dr
        import mitsuba as mi

        if self.metallic is None:
            return mi.Float(1 if self.metal else 0)
        return dr.clip(self.metallic.eval(si, active), 0, 1)

    def clarity(self, si: Any, active: Any) -> Any:
        """Share of light that enters rather than being scattered diffusely, at a point."""
        import drjit as dr
        import mitsuba as mi

        return mi.Float(0) if self.transmission is None else dr.clip(self.transmission.eval(si, active), 0, 1)
