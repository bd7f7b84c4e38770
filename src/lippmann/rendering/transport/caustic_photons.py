"""Photons from emitters by way of mirrors, glass and smooth gloss to the rough surfaces where they make caustics.

Paths from the eye find this light only if they hit the emitter by chance: hardly ever a small one, and never a delta
emitter. Photons start at the *caster*, the surface that bends the light: a point on it, a direction to the
emitter, and back along it. So no photon misses the caster, and any emitter that can be sampled works.

What is gathered is exactly what :class:`~lippmann.rendering.transport.path.PathIntegrator` leaves out: light that comes
by sharp events alone (:mod:`lippmann.rendering.transport.sharp_events`), one at least and :data:`MOST_EVENTS` at most,
from an emitter other than the environment to a rough surface of a camera path, and is scattered there by lobes that are
wide enough to be told from photons.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.device.pbr.scene import SceneFeatures
from lippmann.device.sobol import named_seed
from lippmann.device.types import MitsubaScene
from lippmann.rendering.transport.casters import Casters
from lippmann.rendering.transport.photon_map import PhotonMap, Photons, are_inside
from lippmann.rendering.transport.photon_shooter import PhotonShooter
from lippmann.rendering.transport.tuning import TUNING

#: Photons emitted for each half-buffer, divided by the samples to the power of 2/3. An emission may take as long as two
#: paths (``benchmarks/photon_share.py``).
OF_POWER = 6
#: Usual number of photons within the radius of a look-up, divided by the square root of the photons emitted.
NEIGHBOURS_OF_ROOT = 0.12


def make_empty_map() -> PhotonMap:
    """An empty photon map: caustics are left out."""
    return PhotonMap((Photons.dark(0), Photons.dark(0)), 1.0)


def emissions(samples: int) -> int:
    """Photon emissions per half-buffer for ``samples`` samples in all; noise and blur then fall at the same rate."""
    return round(OF_POWER * math.pow(samples, 2 / 3))


class CausticPhotons:
    """Photons of a picture's caustics in passes, each for the next samples of every pixel.

    Passes are independent, and their radii shrink (Knaus and Zwicker 2011, alpha = 2/3), so that both noise and blur of
    the mean over them vanish.

    Parameters
    ----------
    scene, features, casters:
        The scene, its features and its casters.
    samples:
        Samples of all pixels together that a pass of photons serves.
    pass_samples:
        Samples of one pixel that each pass serves.
    seed:
        0 to 2**32 - 1: the same gives the same photons.
    region:
        Corners ``(2, 3)`` of the visible box: pairs get photons in proportion to their flux there.
    kept:
        Passes whose photon maps are cached, at least 1.
    """

    def __init__(
        self,
        scene: MitsubaScene,
        features: SceneFeatures,
        casters: Casters,
        *,
        samples: int,
        seed: int,
        pass_samples: int = 1 << 32,
        region: NDArray[np.float64] | None = None,
        kept: int = 1,
    ) -> None:
        self._shooter = PhotonShooter(scene, features, casters)
        self.pass_samples = pass_samples
        self._emissions = emissions(samples)
        self._seed = seed
        self._region = region
        self._kept = kept
        self._maps: dict[int, PhotonMap] = {}
        self._radius = 0.0
        self._chances = self._pilot(casters)

    @property
    def are_none(self) -> bool:
        """Whether the pilot's photons all missed the visible box."""
        return self._chances is None

    def of_pass(self, number: int) -> PhotonMap:
        """The photons of pass ``number``, from 0 on; a map without any where there are none."""
        if self._chances is None:
            return make_empty_map()
        if not self._radius and number > 0:
            self.of_pass(0)  # the first pass sets the radius
        if number not in self._maps:
            while len(self._maps) >= self._kept:
                del self._maps[next(iter(self._maps))]
            first, second = (
                self._shooter.shoot(self._emissions, self._chances, named_seed("photons", self._seed, number, half))[0]
                for half in range(2)
            )
            if not self._radius:
                neighbours = NEIGHBOURS_OF_ROOT * math.sqrt(self._emissions)
                self._radius = _radius(first.inside(self._region), neighbours)
            self._maps[number] = PhotonMap((first, second), self._radius * shrink_radius(number))
        return self._maps[number]

    def _pilot(self, casters: Casters) -> NDArray[np.float64] | None:
        """Share of the emissions of each pair, by the root second moment of its photons' flux; None for no photons."""
        if casters.pairs == 0:
            return None
        count = min(TUNING.rays_of_each(casters.pairs) * casters.pairs, self._emissions)
        even = np.full(casters.pairs, 1 / casters.pairs)
        photons, pair = self._shooter.shoot(count, even, named_seed("pilot of photons", self._seed))
        is_visible = are_inside(photons.position, self._region)
        if not is_visible.any():
            return None
        power = photons.power[is_visible].astype(np.float64)
        roots = np.sqrt(np.bincount(pair[is_visible], np.square(power).sum(axis=1), minlength=casters.pairs))
        return np.asarray(TUNING.uniform_share * even + (1 - TUNING.uniform_share) * roots / roots.sum())


def shrink_radius(number: int) -> float:
    """Radius in a pass over that in the first, of as many photons: Knaus and Zwicker 2011, eq. 20."""
    squares = [(k + 2 / 3) / (k + 1) for k in range(1, number + 1)]
    return math.sqrt(math.prod(squares))


def _radius(photons: Photons, neighbours: float) -> float:
    """Median distance of photons to their neighbour number ``neighbours``; 1 where there are no two."""
    number = int(min(max(2, round(neighbours)), max(2, len(photons) // 2)))
    if len(photons) < 2:
        return 1.0
    # Axis by axis: the rounding of a matrix product depends on the number of threads.
    axes = np.ascontiguousarray(photons.position.T)
    distances = []
    for point in photons.position[:: max(1, len(photons) // TUNING.probe_side)]:  # a subset suffices for a median
        squares = sum(np.square(axis - place) for axis, place in zip(axes, point, strict=True))
        distances.append(math.sqrt(np.partition(squares, number - 1)[number - 1]))
    return float(np.median(distances)) or max(distances) or 1.0
