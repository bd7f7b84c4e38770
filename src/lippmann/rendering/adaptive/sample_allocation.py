"""Adaptive sampling: pixels that are noisy after denoising get more samples than others.

Half of the samples go to all pixels alike: what looks good may only not have met light that
few paths find. What the others would cost goes to pixels in which the denoised halves of the picture so far differ
most, for what their rays cost: what a denoiser makes of noise, not the noise itself, is what is left in the picture.
As halves of one pixel differ by chance, both are averaged over the pixels around. Each chosen pixel gets four times as
many samples as all would have got, so that these are a quarter where all cost the same. Where they do not hold most of
the noise, as in the leaves of a tree that fills the picture, all pixels get the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.progress import ProgressCallback, of_part, silent
from lippmann.rendering.denoise.local_statistics import mean_around
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]

#: Samples of a chosen pixel for one of all; and the pixels to either side over which noise and cost are averaged.
SAMPLES_OF_CHOSEN, RADIUS = 4, 1
#: Samples per pixel that a picture has had before any are chosen.
FEWEST = 2
#: Share of the noise that chosen pixels hold, at least. If the error of a pixel fell as the inverse of its samples,
#: 0.63 would be even, but a part of what is seen of it is chance. Scenes with 0.74 and less lose (docs/research).
LEAST_NOISE = 0.75
#: A look at the denoised picture may cost so much of what the samples so far did.
MOST_OF_LOOK = 0.25


class Batches(Protocol):
    """Samples of a picture; see :class:`~lippmann.rendering.film.sample_batches.FullInBatches`."""

    @property
    def samples(self) -> int: ...

    @property
    def batches(self) -> int: ...

    def rays_of_sample(self) -> Floats: ...

    def add(self, samples: int, progress: ProgressCallback = silent) -> None: ...

    def add_at(self, chosen: NDArray[np.bool_], each: int, mean: int, progress: ProgressCallback = silent) -> None: ...


class Denoising(Protocol):
    """The denoised picture of the samples; see :class:`~lippmann.rendering.denoise.dual_buffer.Denoised`."""

    @property
    def is_current(self) -> bool: ...

    def noise(self) -> Floats: ...


class SampleAllocation:
    """Divides each round of samples among the pixels.

    Parameters
    ----------
    batches:
        The samples of the picture.
    denoised:
        What a denoiser makes of them, where that is at hand from time to time; else None.
    look:
        Gives what a denoiser makes of them in short time, for one look; and what that costs of the samples so far.
    threads:
        CPU threads.
    """

    def __init__(
        self,
        batches: Batches,
        denoised: Denoising | None,
        look: tuple[Callable[[], Denoising], Callable[[], float]],
        threads: int = 1,
    ) -> None:
        self._batches = batches
        self._denoised = denoised
        self._look, self._look_cost = look
        self._threads = threads

    def add(self, samples: int, progress: ProgressCallback = silent) -> None:
        """Take as many more samples as cost what ``samples`` of each pixel do."""
        batches, denoised = self._batches, self._denoised
        noise = None
        if denoised is not None and denoised.is_current and batches.samples >= FEWEST:
            noise = denoised.noise()
        for_all = self._for_all(samples)
        rest, share = samples - for_all, for_all / samples
        if for_all:
            batches.add(for_all, of_part(progress, 0.0, share, samples))
        if not rest:
            return
        if noise is None and self._look_cost() <= MOST_OF_LOOK:
            noise = self._look().noise()
        report = of_part(progress, share, 1.0 - share, samples)
        each = batches.batches * max(1, round(SAMPLES_OF_CHOSEN * rest / batches.batches))
        chosen = None if noise is None else self._chosen(noise, rest / each)
        if chosen is None:
            batches.add(rest, report)
        else:
            batches.add_at(chosen, each, rest, report)

    def _for_all(self, samples: int) -> int:
        """How many of a round go to all pixels: about half, so that batches get the same where there are enough."""
        had = self._batches.samples
        if had + samples < 2 * FEWEST:
            return samples
        half = had + samples // 2
        step = min(self._batches.batches, max(FEWEST, half))
        return max(0, half // step * step - had)

    def _chosen(self, noise: Floats, share: float) -> NDArray[np.bool_] | None:
        """The noisiest pixels for their cost that together cost this share of what all do; None if it is not theirs."""
        bands = Bands(self._threads)
        around, cost = (
            mean_around(np.ascontiguousarray(values, dtype=np.float32), RADIUS, bands).ravel()
            for values in (noise, self._batches.rays_of_sample())
        )
        order = np.argsort(-around / cost, kind="stable")
        spent = np.cumsum(cost[order], dtype=np.float64)
        chosen = np.zeros(around.size, dtype=np.bool_)
        chosen[order[: 1 + np.searchsorted(spent, share * spent[-1])]] = True
        own, total = float(around[chosen].sum(dtype=np.float64)), float(around.sum(dtype=np.float64))
        return chosen.reshape(noise.shape) if total > 0 and own >= LEAST_NOISE * total else None
