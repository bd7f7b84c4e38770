"""Cutting a picture into pieces of work that fit the memory.

A tile is a band of whole rows; a pass is a run of samples of every pixel in it. Tile and pass together make one
wavefront. A run is a wavefront of a picture whose samples are gathered in batches: some pixels, some samples of some
batches. Wavefronts of a picture are about equally large, so that one compiled kernel serves them all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from lippmann.rendering.film.memory_model import PICTURE, lanes_within


@dataclass(frozen=True)
class Tile:
    """Rows ``first_row`` to ``first_row + rows`` of the picture."""

    index: int
    first_row: int
    rows: int


@dataclass(frozen=True)
class Pass:
    """Samples ``first`` to ``first + count`` of every pixel."""

    first: int
    count: int


@dataclass(frozen=True)
class Run:
    """One wavefront of batches: ``count`` samples in each of ``batches`` for the pixels ``first`` to ``last``.

    ``starts``: the number of the first sample of each batch in its stream. ``step``: from pixel to pixel.
    ``in_strips``: whether pixels are counted as places in whole strips, see :mod:`.wavefront`, else in rows.
    """

    first: int
    last: int
    batches: tuple[int, ...]
    starts: tuple[int, ...]
    count: int
    step: int = 1
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
        return [Tile(i, row, min(self.rows_per_tile, self.height - row)) for i, row in enumerate(starts)]

    @property
    def passes(self) -> list[Pass]:
        starts = range(0, self.samples, self.samples_per_pass)
        return [Pass(first, min(self.samples_per_pass, self.samples - first)) for first in starts]

    @property
    def lanes(self) -> int:
        """Lanes of the largest wavefront."""
        return self.rows_per_tile * self.width * self.channels * self.samples_per_pass

    @property
    def work(self) -> int:
        """Samples of the whole picture, all channels."""
        return self.width * self.height * self.channels * self.samples

    def __iter__(self) -> Iterator[tuple[Tile, Pass]]:
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

    ``kept``: bytes of them that something else takes beside the picture.

    Raises
    ------
    MemoryLimitError
        If not even one row of one sample fits beside the picture.
    """
    row_lanes = width * channels
    kept += width * height * PICTURE
    most = max(row_lanes, lanes_within(memory, kept, row_lanes, f"{width}x{height} pixels", preferred_lanes))
    run = equal_length(samples, most // row_lanes)
    rows = equal_length(height, most // (row_lanes * run))
    return Plan(width, height, channels, samples, rows, run)


def cut_batches(
    pixels: int, batches: tuple[int, ...], starts: tuple[int, ...], count: int, lanes: int, strip: int
) -> Iterator[Run]:
    """Divide ``count`` samples of each of ``batches`` for all pixels into wavefronts of at most about ``lanes`` lanes.

    Parameters
    ----------
    starts:
        Number of the first sample of each batch in its stream.
    lanes:
        Lanes of one colour channel.
    strip:
        Pixels of a strip. Runs consist of whole ones, but for the last, unless a run holds less than one.
    """
    most = lanes // (count * len(batches)) or lanes // count or lanes
    in_strips = most >= strip
    per_run = equal_length(-(-pixels // strip), most // strip) * strip if in_strips else equal_length(pixels, most)
    together = max(1, min(len(batches), lanes // (per_run * count)))
    length = max(1, min(count, lanes // per_run))
    for first in range(0, pixels, per_run):
        for batch in range(0, len(batches), together):
            for before in range(0, count, length):
                yield Run(
                    first,
                    min(first + per_run, pixels),
                    batches[batch : batch + together],
                    tuple(start + before for start in starts[batch : batch + together]),
                    min(length, count - before),
                    in_strips=in_strips,
                )


def equal_length(total: int, most: int) -> int:
    """Length of the fewest equal parts of ``total`` that are not longer than ``most`` (taken for 1 if less).

    Equal parts, so that the last is not a stub with a kernel of its own.
    """
    parts = -(-total // max(1, min(total, most)))
    return -(-total // parts)
