"""Full rendering in batches of samples, whose differences give the error of the picture.

The samples of a pixel come from ``STREAMS`` independent sample streams. Each stream is divided into equally many
batches. The samples of one stream are stratified together over the pixel and the emitters, so fewer streams mean less
variance; the difference between streams measures how much less. This module traces the samples, wavefront by wavefront.
:mod:`.batched_picture` holds their sums and estimates the error.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Coding
from lippmann.device.kernel_ops import divide, upload
from lippmann.device.sobol import SampleStream
from lippmann.device.types import UInt32
from lippmann.display.panel import PixelWindow
from lippmann.progress import Progress, ProgressCallback, of_part, silent
from lippmann.rendering.estimate.psnr import PixelErrors
from lippmann.rendering.film import memory_model
from lippmann.rendering.film.batched_picture import STREAMS, BatchedPicture
from lippmann.rendering.film.memory_model import BatchWavefront, cut_batches
from lippmann.rendering.film.wavefront import (
    STRIP_ROWS,
    Frame,
    RayTotals,
    add_samples,
    evaluate,
    in_strips,
    locate_pixel,
    measure_compilation,
    sample_pixels,
)
from lippmann.rendering.transport.integrator import Integrator
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import PixelRays, RaySource, SubpixelRays

Floats = NDArray[np.float32]


class BatchedRender(BatchedPicture):
    """A progressive picture with an estimate of its own error; :meth:`add` takes more samples.

    Parameters
    ----------
    integrator, source:
        The integrator, and the rays that it traces.
    seed:
        0 to 2**32 - 1. With the same calls of :meth:`add` the same seed gives the same picture.
    box_filter:
        Samples are spread over the pixel; else all go through its centre.
    coding:
        How values become codes; errors are measured between codes.
    memory:
        Bytes that may be used, the picture's own included; less memory means fewer batches.
    window:
        The part of the picture that is rendered; None for all of it. Its pixels are those of the whole picture.
    for_denoiser:
        Specular light and coverage are kept, too, where the integrator separates them: see :meth:`specular_halves` and
        :meth:`coverage_halves`.

    Attributes
    ----------
    rays, seconds_compile, seconds_trace:
        Totals over all calls of :meth:`add`.

    Raises
    ------
    MemoryLimitError
        If two batches of the picture and one wavefront do not fit into ``memory``.
    """

    def __init__(
        self,
        integrator: Integrator,
        source: RaySource,
        *,
        seed: int = 0,
        box_filter: bool = True,
        coding: Coding = "srgb",
        memory: int,
        window: PixelWindow | None = None,
        for_denoiser: bool = False,
    ) -> None:
        self._integrator = integrator
        self._source = source
        self._seed = seed
        self._box_filter = box_filter
        self.rays = RayTotals()
        self.seconds_compile = 0.0
        self.seconds_trace = 0.0
        self._window = window or PixelWindow(0, 0, source.width, source.height)
        keeps_coverage = for_denoiser and isinstance(integrator, PathIntegrator)
        keeps_specular = isinstance(integrator, PathIntegrator) and for_denoiser and integrator.light.chains is not None
        further = memory_model.FOR_DENOISER * keeps_coverage
        batches, self._lanes = _fit_batches(self._window, source.channels, memory, further)
        super().__init__(
            batches,
            self._window.shape,
            source.channels,
            coding,
            keeps_specular=keeps_specular,
            keeps_coverage=keeps_coverage,
            blur_after=_make_blur_estimator(integrator, source, self._window, seed),
        )

    def add(self, samples: int, progress: ProgressCallback = silent) -> None:
        """Take ``samples`` more of every pixel."""
        channels, pixels = self._source.channels, self._sums.shape[1]
        together = self.samples + samples
        started, done, compiled = time.perf_counter(), 0, 0.0
        self._errors = None
        for integrator, stretch in _split_by_light(self._integrator, self.samples, samples):
            taken = list(self._taken)
            for run in self._cut_wavefronts(stretch):
                with dr.scoped_set_flag(dr.JitFlag.KernelHistory, done == 0):
                    self._trace(integrator, run, together)
                    if done == 0:
                        compiled = measure_compilation(started)
                if run.last == pixels:
                    for batch in run.batches:
                        taken[batch] += run.count
                done += (run.last - run.first) * channels * run.count * len(run.batches)
                progress(Progress("trace", done, pixels * channels * samples))
            self._taken = taken
        self.seconds_compile += compiled
        self.seconds_trace += time.perf_counter() - started - compiled

    def to_display(self, values: Floats) -> Floats:
        """``(..., H, W, 3)``; of sub-pixels whose rays keep all colours, ``(..., H, 3 W, 3)``, each its own colour."""
        return self._source.own_colors(values) if isinstance(self._source, SubpixelRays) else values

    def _cut_wavefronts(self, samples: int) -> Iterator[BatchWavefront]:
        """Wavefronts that take ``samples`` more of every pixel."""
        number, per_stream = self.batches, self._batches_of_stream
        each, rest = divmod(samples, number)
        # The next sample of each stream; its batches take consecutive runs of samples.
        had = self._per_stream()
        # The remainder goes to the batches with the fewest samples, alternating between streams.
        fewest = sorted(_alternate_streams(number), key=lambda batch: self._taken[batch])
        for batches, count in ((tuple(range(number)), each), (tuple(sorted(fewest[:rest])), 1)):
            starts = []
            for batch in batches:
                starts.append(had[batch // per_stream])
                had[batch // per_stream] += count
            if batches and count:
                pixels, lanes = self._sums.shape[1], self._lanes // self._source.channels
                strip = STRIP_ROWS * self._window.width
                yield from cut_batches(pixels, batches, tuple(starts), count, lanes, strip)

    def _trace(self, integrator: Integrator, run: BatchWavefront, together: int) -> None:
        """Add the samples of a run; every pixel then has ``together`` samples, by which excess is limited.

        Lanes are ordered pixel (see :mod:`.wavefront`), channel, batch, sample. Values that differ from run to run are
        opaque to the compiler, so that all runs share a kernel.
        """
        channels, window = self._source.channels, self._window
        number, per_stream = len(run.batches), self._batches_of_stream
        lanes = (run.last - run.first) * channels * number * run.count
        rest, sample = divide(dr.arange(mi.UInt32, lanes), dr.opaque(mi.UInt32, run.count))
        rest, place = divide(rest, dr.opaque(mi.UInt32, number))
        pixel, channel = divide(rest, channels)
        pixel += dr.opaque(mi.UInt32, run.first)
        strips = in_strips(self._sums.shape[1], window.width) if run.in_strips else 0
        row, column = locate_pixel(pixel, window.width, dr.opaque(mi.UInt32, strips))
        row += dr.opaque(mi.UInt32, window.top)
        column += dr.opaque(mi.UInt32, window.left)
        pixel = self._source.number(column, row)
        sample += dr.gather(mi.UInt32, _upload_padded(run.starts), place)
        stream_of = dr.gather(mi.UInt32, _upload_padded([batch // per_stream for batch in run.batches]), place)
        stream = SampleStream.of_pixels(pixel * channels + channel, sample, dr.opaque(mi.UInt32, self._seed), stream_of)
        pixels = PixelRays(self._source, column, row, channel, self._box_filter)
        samples = None if self._covered is None else dr.opaque(mi.Float, together)
        traced = sample_pixels(integrator, pixels, stream, samples)
        evaluate(traced, lanes, self.rays)
        add_samples(traced, self._sums_of(run), channels, run.count, window.width if run.in_strips else None)


def _make_blur_estimator(
    integrator: Integrator, source: RaySource, window: PixelWindow, seed: int
) -> Callable[[int], Floats] | None:
    """The function from samples per pixel to the squared bias of photon density estimation; None without photons."""
    if not isinstance(integrator, PathIntegrator) or integrator.light.photon_passes is None:
        return None
    from lippmann.rendering.film.caustic_blur import SquaredBlur

    return SquaredBlur(integrator, integrator.light.photon_passes, source, window, seed).after


def _split_by_light(integrator: Integrator, first: int, samples: int) -> Iterator[tuple[Integrator, int]]:
    """Runs of ``samples`` samples per pixel from number ``first`` on, each with the integrator of its photon pass."""
    while samples > 0:
        count, current = samples, integrator
        if isinstance(integrator, PathIntegrator):
            light, served = integrator.light.at(first)
            count = min(samples, served or samples)
            current = integrator if light is integrator.light else integrator.lit_by(light)
        yield current, count
        first, samples = first + count, samples - count


def trace_in_batches(
    make_batches: Callable[[int, PixelWindow], BatchedRender],
    size: tuple[int, int],
    samples: int,
    memory: int,
    progress: ProgressCallback = silent,
) -> tuple[Frame, PixelErrors]:
    """The picture of ``samples`` (two or more) samples per pixel and its errors, in bands of rows.

    Only one band's batches are kept at a time, so that memory follows ``memory`` for pictures of any size.
    ``make_batches`` makes those of a window of the picture, whose width and height are ``size``, within so many bytes.

    Raises
    ------
    UsageError
        If ``samples`` is 1: nothing can be compared then.
    MemoryLimitError
        If ``memory`` is too small for the picture and one row.
    """
    width, height = size
    whole = np.zeros((height, width, 3), dtype=np.float32)
    error, outliers, blur = np.zeros((3, height, width), dtype=np.float32)
    frame = Frame(whole)
    left = memory - height * width * (memory_model.PICTURE + memory_model.ERROR_MAPS)
    # Half of what is left for the batches, half for the wavefronts.
    most = max(1, left // 2 // (width * memory_model.batches(memory_model.MOST_BATCHES)))
    bands = -(-height // most)
    rows = -(-height // bands)
    for first in range(0, height, rows):
        last = min(first + rows, height)
        band = make_batches(left, PixelWindow(0, first, width, last - first))
        band.add(samples, of_part(progress, first / height, (last - first) / height, samples * height * width))
        whole[first:last] = band.picture()
        band_errors = band.squared_error()
        error[first:last] = band_errors.values
        outliers[first:last] = 0 if band_errors.outliers is None else band_errors.outliers
        blur[first:last] = 0 if band_errors.blur is None else band_errors.blur
        frame.rays += band.rays
        frame.seconds_compile += band.seconds_compile
        frame.seconds_trace += band.seconds_trace
    return frame, PixelErrors(error, outliers, blur=blur)


def _alternate_streams(number: int) -> tuple[int, ...]:
    """Batch numbers, alternating between streams."""
    per_stream = number // STREAMS
    return tuple(stream * per_stream + place for place in range(per_stream) for stream in range(STREAMS))


def _fit_batches(window: PixelWindow, channels: int, memory: int, further: int) -> tuple[int, int]:
    """Number of batches whose sums fit into ``memory``, and the lanes of a wavefront that fit into the rest.

    ``further`` are the bytes that each pixel takes beside its sums; a wavefront has room for one row at least.
    """
    pixels, row = window.pixels, window.width * channels
    for batches in (memory_model.MOST_BATCHES, memory_model.MOST_BATCHES // 2, STREAMS):
        kept = pixels * (memory_model.batches(batches) + further)
        if memory >= kept + row * memory_model.BYTES_PER_LANE or batches == STREAMS:
            break
    what = f"a picture of {pixels} pixels that is to know its own error"
    return batches, memory_model.fit_lanes(memory, kept, row, what)


def _upload_padded(numbers: Sequence[int]) -> UInt32:
    """``numbers`` on the device, padded by two zeros: Dr.Jit would compile a single number into the kernel."""
    table: UInt32 = upload(np.append(numbers, [0, 0]).astype(np.uint32))
    return table
