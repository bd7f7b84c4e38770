"""The photons of one picture, whose caustics are not left to paths."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.film.caustic_worth import are_worth_photons, variance_by_paths
from lippmann.rendering.film.exposure import gain_of
from lippmann.rendering.film.memory_model import PHOTON, too_small
from lippmann.rendering.film.seen_region import SEEN_SIDE, region_about, seen_points
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.casters import find_casters, hides_caustics
from lippmann.rendering.transport.caustic_photons import (
    FEWEST,
    MOST,
    SAMPLES_OF_EMISSION,
    CausticPhotons,
    emissions,
    no_photons,
)
from lippmann.rendering.transport.integrator import Integrator
from lippmann.rendering.transport.pass_schedule import PassSchedule
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.photon_map import Photons
from lippmann.rendering.transport.ray_source import RaySource

#: Samples of a pixel that one pass of photons serves, at least; and the first one of a picture that may need no more.
PASS_SAMPLES, FIRST_PASS_SAMPLES = 32, 4
#: Share of the memory for photons of passes that tiles and bands ask for in turn.
KEPT_SHARE = 0.25


def stretches(integrator: Integrator, first: int, samples: int) -> Iterator[int]:
    """Numbers of samples that make ``samples``, from ``first`` on; the integrator is ready for each in turn."""
    if not isinstance(integrator, PathIntegrator):
        yield samples
        return
    while samples > 0:
        count = samples
        for name, passes in (
            ("photons", integrator.photon_passes),
            ("light_vertices", integrator.vertex_passes),
            ("seen_chains", integrator.chain_passes),
        ):
            if passes is not None:
                number, left = passes.schedule.at(first)
                setattr(integrator, name, passes.of_pass(number))
                count = min(count, left)
        yield count
        first, samples = first + count, samples - count


@dataclass(frozen=True)
class Caustics:
    """How a picture's caustics come.

    Attributes
    ----------
    way:
        ``photons``, ``paths`` or ``none``.
    variance:
        Mean variance of one path's caustic light, in linear radiance without an exposure; infinite where it was not
        asked for.
    """

    way: Literal["photons", "paths", "none"]
    variance: float = math.inf


def give_photons(integrator: PathIntegrator, request: RenderRequest, source: RaySource, memory: int) -> Caustics | None:
    """Give the integrator the photons for the picture of ``source``; how caustics come, or None if there are none.

    Raises
    ------
    MemoryLimitError
        ``memory`` bytes do not hold the photons that were asked for; where nothing was, they are left to paths.
    """
    if request.integrator != "path" or request.surfaces < 2:
        return None
    if request.caustics == "paths":
        return _left_to_paths(integrator)
    if request.caustics == "none":
        integrator.photons = no_photons()
        return Caustics("none")
    casters = find_casters(integrator.scene)
    if casters.pairs == 0:
        return None
    pixels = source.width * source.height * source.channels
    schedule = _schedule(pixels, request.is_open_ended)
    passes = 1 if request.is_open_ended else -(-request.samples // schedule.most)
    # Where the samples are known, a single pass is for no more than these.
    most = schedule.most if request.is_open_ended else min(schedule.most, request.samples)
    # No fewer where memory is short: it does not change a picture.
    required = 2 * emissions(pixels * most) * PHOTON
    if required > memory:
        if request.caustics == "auto":
            return _left_to_paths(integrator)
        raise too_small(memory, "photons of caustics", required)
    seen = seen_points(integrator, source)
    noise = _Noise(seen, request)
    photons = CausticPhotons(
        integrator.scene,
        integrator.features,
        casters,
        samples=pixels * min(schedule.first, most),
        schedule=schedule,
        seed=request.seed,
        region=region_about(seen),
        kept=max(1, min(passes, int(KEPT_SHARE * memory) // required)),
        is_missed=noise.is_seen,
    )
    if photons.are_none:
        return None
    integrator.photons = photons.of_pass(0)
    integrator.photon_passes = photons
    return Caustics("photons", noise.variance)


def _schedule(pixels: int, is_open_ended: bool) -> PassSchedule:
    """Passes of photons for a picture of so many pixels, channels apart."""
    fewest = (FEWEST if is_open_ended else MOST) * SAMPLES_OF_EMISSION // pixels
    most = max(PASS_SAMPLES, fewest)
    return PassSchedule(max(FIRST_PASS_SAMPLES, fewest) if is_open_ended else most, most)


def take_photons(integrator: PathIntegrator) -> None:
    """Leave all caustics to paths."""
    integrator.photons = integrator.photon_passes = None


def _left_to_paths(integrator: PathIntegrator) -> Caustics | None:
    return Caustics("paths") if hides_caustics(integrator.scene) else None


class _Noise:
    """Tells by a pilot whether the noise of caustics would be seen by paths."""

    def __init__(self, seen: NDArray[np.float64], request: RenderRequest) -> None:
        self._seen = seen
        self._exposure = request.exposure
        self._is_asked = request.caustics == "auto" and len(seen) > 0
        #: See :class:`Caustics`.
        self.variance = math.inf

    def is_seen(self, photons: Photons, radiance: NDArray[np.float64]) -> bool:
        """Whether it would; where there is no exposure yet, no light is known to be bright."""
        if not self._is_asked:
            return True
        self.variance = variance_by_paths(photons, radiance, self._seen, SEEN_SIDE**2)
        return self._exposure == "auto" or are_worth_photons(self.variance, gain_of(self._exposure))
