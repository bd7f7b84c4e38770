"""Progressive rendering of a view at rest, with denoising in between.

Two streams of samples make two half-buffers, as in :mod:`lippmann.rendering.denoise.dual_buffer`. Each is denoised and
checked against the other; where the denoised value has the larger estimated error, the noisy one replaces it
(:mod:`lippmann.rendering.denoise.noisy_blend`). So the picture converges.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lippmann.device.sobol import named_seed
from lippmann.options.quality import MOST_SAMPLES
from lippmann.rendering.denoise.noisy_blend import weigh_samples
from lippmann.rendering.denoise.oidn import denoise
from lippmann.rendering.denoise.tuning import TUNING as DENOISE
from lippmann.rendering.film.batched_picture import STREAMS
from lippmann.rendering.live.develop import develop, develop_picture
from lippmann.rendering.live.live_tracer import Lanes
from lippmann.rendering.live.live_view import LiveFrame, PlacedView
from lippmann.rendering.request.tuning import TUNING as REQUEST
from lippmann.runtime import machine
from lippmann.runtime.engine_lock import exclusive

Floats = NDArray[np.float32]

#: Target duration of a sampling step in seconds: the delay that it may cause to a frame.
_STEP_SECONDS = 0.06


class Progressive:
    """The growing picture of one view."""

    def __init__(self, view: PlacedView, exposure: float) -> None:
        self._view, self._exposure = view, exposure
        self._kernels, self._pixels = view.kernels, view.pixels
        self._count = len(view.pixels.column)
        self._sums = np.zeros((STREAMS, self._count, 3), np.float32)
        #: Samples per pixel that each stream has; number of pixels done in the current round, and samples that it adds.
        self._taken, self._begun, self._coming = 0, 0, 0
        self._features: tuple[Floats, Floats] | None = None
        self._denoised_at = 0
        self._task: Iterator[Floats | None] | None = None
        #: Lanes of the next step in each stream.
        self._next = min(self._count, self._most)
        self._denoises = view.view.eye is not None and view.request.box_filter and machine.has_denoiser()

    @property
    def samples(self) -> int:
        """Samples of a pixel."""
        return STREAMS * self._taken

    @property
    def _most(self) -> int:
        return self._kernels.most_lanes // STREAMS

    @exclusive()
    def step(self, seconds: dict[str, float]) -> LiveFrame | None:
        """One step of work; the picture if it changed."""
        self._view.light_up(self._exposure)
        if self._task is not None:
            return self._denoise(seconds)
        if self.samples >= MOST_SAMPLES:
            return None
        self._sample(seconds)
        if self._begun:
            return None
        if not self._denoises:
            mean = np.asarray(self._sums.sum(axis=0) / self.samples, np.float32)
            return self._frame(develop(mean, self._pixels, self._view.request), seconds, is_denoised=False)
        # Denoised again at every 1.7-fold number of samples.
        return self._denoise(seconds) if self.samples >= 1.7 * self._denoised_at else None

    def _sample(self, seconds: dict[str, float]) -> None:
        """Take samples of all pixels, or of as many as the time allows; a round ends when all pixels have them."""
        started = time.perf_counter()
        if not self._begun:
            self._coming = max(1, self._next // self._count)
        last = min(self._begun + max(1, self._next // self._coming), self._count)
        lanes = Lanes(self._pixels, slice(self._begun, last), STREAMS, self._coming, self._taken)
        tracer = self._kernels.tracer(self._view.display, self._view.request)
        self._sums[:, lanes.part] += tracer.trace(lanes, self._view.placed, seed=self._view.request.seed).sums
        count = (last - self._begun) * self._coming
        self._begun = last % self._count
        if not self._begun:
            self._taken += self._coming
        spent = time.perf_counter() - started
        seconds["trace"] = seconds.get("trace", 0.0) + spent
        # As many as the step's time allows, at most twice the last number: the first launch may have compiled.
        least = min(self._count, self._most, 1 << 16)  # smaller wavefronts leave threads idle
        self._next = max(least, min(int(count * _STEP_SECONDS / spent), 2 * count, self._most))

    def _trace_features(self, seconds: dict[str, float]) -> None:
        started = time.perf_counter()
        tracer = self._kernels.feature_tracer(self._view.display, self._view.request)
        albedo, normal = np.empty((2, self._count, 3), np.float32)
        step, seed = self._kernels.most_lanes // DENOISE.guide_samples, named_seed("guides", self._view.request.seed)
        for start in range(0, self._count, step):
            lanes = Lanes(self._pixels, slice(start, start + step), samples=DENOISE.guide_samples)
            albedo[lanes.part], normal[lanes.part] = tracer.trace(lanes, self._view.placed, seed=seed)
        self._features = albedo / np.float32(DENOISE.guide_samples), normal / np.float32(DENOISE.guide_samples)
        seconds["features"] = time.perf_counter() - started

    def _denoise(self, seconds: dict[str, float]) -> LiveFrame | None:
        """One step of denoising; the picture after the last one."""
        started = time.perf_counter()
        if self._task is None:
            if self._features is None:
                self._trace_features(seconds)
            assert self._features is not None
            self._denoised_at = self.samples
            albedo, normal = (self._pixels.arrange_for_denoiser(values) for values in self._features)
            halves = (sums / np.float32(self._taken) for sums in self._sums)
            first, second = (self._pixels.arrange_for_denoiser(half) for half in halves)
            threads = self._kernels.session.engine.threads
            self._task = _denoise_halves((first, second), (albedo, normal), self.samples, threads)
        picture = next(self._task)
        seconds["denoise"] = time.perf_counter() - started
        if picture is None:
            return None
        self._task = None
        whole = self._pixels.arrange_denoised(picture)
        return self._frame(develop_picture(whole, self._pixels, self._view.request), seconds, is_denoised=True)

    def _frame(self, pixels: NDArray[np.uint8], seconds: dict[str, float], *, is_denoised: bool) -> LiveFrame:
        return LiveFrame(pixels, self.samples, is_denoised, self._view.placement, self._exposure, seconds)


def _denoise_halves(
    noisy: tuple[Floats, Floats], guides: tuple[Floats, Floats], samples: int, threads: int
) -> Iterator[Floats | None]:
    """Short steps of denoising, the last of which yields the picture.

    A function, not a method: a picture that its own generator refers to would be a reference cycle, which Python frees
    late in a process of many objects.
    """
    albedo, normal = guides
    mean = np.asarray((noisy[0] + noisy[1]) / 2, np.float32)
    if samples < REQUEST.fewest:
        yield denoise(mean, albedo, normal, effort="fast", threads=threads)
        return
    clean = []
    for half in noisy:
        clean.append(denoise(half, albedo, normal, effort="fast", threads=threads))
        yield None
    share = weigh_samples(noisy, (clean[0], clean[1]), "srgb", threads=threads)
    yield np.asarray((clean[0] + clean[1]) / 2 * (1 - share) + mean * share, np.float32)
