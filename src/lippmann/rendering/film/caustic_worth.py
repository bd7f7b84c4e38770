"""How noisy caustics would be if they were left to paths: whether photons are worth their time."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.transport.photon_map import Photons

#: Mean variance of a sample, in linear radiance, below which photons would not be missed: the rest of a path's light
#: has thirty times as much as a rule, and photons take a third of its time.
LEAST_WORTH = 3e-4
#: Points that are seen lie about a photon if they are nearer than this part of the diagonal of what is seen.
_REACH = 0.03


def are_worth_photons(variance: float, gain: float) -> bool:
    """Whether caustics of this :func:`variance_by_paths` would be seen to be noisy, once light is multiplied by
    ``gain``."""
    return variance * gain**2 > LEAST_WORTH


def variance_by_paths(
    photons: Photons, radiance: NDArray[np.floating], seen: NDArray[np.floating], looked: int
) -> float:
    """Mean variance of one path's caustic light over a picture, at most.

    Sharp events keep radiance: where light from an emitter of radiance L makes the irradiance E, it comes from a part
    E / (pi L) of the directions that a white matt surface samples, and brings L each time: its variance is at most
    L E / pi.

    Parameters
    ----------
    photons:
        Those of a pilot that are seen.
    radiance:
        ``(n,)``: that of each photon's emitter; infinite for emitters without size.
    seen:
        ``(m, 3)``: points that are seen, in equal parts of the picture.
    looked:
        Parts of the picture, those included that show no surface.
    """
    from scipy.spatial import cKDTree

    if not len(photons):
        return 0.0
    if np.isinf(radiance).any():
        return math.inf
    reach = _REACH * float(np.linalg.norm(np.ptp(seen, axis=0)))
    about = cKDTree(seen).query_ball_point(photons.position, reach, return_length=True)
    # What is seen in mirrors alone counts as if one point saw it.
    parts_of_area = np.maximum(about, 1) / (looked * math.pi * reach**2)
    flux = photons.power.max(axis=1).astype(np.float64)
    return float((flux * radiance * parts_of_area).sum() / math.pi)
