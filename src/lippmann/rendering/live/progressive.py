"""A view at rest: light gathers, step by step, most of it where it is noisy, and its noise is taken out now and then.

Two streams of samples make two half-buffers, as in :mod:`lippmann.rendering.denoise.dual_buffer`. Each half judges what
the denoiser made of the other: where that is wrong, the samples themselves are shown
(:mod:`lippmann.rendering.denoise.noisy_blend`). The share of the samples grows with their number.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.rendering.denoise.local_statistics import mean_of_others
from lippmann.rendering.denoise.noisy_blend import own_share
from lippmann.rendering.denoise.oidn import denoise, load_denoiser
from lippmann.rendering.film.batched_picture import STREAMS
from lippmann.rendering.live.develop import arrange, codes_of, develop, develop_picture
from lippmann.rendering.live.live_tracer import Lanes, PlacedDisplay
from lippmann.rendering.live.live_view import LiveFrame, LiveView
from lippmann.rendering.live.sample_plan import even_samples, samples_by_noise
from lippmann.rendering.live.seen_pixels import PixelSet
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.runtime.engine_lock import exclusive
from lippmann.runtime.row_threads import Bands
from lippmann.scene.placement import Placement

if TYPE_CHECKING:
    from lippmann.rendering.live.scene_kernels import SceneKernels

Floats = NDArray[np.float32]

#: Seconds that a step of sampling takes, about.
STEP_SECONDS = 0.06
#: Most samples of a pixel, in the mean: its noise is below a code's step then.
MOST_SAMPLES = 1 << 14
#: Samples of the feature buffers.
_FEATURE_SAMPLES = 8
#: The noise is taken out anew once there are so many times the samples of the last time.
_MORE = 1.7
#: From so many samples on the halves judge each other.
_JUDGED_FROM = 8
#: Noise is that of the pixels so far around.
_NOISE_REACH = 2


class Progressive:
    """The growing picture of one view. ``light_up`` gives the scene its light again, which other views may change."""

    def __init__(
        self,
        view: LiveView,
        kernels: SceneKernels,
        display: Display,
        request: RenderRequest,
        placement: Placement,
        placed: PlacedDisplay,
        pixels: PixelSet,
        exposure: float,
        light_up: Callable[[], None],
    ) -> None:
        self.view = view
        self._light_up = light_up
        self._kernels, self._display, self._request = kernels, display, request
        self._placement, self._placed, self._pixels, self._exposure = placement, placed, pixels, exposure
        count = len(pixels.column)
        self._sums = np.zeros((STREAMS, count, 3), np.float32)
        #: Samples of each pixel in each stream.
        self._taken = np.zeros(count, np.int64)
        #: Standard deviation of a sample of each pixel, between codes, as far as it is known.
        self._noise: Floats | None = None
        self._features: tuple[Floats, Floats] | None = None
        self._denoised_at = 0
        self._task: Iterator[Floats | None] | None = None
        #: Samples that the next step takes of each stream.
        self._next = min(count, self._most)
        self._denoises = view.eye is not None and request.box_filter

    @property
    def samples(self) -> int:
        """Samples of a pixel, in the mean."""
        return round(STREAMS * float(self._taken.mean()))

    @property
    def _most(self) -> int:
        return self._kernels.most_lanes // STREAMS

    @exclusive()
    def step(self, seconds: dict[str, float]) -> LiveFrame | None:
        """One step of work; the picture if it changed."""
        self._light_up()
        if self._task is not None:
            return self._denoise(seconds)
        if self._denoises and self._features is None and self._taken.all():
            self._trace_features(seconds)
            return self._denoise(seconds)
        if self.samples >= MOST_SAMPLES:
            return None
        self._sample(seconds)
        if not self._denoises:
            is_even = self._taken.min() == self._taken.max()
            mean = develop(self._mean(), self._pixels, self._request) if is_even else None
            return None if mean is None else self._frame(mean, seconds, is_denoised=False)
        if self._features is not None and self._taken.sum() >= _MORE * self._denoised_at:
            return self._denoise(seconds)
        return None

    def _sample(self, seconds: dict[str, float]) -> None:
        """Samples of the pixels that need them most."""
        if self._noise is None:
            more = even_samples(self._taken, self._next)
        else:
            more = samples_by_noise(self._taken, self._noise, self._next)
        started = time.perf_counter()
        lanes = Lanes(self._pixels, STREAMS, more, self._taken)
        tracer = self._kernels.tracer(self._display, self._request)
        found = tracer.trace(lanes, self._placed, seed=self._request.seed)
        self._sums[:, lanes.pixels] += found.sums
        self._taken += more
        spent = time.perf_counter() - started
        seconds["trace"] = seconds.get("trace", 0.0) + spent
        # As many samples as a step's time allows, twice those of the last at most: the first launch may have compiled.
        # Pictures whose pixels all have as many samples get whole rounds.
        count = int(more.sum())
        least = min(len(more), self._most) if self._noise is None else 1
        self._next = max(least, min(int(count * STEP_SECONDS / spent), 2 * count, self._most))

    def _trace_features(self, seconds: dict[str, float]) -> None:
        started = time.perf_counter()
        tracer = self._kernels.feature_tracer(self._display, self._request)
        count = len(self._pixels.column)
        albedo, normal = np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)
        step = self._kernels.most_lanes // _FEATURE_SAMPLES
        for start in range(0, count, step):
            some = np.zeros(count, np.int64)
            some[start : start + step] = _FEATURE_SAMPLES
            lanes = Lanes(self._pixels, 1, some)
            albedo[lanes.pixels], normal[lanes.pixels] = tracer.trace(lanes, self._placed, seed=self._request.seed + 1)
        for values in (albedo, normal):
            values /= _FEATURE_SAMPLES
        self._features = albedo, normal
        seconds["features"] = time.perf_counter() - started

    def _mean(self) -> Floats:
        return np.asarray(self._sums.sum(axis=0) / (STREAMS * self._taken[:, None]), np.float32)

    def _denoise(self, seconds: dict[str, float]) -> LiveFrame | None:
        """One of the steps that take the noise out; the picture after the last."""
        started = time.perf_counter()
        if self._task is None:
            load_denoiser()
            self._denoised_at = int(self._taken.sum())
            threads = self._kernels.session.engine.threads
            noisy = self._noisy()
            self._noise = self._measured(noisy, threads)
            self._task = _denoised(noisy, self._guides(), self.samples, threads)
        picture = next(self._task)
        seconds["denoise"] = time.perf_counter() - started
        if picture is None:
            return None
        self._task = None
        return self._frame(self._developed(picture), seconds, is_denoised=True)

    def _noisy(self) -> tuple[Floats, Floats]:
        taken = self._taken[:, None].astype(np.float32)
        first, second = (self._picture(sums / taken) for sums in self._sums)
        return first, second

    def _measured(self, noisy: tuple[Floats, Floats], threads: int) -> Floats:
        """Standard deviation ``(n,)`` of a sample of each pixel, between codes, as those around it tell."""
        shape = noisy[0].shape
        first, second = (codes_of(half.reshape(-1, 3), self._request).astype(np.float32) for half in noisy)
        taken = self._picture(np.repeat(self._taken[:, None], 3, axis=1).astype(np.float32))
        variance = (np.square(first - second).reshape(shape) * taken / 2).mean(axis=-1)
        bands = Bands(threads)
        around = mean_of_others(np.ascontiguousarray(variance), _NOISE_REACH, bands)
        noise = np.zeros(len(self._taken) + 1, np.float32)  # the last stands for places past the panel
        blocks = self._pixels.blocks
        noise[self._pixels.number if blocks is None else blocks[..., None]] = np.sqrt(np.maximum(around, 0))[..., None]
        return noise[:-1]

    def _guides(self) -> tuple[Floats, Floats]:
        assert self._features is not None
        albedo, normal = (self._picture(values) for values in self._features)
        return albedo, normal

    def _picture(self, values: Floats) -> Floats:
        """Values ``(n, 3)`` of the pixels as the picture that the denoiser sees: of lenses, where they are blocks."""
        blocks = self._pixels.blocks
        if blocks is None:
            return arrange(values, self._pixels)
        with_black = np.concatenate([values, np.zeros((1, 3), np.float32)])
        return np.ascontiguousarray(with_black[blocks])

    def _developed(self, picture: Floats) -> NDArray[np.uint8]:
        blocks = self._pixels.blocks
        if blocks is None:
            return develop_picture(picture, self._pixels, self._request)
        values = np.zeros((len(self._pixels.column), 3), np.float32)
        shown = blocks >= 0
        values[blocks[shown]] = picture[shown]
        return develop(values, self._pixels, self._request)

    def _frame(self, pixels: NDArray[np.uint8], seconds: dict[str, float], *, is_denoised: bool) -> LiveFrame:
        return LiveFrame(pixels, self.samples, is_denoised, self._placement, self._exposure, seconds)


def _denoised(
    noisy: tuple[Floats, Floats], guides: tuple[Floats, Floats], samples: int, threads: int
) -> Iterator[Floats | None]:
    """Steps of taking the noise out, the last of which brings the picture: no step takes long.

    A function, not a method: a picture that is left half-way and held by its own steps would stay in memory until
    Python looks for such circles, which in a process of many objects it hardly ever does.
    """
    albedo, normal = guides
    mean = np.asarray((noisy[0] + noisy[1]) / 2, np.float32)
    if samples < _JUDGED_FROM:
        yield denoise(mean, albedo, normal, effort="fast", threads=threads)
        return
    clean = []
    for half in noisy:
        clean.append(denoise(half, albedo, normal, effort="fast", threads=threads))
        yield None
    share = own_share(noisy, (clean[0], clean[1]), "srgb", threads=threads)
    yield np.asarray((clean[0] + clean[1]) / 2 * (1 - share) + mean * share, np.float32)
