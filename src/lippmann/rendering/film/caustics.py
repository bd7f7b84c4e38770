"""The photons of one picture, whose caustics are not left to paths."""

from __future__ import annotations

from lippmann.rendering.film.memory_model import PHOTON, too_small
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.casters import find_casters
from lippmann.rendering.transport.caustic_photons import emissions, no_photons, shoot_photons
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.ray_source import RaySource

#: Samples of a pixel for which photons are shot where a quality or a time decides: as many as it may come to have.
GOAL_SAMPLES = 32


def photons_of_picture(
    integrator: PathIntegrator, request: RenderRequest, source: RaySource, memory: int
) -> PhotonMap | None:
    """Photons for the picture of ``source``; None where its caustics are left to paths.

    Raises
    ------
    MemoryLimitError
        ``memory`` bytes do not hold them.
    """
    if request.caustics == "paths":
        return None
    if request.caustics == "none":
        return no_photons()
    casters = find_casters(integrator.scene)
    samples = GOAL_SAMPLES if request.is_open_ended else request.samples
    samples *= source.width * source.height * source.channels
    # No fewer where memory is short: it does not change a picture.
    required = 2 * emissions(samples) * PHOTON
    if required > memory:
        raise too_small(memory, "photons of caustics", required)
    return shoot_photons(integrator.scene, integrator.features, casters, samples=samples, seed=request.seed)
