"""The photons of one picture, whose caustics are not left to paths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from lippmann.rendering.film import memory_model
from lippmann.rendering.preparation.pilot import Pilot
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.casters import find_casters, hides_caustics
from lippmann.rendering.transport.caustic_photons import CausticPhotons, emissions, no_photons
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.photon_map import PhotonMap
from lippmann.rendering.transport.ray_source import RaySource


@dataclass(frozen=True, eq=False)
class Caustics:
    """How a picture's caustics come.

    Attributes
    ----------
    way:
        ``photons``, ``paths`` or ``none``; None where there are none.
    photons, passes:
        See :class:`~lippmann.rendering.transport.prepared_light.PreparedLight`.
    """

    way: Literal["photons", "paths", "none"] | None
    photons: PhotonMap | None = None
    passes: CausticPhotons | None = None


def shoot_photons(
    integrator: PathIntegrator, request: RenderRequest, source: RaySource, pilot: Pilot, memory: int
) -> Caustics:
    """How the caustics come in the picture of ``source``, with their photons.

    By photons wherever an emitter and a caster form a pair, and a few photons land in what the picture shows.

    Raises
    ------
    MemoryLimitError
        ``memory`` bytes do not hold the photons that were asked for; where nothing was, they are left to paths.
    """
    if request.integrator != "path" or request.surfaces < 2:
        return Caustics(None)
    if request.caustics == "paths":
        return _left_to_paths(integrator)
    if request.caustics == "none":
        return Caustics("none", no_photons())
    casters = find_casters(integrator.scene)
    if casters.pairs == 0:
        return Caustics(None)
    pixels = source.width * source.height * source.channels
    # A single pass is for no more samples than there are.
    samples = pixels * (TUNING.pass_samples if request.is_open_ended else min(TUNING.pass_samples, request.samples))
    passes = 2 if request.is_open_ended else -(-request.samples // TUNING.pass_samples)
    # No fewer where memory is short: it does not change a picture.
    required = memory_model.photons(emissions(samples), passes)
    if required > memory:
        if request.caustics == "auto":
            return _left_to_paths(integrator)
        raise memory_model.too_small(memory, "photons of caustics", required)
    photons = CausticPhotons(
        integrator.scene,
        integrator.features,
        casters,
        samples=samples,
        pass_samples=TUNING.pass_samples,
        seed=request.seed,
        region=pilot.region,
        kept=max(1, min(passes, int(TUNING.kept_share * memory) // memory_model.photons(emissions(samples), 1))),
    )
    return Caustics(None) if photons.are_none else Caustics("photons", photons.of_pass(0), photons)


def _left_to_paths(integrator: PathIntegrator) -> Caustics:
    return Caustics("paths" if hides_caustics(integrator.scene) else None)
