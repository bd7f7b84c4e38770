"""A surface model's values as a Mitsuba texture, for Mitsuba's own plugins to read."""

from __future__ import annotations

import functools
from typing import Literal

from lippmann.device.pbr import microfacet
from lippmann.device.pbr.gltf_bsdf_parameters import SurfaceModel
from lippmann.device.pbr.textures import Place
from lippmann.device.types import Bool, Color3f, Float, MitsubaTexture, Properties, SurfaceInteraction3f

#: ``base``: base colour; ``coverage``: opacity; ``metal``: reflectance of a smooth metal of that colour.
Quantity = Literal["base", "coverage", "metal"]


def signal_texture(model: SurfaceModel, quantity: Quantity) -> MitsubaTexture:
    """A ``mi.Texture`` of one quantity of ``model``, for the variant that is set."""
    import mitsuba as mi

    return _texture_class(mi.variant())(mi.Properties("lippmann_signal"), model, quantity)


@functools.cache
def _texture_class(variant: str) -> type[MitsubaTexture]:
    import drjit as dr
    import mitsuba as mi

    assert variant == mi.variant()

    class SignalTexture(mi.Texture):  # type: ignore[misc, unused-ignore]
        """See the module."""

        def __init__(self, props: Properties, model: SurfaceModel, quantity: Quantity) -> None:
            super().__init__(props)
            self.model = model
            self.quantity = quantity

        def eval_3(self, si: SurfaceInteraction3f, active: Bool = True) -> Color3f:
            if self.quantity == "coverage":
                return mi.Color3f(self.model.coverage(Place(si, active)))
            base = mi.Color3f(self.model.base(Place(si, active)))
            if self.quantity == "base":
                return base
            return dr.lerp(base, mi.Color3f(1), microfacet.schlick_weight(dr.abs(si.wi.z)))

        def eval(self, si: SurfaceInteraction3f, active: Bool = True) -> Color3f:
            return self.eval_3(si, active)

        def eval_1(self, si: SurfaceInteraction3f, active: Bool = True) -> Float:
            if self.quantity == "coverage":
                return self.model.coverage(Place(si, active))
            return mi.luminance(self.eval_3(si, active))

        def max(self) -> float:
            return 1.0

        def is_spatially_varying(self) -> bool:
            return True

        def to_string(self) -> str:
            return f"SignalTexture[{self.quantity}]"

    return SignalTexture
