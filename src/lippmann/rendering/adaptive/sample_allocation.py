"""Adaptive sampling: pixels that are noisy after denoising get more samples than others.

Half of the samples go to all pixels alike: what looks good may only not have met light that
few paths find. What the others would cost goes to pixels in which the denoised halves of the picture so far differ
most, for what their rays cost: what a denoiser makes of noise, not the noise itself, is what is left in the picture.
As halves of one pixel differ by chance, both are averaged over the pixels around. Each chosen pixel gets four times as
many samples as all would have got, so that these are a quarter where all cost the same. Where they do not hold most of
the noise, as in the leaves of a tree that fills the picture, all pixels get the same.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.progress import ProgressCallback, of_part, silent
from lippmann.rendering.adaptive.tuning import TUNING
from lippmann.rendering.denoise.local_statistics import mean_around
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]

#: Samples per pixel that a picture has had before any are chosen.
FEWEST = 2


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
        The denoised picture, used where it is current; None where there is none.
    quick:
        A denoised picture that takes little time, used where the other is not current.
    quick_cost:
        What that takes, in rays per pixel.
    threads:
        CPU threads.
    """

    def __init__(
        self, batches: Batches, denoised: Denoising | None, quick: Denoising, quick_cost: float, threads: int = 1
    ) -> None:
        self._batches = batches
        self._denoised = denoised
        self._quick = quick
        self._quick_cost = quick_cost
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
        if noise is None and self._quick_cost <= TUNING.most_of_look * self._rays_per_pixel():
            noise = self._quick.noise()
        report = of_part(progress, share, 1.0 - share, samples)
        each = batches.batches * max(1, round(TUNING.chosen_samples * rest / batches.batches))
        chosen = None if noise is None else self._chosen(noise, rest / each)
        if chosen is None:
            batches.add(rest, report)
        else:
            batches.add_at(chosen, each, rest, report)

    def _rays_per_pixel(self) -> float:
        return self._batches.samples * float(self._batches.rays_of_sample().mean())

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
            mean_around(np.ascontiguousarray(values, dtype=np.float32), TUNING.noise_radius, bands).ravel()
            for values in (noise, self._batches.rays_of_sample())
        )
        order = np.argsort(-around / cost, kind="stable")
        spent = np.cumsum(cost[order], dtype=np.float64)
        chosen = np.zeros(around.size, dtype=np.bool_)
        chosen[order[: 1 + np.searchsorted(spent, share * spent[-1])]] = True
        own, total = float(around[chosen].sum(dtype=np.float64)), float(around.sum(dtype=np.float64))
        return chosen.reshape(noise.shape) if total > 0 and own >= TUNING.least_noise * total else None
