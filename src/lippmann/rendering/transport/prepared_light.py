"""The prepared light of a picture: what an integrator is given before its first path."""

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
        Clamp on one indirect contribution, before ``gain``; None for no limit.
    photons:
        Photon map of caustics; None where paths have to find them.
    photon_passes:
        Makes ``photons`` for each run of a picture's samples; None where all samples share one map.
    light_vertices, vertex_passes:
        The same of light vertices, to which paths are joined; None without joins.
    chains:
        Specular chains per path, see :mod:`.specular_chains`; None for none.
    choices:
        Decisions and measured values for the picture's metadata.
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
        """The light for sample number ``sample`` of each pixel, and how many samples from there on use it.

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
