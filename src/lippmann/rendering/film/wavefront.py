"""Wavefronts of samples: every ray of every pixel, without reuse.

Pixels are traced column by column in strips of four rows, for coherence: the processor traces the rays of 16 lanes
together, until the last of them ends. Four rows of a column look in the same direction through lenses above each other,
or through neighbouring points of one lens, and hit much the same; four pixels of a row are four views. The random
numbers depend on the pixel alone, so the order does not change the picture. Rows below the last whole strip are traced
row by row. Lanes are *places* in this order; pictures are in rows.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field
from typing import TypeVar

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide
from lippmann.device.sobol import SampleStream
from lippmann.device.types import Bool, Color3f, Float, Spectrum, UInt32
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.film.memory_model import Plan, SampleRange, Tile
from lippmann.rendering.transport.integrator import Integrator, PixelSample
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import PixelRays, RaySource
from lippmann.rendering.transport.specular_chains import sample_pixel

T = TypeVar("T", bound=np.generic)

#: Rows of a strip: with one sample a pixel, 16 lanes are a square.
STRIP_ROWS = 4


@dataclass(frozen=True, eq=False)
class Coverage:
    """Coverage: share of a pixel's samples whose primary ray hits a surface.

    Attributes
    ----------
    share:
        ``(H, W, C)`` float32 in [0, 1]; C is 3 where each sub-pixel has rays of its own, else 1.
    samples:
        Of each pixel.
    """

    share: NDArray[np.float32]
    samples: int

    def __add__(self, other: Coverage) -> Coverage:
        """Coverage by the samples of both."""
        samples = self.samples + other.samples
        hits = self.samples * self.share + other.samples * other.share
        return Coverage((hits / max(1, samples)).astype(np.float32), samples)


@dataclass
class RayTotals:
    """Rays traced for a picture, by kind, and samples thrown away because they were not finite."""

    primary: int = 0
    shadow: int = 0
    secondary: int = 0
    discarded: int = 0

    def __add__(self, other: RayTotals) -> RayTotals:
        return RayTotals(*(sum(pair) for pair in zip(astuple(self), astuple(other), strict=True)))


@dataclass
class Frame:
    """A rendered picture with its costs.

    Attributes
    ----------
    pixels:
        ``(height, width, 3)`` float32 linear radiance.
    maps:
        Further layers ``(height, width)`` of the methods that have any.
    shares:
        Shares of pixels that were traced, reprojected and interpolated; empty where all were traced.
    specular, excess:
        Specular light in ``pixels``, and its part above the clamp on single chains; None where not separated.
    coverage:
        Coverage of the pixels by surfaces; None where it is not known.
    """

    pixels: NDArray[np.float32]
    rays: RayTotals = field(default_factory=RayTotals)
    seconds_compile: float = 0.0
    seconds_trace: float = 0.0
    seconds_reuse: float = 0.0
    maps: dict[str, NDArray[np.generic]] = field(default_factory=dict)
    shares: dict[str, float] = field(default_factory=dict)
    specular: NDArray[np.float32] | None = None
    excess: NDArray[np.float32] | None = None
    coverage: Coverage | None = None


def trace_frame(
    integrator: Integrator,
    source: RaySource,
    plan: Plan,
    *,
    seed: int = 0,
    box_filter: bool = True,
    corner: tuple[int, int] = (0, 0),
    for_denoiser: bool = False,
    progress: ProgressCallback = silent,
) -> Frame:
    """Trace all samples of ``plan`` and average them per pixel.

    For a part of a picture, ``corner`` is the row and column of its first pixel; its pixels are then those of the
    whole. ``for_denoiser`` keeps specular light and coverage, too, where the integrator separates them.
    """
    frame = Frame(np.zeros((plan.height, plan.width, 3), dtype=np.float32))
    parts = {"radiance": frame.pixels}
    started = time.perf_counter()
    done = 0
    for tile, run in plan:
        lanes = tile.rows * plan.width * plan.channels * run.count
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, done == 0):
            pixels, stream = lay_out_wavefront(source, plan, tile, run, seed, box_filter, corner)
            samples = dr.opaque(mi.Float, plan.samples) if for_denoiser else None
            sample = sample_pixels(integrator, pixels, stream, samples)
            evaluate(sample, lanes, frame.rays)
            if done == 0:
                frame.seconds_compile = measure_compilation(started)
        for name in ("specular", "excess", "covered"):
            if name not in parts and getattr(sample, name) is not None:
                layers = plan.channels if name == "covered" else 3
                parts[name] = np.zeros((plan.height, plan.width, layers), dtype=np.float32)
        rows = slice(tile.first_row, tile.first_row + tile.rows)
        sums = {name: [part[rows].reshape(-1, part.shape[2])] for name, part in parts.items()}
        add_samples(sample, sums, plan.channels, run.count, plan.width)
        done += lanes
        progress(Progress("trace", done, plan.work))
    for part in parts.values():
        part *= np.float32(1 / plan.samples)
    frame.specular, frame.excess = parts.get("specular"), parts.get("excess")
    frame.coverage = Coverage(parts["covered"], plan.samples) if "covered" in parts else None
    frame.seconds_trace = time.perf_counter() - started - frame.seconds_compile
    return frame


def lay_out_wavefront(
    source: RaySource,
    plan: Plan,
    tile: Tile,
    run: SampleRange,
    seed: int,
    box_filter: bool,
    corner: tuple[int, int] = (0, 0),
) -> tuple[PixelRays, SampleStream]:
    """The pixels and sample streams of one wavefront; lanes are ordered pixel (see the module), channel, sample.

    ``corner`` as in :func:`trace_frame`. Values that differ from tile to tile are opaque to the compiler, so that all
    tiles share a kernel.
    """
    lanes = tile.rows * plan.width * plan.channels * run.count
    per_channel, sample = divide(dr.arange(mi.UInt32, lanes), dr.opaque(mi.UInt32, run.count))
    pixel, channel = divide(per_channel, plan.channels)
    strips = in_strips(tile.rows * plan.width, plan.width)
    row, column = locate_pixel(pixel, plan.width, dr.opaque(mi.UInt32, strips))
    row += dr.opaque(mi.UInt32, tile.first_row + corner[0])
    column += dr.opaque(mi.UInt32, corner[1])
    sample += dr.opaque(mi.UInt32, run.first)
    # The stream of a sub-pixel is its own; a picture has fewer than 2^32 sub-pixels.
    number = source.number(column, row) * plan.channels + channel
    stream = SampleStream.of_pixels(number, sample, dr.opaque(mi.UInt32, seed))
    return PixelRays(source, column, row, channel, box_filter), stream


def sample_pixels(
    integrator: Integrator, pixels: PixelRays, stream: SampleStream, samples: Float | None
) -> PixelSample:
    """One sample of each lane's pixel.

    With ``samples``, the pixel's samples so far and these, specular light and coverage are separate where possible.
    """
    if isinstance(integrator, PathIntegrator):
        return sample_pixel(integrator, pixels, stream, mi.Bool(True), samples)
    return PixelSample(*integrator.sample(pixels.ray(stream), stream, mi.Bool(True)))


def evaluate(sample: PixelSample, lanes: int, totals: RayTotals) -> None:
    """Evaluate the radiance of a wavefront, set it to black where it is not finite, and add its rays to ``totals``."""
    counts = sample.counts
    sample.radiance, finite = blacken_invalid(sample.radiance)
    if sample.specular is not None:
        sample.specular = dr.select(finite, sample.specular, mi.Color3f(0))
        sample.excess = dr.select(finite, sample.excess, mi.Color3f(0))
    # All at once: a sum of an unevaluated radiance would run the path loop anew.
    dr.eval(sample.radiance, sample.specular, sample.excess, sample.covered, counts.secondary, counts.shadow, finite)
    totals.primary += lanes
    totals.secondary += sum_counts(counts.secondary)
    totals.shadow += sum_counts(counts.shadow)
    totals.discarded += lanes - int(dr.count(finite)[0])


def blacken_invalid(radiance: Spectrum) -> tuple[Color3f, Bool]:
    """``radiance`` where all of it is finite, else black; and where it is."""
    finite = dr.isfinite(radiance.x) & dr.isfinite(radiance.y) & dr.isfinite(radiance.z)
    return dr.select(finite, radiance, mi.Color3f(0)), finite


def _sum_lanes(values: Float, count: int) -> NDArray[np.float32]:
    """Sums of ``count`` lanes each."""
    return np.asarray(dr.block_sum(values, count) if count > 1 else values)


def add_samples(
    sample: PixelSample,
    sums: Mapping[str, Sequence[NDArray[np.float32]]],
    channels: int,
    count: int,
    width: int | None,
) -> None:
    """Add evaluated samples to ``sums``: by name, for each batch ``(pixels, 3)``, of coverage ``(pixels, channels)``.

    Lanes are ordered pixel, channel, batch, sample; pixels in strips of a picture of that ``width``, or where it is
    None in rows. The sums are in rows. The rays of a sub-pixel carry all three colours: it keeps the one that it shows.
    """
    lights = {"radiance": sample.radiance, "specular": sample.specular, "excess": sample.excess}
    totals = {name: [_sum_lanes(part, count) for part in light] for name, light in lights.items() if light is not None}
    if sample.covered is not None:
        totals["covered"] = [_sum_lanes(sample.covered, count)] * channels
    for name, components in totals.items():
        for index, total in enumerate(components):
            lanes = total.reshape(-1, channels, len(sums[name]))[:, index % channels]
            for batch, sum_of_batch in enumerate(sums[name]):
                sum_of_batch[:, index] += reorder_to_rows(lanes[:, batch], width)


def select_colors(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """``(..., 3)`` from ``(..., channels, 3)``: of the colours that its rays carry a sub-pixel keeps its own."""
    return values[..., 0, :] if values.shape[-2] == 1 else np.diagonal(values, axis1=-2, axis2=-1)


def sum_counts(counts: UInt32) -> int:
    """The sum of evaluated counts over all lanes."""
    # Sums of 32-bit counts overflow beyond 2^32 rays a wavefront; 64 bits do not.
    return int(dr.sum(mi.UInt64(counts))[0])


def measure_compilation(started: float) -> float:
    """Seconds of compilation since ``started`` (:func:`time.perf_counter`), from Dr.Jit's history of kernels.

    The history belongs to the process: kernels of an interrupted render or of another thread may be in it.
    """
    history = dr.kernel_history()
    seconds = sum(float(k.get("codegen_time", 0.0)) + float(k.get("backend_time", 0.0)) for k in history) / 1000.0
    return min(seconds, time.perf_counter() - started)


def in_strips(pixels: int, width: int) -> int:
    """Number of pixels in whole strips, of the first ``pixels`` of a picture of that ``width``."""
    strip = STRIP_ROWS * width
    return pixels // strip * strip


def locate_pixel(place: UInt32, width: int, strips: UInt32) -> tuple[UInt32, UInt32]:
    """Row and column of a place.

    Parameters
    ----------
    place:
        0 to the number of pixels - 1.
    width:
        Columns of the picture; opaque to the compiler, so that windows of all widths share a kernel.
    strips:
        Pixels in whole strips, :func:`in_strips`; 0 for a picture all in rows.
    """
    columns = dr.opaque(mi.UInt32, width)
    strip, inside = divide(place, columns * STRIP_ROWS)
    strip_column, strip_row = divide(inside, STRIP_ROWS)
    row, column = divide(place, columns)
    in_strip = place < strips
    return dr.select(in_strip, strip * STRIP_ROWS + strip_row, row), dr.select(in_strip, strip_column, column)


def reorder_to_rows(values: NDArray[T], width: int | None) -> NDArray[T]:
    """``values (pixels, ...)`` reordered from places, the first of a strip, to rows; unchanged without ``width``."""
    if width is None or not (whole := in_strips(len(values), width)):
        return values
    ordered = np.empty_like(values)
    rows = ordered[:whole].reshape(-1, STRIP_ROWS, width, *values.shape[1:])
    np.swapaxes(rows, 1, 2)[:] = values[:whole].reshape(-1, width, STRIP_ROWS, *values.shape[1:])
    ordered[whole:] = values[whole:]
    return ordered
