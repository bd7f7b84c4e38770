"""How many bytes pictures take while they are made: every figure of it, and the lanes that fit beside them.

Figures are bytes per pixel unless they are named otherwise. Measured: see ``docs/background/methods.md``.
"""

from __future__ import annotations

from lippmann.errors import MemoryLimitError
from lippmann.runtime import engine
from lippmann.runtime.machine import amount_in_words

#: A lane of a wavefront at its widest moment: its radiance, its ray counts, the sums and their copies.
BYTES_PER_LANE = 96
#: Beyond this many lanes a wavefront leaves the caches of a processor and nothing is gained; a GPU is to be busy for
#: longer than the next wavefront takes to prepare.
PREFERRED_LANES, PREFERRED_LANES_OF_GPU = 1 << 20, 1 << 22

#: Batches of samples where the memory allows: with more of them, fireflies stand out better against steady noise.
MOST_BATCHES = 8

#: Three numbers in single precision: linear RGB.
COLORS = 12
#: The picture, and the copy that a file writer makes of it.
PICTURE = COLORS + COLORS
#: The squared error of each pixel, its outliers' share and its blur.
ERROR_MAPS = COLORS
#: What a denoiser treats apart: seen light of two halves, its excess, and coverage of two halves by channels.
FOR_DENOISER = PICTURE + COLORS + PICTURE
#: One emission of photons, which lands about once, with what sorting takes, in bytes.
PHOTON = 128
#: What reuse of points takes: points without colours, plain rows, maps and lists of pixels. The paper's order takes
#: the most: 6 for points, 4 for lenses, 8 for places beside centres, 12 for the sorted list.
POINT_IMAGE = 32
#: Depth, normal, albedo, shape and position, and the copies that a file writer makes of them; or albedo, normal, height
#: and coverage for the denoiser, and what a tile adds to them.
LAYERS = 88
#: Open Image Denoise with its feature buffers.
DENOISER = 600
#: The bytes that the network may take beside these: those of a million pixels. Larger pictures it works through in
#: parts, which does not change a bit: 0.6 GB take a tenth longer than 1.5 GB, 0.2 GB twice as long.
NETWORK_MOST = DENOISER << 20


def batches(number: int) -> int:
    """Bytes per pixel of a picture kept in so many batches: their sums, the picture and its errors."""
    return number * COLORS + PICTURE + ERROR_MAPS


def photons(emissions: int, passes: int) -> int:
    """Bytes of the photons of passes of so many emissions, for both half-buffers: one pass is kept while the next is
    shot."""
    return 2 * min(passes, 2) * emissions * PHOTON


#: Bytes per pixel of a tile: its batches and a lane of its wavefront. A denoised tile adds those of the denoiser, for
#: the pixels of its margin, too.
TILE = batches(MOST_BATCHES) + BYTES_PER_LANE
DENOISED_TILE = TILE + DENOISER


def preferred_lanes() -> int:
    """Lanes of a wavefront where memory is not short."""
    return PREFERRED_LANES_OF_GPU if engine.runs_on_gpu() else PREFERRED_LANES


def lanes_within(memory: int, kept: int, needed: int, what: str, preferred: int | None = None) -> int:
    """Lanes of a wavefront beside ``kept`` bytes in ``memory`` bytes, at most ``preferred``.

    Parameters
    ----------
    needed:
        The fewest lanes that do.
    what:
        What is to fit, for the complaint: "512x512 pixels", say.
    preferred:
        None for :func:`preferred_lanes`.

    Raises
    ------
    MemoryLimitError
        If ``memory`` does not hold so many.
    """
    lanes = (memory - kept) // BYTES_PER_LANE
    if lanes < needed:
        raise too_small(memory, what, kept + needed * BYTES_PER_LANE)
    return min(preferred or preferred_lanes(), lanes)


def too_small(memory: int, what: str, required: int, fix: str = "raise the limit") -> MemoryLimitError:
    """The error that ``memory`` bytes do not hold ``what``, which needs ``required``."""
    return MemoryLimitError(
        f"{amount_in_words(memory)} are too small for {what}",
        parameter="memory",
        rule=f"it needs {amount_in_words(required)}",
        fix=fix,
    )
