"""Probabilities of light sampling, by the contribution of each emitter to one picture.

Mitsuba samples all emitters uniformly unless a scene sets weights. Emitters that light nothing in the picture then take
their share too: a sky outside a closed room takes half of all shadow rays. Here the paths of a pilot estimate each
emitter's contribution f. The emitter is sampled in proportion to the root of the second moment E[f^2], which minimises
the variance of f over its probability (importance sampling; Veach 1997, chapter 2.5.2). A uniform share remains for
contributions that those paths missed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.device.types import MitsubaScene
from lippmann.rendering.preparation.pilot import Pilot
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.transport.light_sampling import LightSampler, SceneLightSampler, WeightedLightSampler


def make_light_sampler(scene: MitsubaScene, pilot: Pilot) -> LightSampler:
    """Make the light sampler of one picture.

    Where uniform sampling is as good as anything known (a single emitter, very many, no contribution found), the
    scene's own weights are used.
    """
    weights = emitter_weights(pilot)
    return WeightedLightSampler(scene, weights) if len(np.unique(weights)) > 1 else SceneLightSampler(scene)


def emitter_weights(pilot: Pilot) -> NDArray[np.float64]:
    """Sampling probabilities of the emitters, ``(emitters,)``, adding up to 1, in the order of ``pilot.moments``."""
    roots = np.sqrt(pilot.moments)
    uniform = np.full(len(roots), 1 / max(len(roots), 1))
    if not roots.any():
        return uniform
    share = TUNING.uniform_share
    return np.asarray(share * uniform + (1 - share) * roots / roots.sum())
