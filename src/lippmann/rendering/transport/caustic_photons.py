"""Photons from emitters by way of mirrors, glass and smooth gloss to the rough surfaces where they make caustics.

Paths from the eye meet such light only where they happen upon the emitter: hardly ever a small one, and never a point
or a direction. Photons start at the *caster*, the surface that bends the light: a point on it, a direction to the
emitter, and back along it. So none misses, and every emitter works that can be sampled.

What is gathered is exactly what :class:`~lippmann.rendering.transport.path.PathIntegrator` leaves out: light that comes
by sharp events alone (:mod:`lippmann.rendering.transport.sharp_events`), one at least and :data:`MOST_EVENTS` at most,
from an emitter other than the environment to a rough surface of a camera path, and is scattered there by lobes that are
wide enough to be told from photons.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.device.types import MitsubaScene
from lippmann.rendering.transport.casters import Casters
from lippmann.rendering.transport.pass_schedule import PassSchedule
from lippmann.rendering.transport.photon_map import PhotonMap, Photons
from lippmann.rendering.transport.photon_shooter import PhotonShooter
from lippmann.rendering.transport.scene_features import SceneFeatures

#: Emissions of the pilot for each emitter and caster; and in all, one for so many samples of the picture at least.
PILOT_OF_PAIR, SAMPLES_OF_PILOT = 4096, 8
_FEWEST_OF_PAIR = 64
#: Share of the emissions that goes to all pairs alike, whatever the pilot met.
_UNIFORM_SHARE = 0.1
#: Emissions of each half: one for so many samples of the picture, within limits. An emission may take as long as two
#: paths (`benchmarks/photon_share.py`): with three halves as many, caustics have 1 dB less noise.
SAMPLES_OF_EMISSION, FEWEST, MOST = 12, 1 << 16, 1 << 21
#: Samples of the picture to an emission of each half at least: photons are to take no more time than its paths.
FEWEST_SAMPLES_OF_EMISSION = 6
#: Photons within the radius of a look-up, as a rule, where there are so many emissions.
NEIGHBOURS, EMISSIONS_OF_NEIGHBOURS = 50, 1 << 18
#: Photons by which the radius is found.
_PROBED = 2000
_SEED_STEPS = (0xB5297A4D, 0x68E31DA4)
_PILOT_STEP, _PASS_STEP = 0x1B56C4E9, 0x632BE5AB
_NONE = Photons.dark(0)


def no_photons() -> PhotonMap:
    """A map in place of paths to which nothing comes."""
    return PhotonMap((_NONE, _NONE), 1.0)


def emissions(samples: int) -> int:
    """Emissions of each half for a picture of so many samples in all."""
    fewest = max(1, min(FEWEST, samples // FEWEST_SAMPLES_OF_EMISSION))
    return int(np.clip(samples // SAMPLES_OF_EMISSION, fewest, MOST))


class CausticPhotons:
    """Photons of a picture's caustics in passes, each for the next samples of every pixel.

    Passes know nothing of each other, and their radii shrink (Knaus and Zwicker 2011, with alpha = 2/3), so that the
    mean over them comes to have neither noise nor blur. Passes of more photons have smaller radii, too.

    Parameters
    ----------
    scene, features, casters:
        What they are shot in.
    samples:
        Of all pixels together for which the photons of the first pass are.
    schedule:
        Samples of one pixel that each pass serves; None where one pass is for all.
    seed:
        0 to 2**32 - 1: the same gives the same photons.
    region:
        Corners ``(2, 3)`` of the box that is seen: emitters and casters are given photons by what they bring there.
    kept:
        Passes whose photons are kept for others that ask, at least 1.
    """

    def __init__(
        self,
        scene: MitsubaScene,
        features: SceneFeatures,
        casters: Casters,
        *,
        samples: int,
        seed: int,
        schedule: PassSchedule | None = None,
        region: NDArray[np.float64] | None = None,
        kept: int = 1,
    ) -> None:
        self._shooter = PhotonShooter(scene, features, casters)
        self.schedule = schedule or PassSchedule(1 << 32, 1 << 32)
        self._samples = samples
        self._seed = seed
        self._region = region
        self._kept = kept
        self._maps: dict[int, PhotonMap] = {}
        self._radius = 0.0
        self._chances = self._pilot(casters)

    @property
    def are_none(self) -> bool:
        """Whether a few emissions of each emitter and caster brought nothing that is seen, or missed."""
        return self._chances is None

    def relative_radius(self, number: int) -> float:
        """Radius of a look-up in pass ``number`` over that in the first."""
        # The area of a look-up is as the number of photons in it, the root of all, over their density.
        return radius_of_pass(number) * math.sqrt(math.sqrt(self._emissions(0) / self._emissions(number)))

    def _emissions(self, number: int) -> int:
        """Of each half in a pass."""
        return emissions(self._samples * self.schedule.samples(number) // self.schedule.first)

    def of_pass(self, number: int) -> PhotonMap:
        """The photons of pass ``number``, from 0 on; a map without any where there are none."""
        if self._chances is None:
            return no_photons()
        if not self._radius and number > 0:
            self.of_pass(0)  # which tells the radius
        if number not in self._maps:
            while len(self._maps) >= self._kept:
                del self._maps[next(iter(self._maps))]
            seeds = [(self._seed + step + number * _PASS_STEP) % 2**32 for step in _SEED_STEPS]
            count = self._emissions(number)
            first, second = (self._shooter.shoot(count, self._chances, seed)[0] for seed in seeds)
            if number == 0 and not self._radius:
                neighbours = NEIGHBOURS * math.sqrt(count / EMISSIONS_OF_NEIGHBOURS)
                self._radius = _radius(first.inside(self._region), neighbours)
            self._maps[number] = PhotonMap((first, second), self._radius * self.relative_radius(number))
        return self._maps[number]

    def _pilot(self, casters: Casters) -> NDArray[np.float64] | None:
        """Shares of the emissions of each emitter and caster: as the roots of the second moments of what they bring."""
        if casters.pairs == 0:
            return None
        affordable = self._samples // SAMPLES_OF_PILOT // casters.pairs
        count = int(np.clip(affordable, _FEWEST_OF_PAIR, PILOT_OF_PAIR)) * casters.pairs
        even = np.full(casters.pairs, 1 / casters.pairs)
        photons, pair = self._shooter.shoot(count, even, (self._seed + _PILOT_STEP) % 2**32)
        seen = photons.are_inside(self._region)
        if not seen.any():
            return None
        power = photons.power[seen].astype(np.float64)
        roots = np.sqrt(np.bincount(pair[seen], np.square(power).sum(axis=1), minlength=casters.pairs))
        return np.asarray(_UNIFORM_SHARE * even + (1 - _UNIFORM_SHARE) * roots / roots.sum())


def radius_of_pass(number: int) -> float:
    """Radius in a pass over that in the first, of as many photons: Knaus and Zwicker 2011, eq. 20."""
    squares = [(k + 2 / 3) / (k + 1) for k in range(1, number + 1)]
    return math.sqrt(math.prod(squares))


def _radius(photons: Photons, neighbours: float) -> float:
    """The distance to the neighbour of that number, of the middle one of some photons."""
    from scipy.spatial import cKDTree

    number = int(min(max(2, round(neighbours)), max(2, len(photons) // 2)))
    if len(photons) < 3:
        return float(np.ptp(photons.position, axis=0).max()) or 1.0
    probed = photons.position[:: max(1, len(photons) // _PROBED)]
    distances, _ = cKDTree(photons.position).query(probed, k=[number])
    return float(np.median(distances)) or float(distances.max()) or 1.0
