"""Flicker of a film by its own account: how much the errors of successive frames differ."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import cast

from lippmann.sequences.tuning import TUNING

Figures = Mapping[str, object]


def add_flicker(estimate: Figures | None, traced: float = 1.0, *, traced_error: float = 1.0) -> Figures | None:
    """A frame's estimate, as its file holds it, with its flicker.

    Flicker is half the mean squared change of the error from one frame to the next, in dB, as
    ``docs/reference/quality-figures.md`` defines it for views: for errors independent of each other it is the PSNR.

    Errors by chance are independent, as each frame has a seed of its own. What a denoiser gets wrong in both halves of
    a picture alike may stay from frame to frame, which does not flicker, or be new in each: half of it counts, and all
    and none of it are the ends of the interval. Pixels that take a key frame's light may not flicker at all, so that
    the upper end counts those alone that were traced. Behind a display at rest they keep their code, so that the
    flicker itself counts the error of the traced ones alone, too.

    Parameters
    ----------
    estimate:
        What :meth:`~lippmann.rendering.estimate.psnr.Estimate.to_dict` gives; None where nothing is known.
    traced:
        Share of the pixels that were traced.
    traced_error:
        Share of the squared error in these, where the others show what they showed in the frame before.

    Returns
    -------
    The same with ``flicker``, ``flicker_low`` and ``flicker_high`` in dB where errors by chance are known.
    """
    if estimate is None or "by_chance" not in estimate:
        return estimate
    by_chance, psnr, low, high = (
        cast("float", estimate[name]) for name in ("by_chance", "psnr", "psnr_low", "psnr_high")
    )
    moving, fewest = (
        -10 * math.log10(max(share, TUNING.least_traced)) for share in (traced_error, min(traced, traced_error))
    )
    middle, most = mean_psnr((by_chance, psnr)) + moving, max(by_chance, high) + fewest
    return {**estimate, "flicker": round(middle, 2), "flicker_low": low, "flicker_high": round(most, 2)}


def mean_psnr(values: Iterable[float]) -> float:
    """The PSNR in dB of the mean squared error of several of the same size, from their own."""
    errors = [10 ** (-value / 10) for value in values]
    return -10 * math.log10(sum(errors) / len(errors))


def flicker_in_words(figures: Figures) -> str:
    """The flicker among ``figures`` and its interval."""
    middle, low, high = (f"{figures[name]:.1f}" for name in ("flicker", "flicker_low", "flicker_high"))
    return f"flicker {middle} dB ({low} to {high})"


def film_in_words(estimates: Iterable[Figures | None]) -> str | None:
    """One line on the frames' estimates; None where no frame has one."""
    frames = [estimate for estimate in estimates if estimate is not None]
    means = {
        name: mean_psnr(cast("float", one[name]) for one in frames)
        for name in ("psnr", "flicker", "flicker_low", "flicker_high")
        if frames and all(name in one for one in frames)
    }
    if "psnr" not in means:
        return None
    worst = min(cast("float", one["psnr"]) for one in frames)
    line = f"estimated PSNR of the frames {means['psnr']:.1f} dB, of the worst {worst:.1f} dB"
    return f"{line}, of their {flicker_in_words(means)}" if "flicker" in means else line
