"""Memory model: bytes that a picture takes while it is rendered, and its division into wavefronts that fit beside it.

Constants are bytes per pixel unless they say otherwise, measured as ``docs/background/methods.md`` says.

A tile is a band of whole rows. A tile and a range of samples of each of its pixels make one wavefront. Where samples
are summed in batches, a wavefront holds some pixels, and some samples of some batches. Wavefronts of a picture are
about equally large, so that one compiled kernel serves them all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from lippmann.errors import MemoryLimitError
from lippmann.runtime import engine
from lippmann.runtime.machine import amount_in_words

#: A lane of a wavefront at its widest moment: its radiance, its ray counts, the sums and their copies.
BYTES_PER_LANE = 96
#: Lanes of a wavefront. More exceed a CPU's caches and gain nothing; a GPU gets enough to be busy while the next
#: wavefront is prepared.
PREFERRED_LANES, PREFERRED_LANES_OF_GPU = 1 << 20, 1 << 22

#: Batches of samples where the memory allows: with more of them, fireflies stand out better against steady noise.
MOST_BATCHES = 8

#: Three numbers in single precision: linear RGB.
COLORS = 12
#: The picture, and the copy that a file writer makes of it.
PICTURE = COLORS + COLORS
#: The squared error of each pixel, its outliers' share and its blur.
ERROR_MAPS = COLORS
#: Separate sums for the denoiser: specular light of both half-buffers, its excess above the clamp, and coverage of
#: both half-buffers in each channel.
FOR_DENOISER = PICTURE + COLORS + PICTURE
#: Bytes of one photon emission, sorting included; an emission lands about once.
PHOTON = 128
#: Reprojection, colours apart. The paper's order takes the most: 6 for points, 4 for lenses, 8 for offsets from pixel
#: centres, 12 for the sorted list.
POINT_IMAGE = 32
#: Depth, normal, albedo, shape and position, and the copies that a file writer makes of them; or albedo, normal, height
#: and coverage for the denoiser, and what a tile adds to them.
LAYERS = 88
#: Open Image Denoise with its feature buffers.
DENOISER = 600
#: Memory limit of the network in bytes: that of a million pixels. It divides larger pictures into parts, with the
#: same result: 0.6 GB take a tenth longer than 1.5 GB, 0.2 GB twice as long.
NETWORK_MOST = DENOISER << 20


def batches(number: int) -> int:
    """Bytes per pixel of a picture in ``number`` batches: their sums, the picture and its errors."""
    return number * COLORS + PICTURE + ERROR_MAPS


def photons(emissions: int, passes: int) -> int:
    """Bytes of photon passes of ``emissions`` each, for both half-buffers: one pass is held while the next is shot."""
    return 2 * min(passes, 2) * emissions * PHOTON


#: Bytes per pixel of a tile: its batches and a lane of its wavefront. A denoised tile adds those of the denoiser, for
#: the pixels of its margin, too.
TILE = batches(MOST_BATCHES) + BYTES_PER_LANE
DENOISED_TILE = TILE + DENOISER


def preferred_lanes() -> int:
    """Lanes of a wavefront where memory is not short."""
    return PREFERRED_LANES_OF_GPU if engine.runs_on_gpu() else PREFERRED_LANES


def fit_lanes(memory: int, kept: int, needed: int, what: str, preferred: int | None = None) -> int:
    """Lanes of a wavefront beside ``kept`` bytes in ``memory`` bytes, at most ``preferred``.

    Parameters
    ----------
    needed:
        Least number of lanes.
    what:
        What must fit, for the error message, such as "512x512 pixels".
    preferred:
        None for :func:`preferred_lanes`.

    Raises
    ------
    MemoryLimitError
        If ``memory`` does not hold so many.
    """
    lanes = (memory - kept) // BYTES_PER_LANE
    if lanes < needed:
        raise make_memory_error(memory, what, kept + needed * BYTES_PER_LANE)
    return min(preferred or preferred_lanes(), lanes)


def make_memory_error(memory: int, what: str, required: int, fix: str = "raise the limit") -> MemoryLimitError:
    """The error that ``memory`` bytes do not hold ``what``, which needs ``required``."""
    return MemoryLimitError(
        f"{amount_in_words(memory)} are too small for {what}",
        parameter="memory",
        rule=f"it needs {amount_in_words(required)}",
        fix=fix,
    )


@dataclass(frozen=True)
class Tile:
    """Rows ``first_row`` to ``first_row + rows`` of the picture."""

    first_row: int
    rows: int


@dataclass(frozen=True)
class SampleRange:
    """Samples ``first`` to ``first + count`` of every pixel."""

    first: int
    count: int


@dataclass(frozen=True)
class BatchWavefront:
    """One wavefront of batches: ``count`` samples in each of ``batches`` for the pixels ``first`` to ``last``.

    ``starts``: the number of the first sample of each batch in its stream. ``in_strips``: whether pixels are counted as
    places in whole strips, see :mod:`.wavefront`, else in rows.
    """

    first: int
    last: int
    batches: tuple[int, ...]
    starts: tuple[int, ...]
    count: int
    in_strips: bool = False


@dataclass(frozen=True)
class Plan:
    """The pieces of one picture, in the order in which they are done."""

    width: int
    height: int
    channels: int
    samples: int
    rows_per_tile: int
    samples_per_pass: int

    @property
    def tiles(self) -> list[Tile]:
        starts = range(0, self.height, self.rows_per_tile)
        return [Tile(row, min(self.rows_per_tile, self.height - row)) for row in starts]

    @property
    def passes(self) -> list[SampleRange]:
        starts = range(0, self.samples, self.samples_per_pass)
        return [SampleRange(first, min(self.samples_per_pass, self.samples - first)) for first in starts]

    @property
    def lanes(self) -> int:
        """Lanes of the largest wavefront."""
        return self.rows_per_tile * self.width * self.channels * self.samples_per_pass

    @property
    def work(self) -> int:
        """Samples of the whole picture, all channels."""
        return self.width * self.height * self.channels * self.samples

    def __iter__(self) -> Iterator[tuple[Tile, SampleRange]]:
        return ((tile, run) for tile in self.tiles for run in self.passes)


def cut_wavefronts(
    width: int,
    height: int,
    samples: int,
    *,
    channels: int = 1,
    memory: int,
    kept: int = 0,
    preferred_lanes: int | None = None,
) -> Plan:
    """Divide ``width`` x ``height`` pixels of ``samples`` each so that the work fits into ``memory`` bytes.

    ``kept``: bytes that are taken by something else than the picture.

    Raises
    ------
    MemoryLimitError
        If not even one row of one sample fits beside the picture.
    """
    row_lanes = width * channels
    kept += width * height * PICTURE
    most = max(row_lanes, fit_lanes(memory, kept, row_lanes, f"{width}x{height} pixels", preferred_lanes))
    run = divide_evenly(samples, most // row_lanes)
    rows = divide_evenly(height, most // (row_lanes * run))
    return Plan(width, height, channels, samples, rows, run)


def cut_batches(
    pixels: int, batches: tuple[int, ...], starts: tuple[int, ...], count: int, lanes: int, strip: int
) -> Iterator[BatchWavefront]:
    """Divide ``count`` samples of each of ``batches`` for all pixels into wavefronts of at most about ``lanes`` lanes.

    Parameters
    ----------
    starts:
        Number of the first sample of each batch in its stream.
    lanes:
        Lanes of one colour channel.
    strip:
        Pixels of a strip. Wavefronts consist of whole strips, but for the last, unless one holds less than a strip.
    """
    most = lanes // (count * len(batches)) or lanes // count or lanes
    in_strips = most >= strip
    per_run = divide_evenly(-(-pixels // strip), most // strip) * strip if in_strips else divide_evenly(pixels, most)
    together = max(1, min(len(batches), lanes // (per_run * count)))
    length = max(1, min(count, lanes // per_run))
    for first in range(0, pixels, per_run):
        for batch in range(0, len(batches), together):
            for before in range(0, count, length):
                yield BatchWavefront(
                    first,
                    min(first + per_run, pixels),
                    batches[batch : batch + together],
                    tuple(start + before for start in starts[batch : batch + together]),
                    min(length, count - before),
                    in_strips=in_strips,
                )


def divide_evenly(total: int, most: int) -> int:
    """Length of the fewest equal parts of ``total`` that are not longer than ``most`` (taken for 1 if less).

    Equal parts, so that the last is not a stub with a kernel of its own.
    """
    parts = -(-total // max(1, min(total, most)))
    return -(-total // parts)
