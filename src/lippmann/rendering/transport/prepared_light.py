"""What an integrator knows of a picture's light before its first path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from lippmann.device.types import Float, UInt32

if TYPE_CHECKING:
    from lippmann.rendering.transport.caustic_photons import CausticPhotons
    from lippmann.rendering.transport.light_sampling import LightSampler
    from lippmann.rendering.transport.light_vertices import LightVertexPasses, LightVertices
    from lippmann.rendering.transport.photon_map import PhotonMap


@dataclass(frozen=True, eq=False)
class PreparedLight:
    """The light of one picture, made by :func:`lippmann.rendering.preparation.prepare.prepare_light`.

    Attributes
    ----------
    sampler:
        Samples the scene's emitters; None for the scene's own weights.
    gain:
        Factor on the radiance, the background's apart; None for 1.
    most_indirect:
        What one indirect contribution may bring at most, before ``gain``; None for no limit.
    photons:
        Photons of caustics in place of paths that would have to find them; None for paths.
    photon_passes:
        Gives ``photons`` for each part of a picture's samples; None where they are the same for all.
    light_vertices, vertex_passes:
        The same of points lit by emitters, to which paths are joined; None where paths find all light themselves.
    chains:
        Chains of sharp events of each path, see :mod:`.seen_light`; None for none.
    choices:
        What the picture's file says of it.
    """

    sampler: LightSampler | None = None
    gain: Float | None = None
    most_indirect: Float | None = None
    photons: PhotonMap | None = None
    photon_passes: CausticPhotons | None = None
    light_vertices: LightVertices | None = None
    vertex_passes: LightVertexPasses | None = None
    chains: UInt32 | None = None
    choices: Mapping[str, object] = field(default_factory=dict)

    def at(self, sample: int) -> tuple[PreparedLight, int | None]:
        """The light of sample number ``sample`` of each pixel, and how many samples from there on it serves.

        None for all.
        """
        light, served = self, list[int]()
        if self.photon_passes is not None:
            number, before = divmod(sample, self.photon_passes.pass_samples)
            light = replace(light, photons=self.photon_passes.of_pass(number))
            served.append(self.photon_passes.pass_samples - before)
        if self.vertex_passes is not None:
            number, before = divmod(sample, self.vertex_passes.pass_samples)
            light = replace(light, light_vertices=self.vertex_passes.of_pass(number))
            served.append(self.vertex_passes.pass_samples - before)
        return light, min(served, default=None)
