"""Transfer functions by name, and the one that suits a volume of which nothing is said."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import decode_srgb
from lippmann.scene.values.volume import Numbers, Per, TransferFunction

#: Known meanings of a volume's numbers: Hounsfield units, or the signal of magnetic resonance.
Kind = Literal["ct", "mr"]

#: A value, its colour in sRGB codes and its opacity.
_Points = tuple[tuple[float, str, float], ...]

#: Hounsfield units: air -1000, fat -100, water 0, muscle 50, bone from 200 up. Opacities per millimetre.
_HOUNSFIELD: dict[str, _Points] = {
    "ct-bone": (
        (150.0, "#c0705a", 0.0),
        (230.0, "#d9a583", 0.06),
        (400.0, "#eed9b6", 0.4),
        (1300.0, "#fffaf0", 0.85),
    ),
    "ct-soft": (
        (-600.0, "#d8987c", 0.0),
        (-250.0, "#e0a488", 0.05),
        (-40.0, "#e3ab8e", 0.02),
        (40.0, "#c47460", 0.008),
        (130.0, "#cc7c64", 0.03),
        (240.0, "#eed3b0", 0.3),
        (1300.0, "#fffaf0", 0.85),
    ),
}
#: Values from 0, the lowest that is shown, to 1, and opacities over a hundredth of the grid.
_RELATIVE: dict[str, tuple[_Points, float]] = {
    "grey": (((0.0, "#606060", 0.0), (0.25, "#909090", 0.06), (1.0, "#ffffff", 0.6)), 1.0),
    "mr": (((0.0, "#40302c", 0.0), (0.3, "#a08478", 0.12), (0.65, "#d8c8b8", 0.35), (1.0, "#fffaf4", 0.6)), 1.0),
    "fire": (
        (
            (0.0, "#000000", 0.0),
            (0.3, "#8c1d3f", 0.03),
            (0.6, "#f07020", 0.12),
            (0.85, "#fcd050", 0.3),
            (1.0, "#ffffe0", 0.5),
        ),
        0.0,
    ),
}

PRESETS = (*_HOUNSFIELD, *_RELATIVE)

#: Numbers of a volume that tell its range.
_MOST_TELLING = 1 << 20
#: Share of the numbers above which they are outliers.
_BRIGHTEST = 0.998
#: Least share of bone for which a CT is shown as bone.
_BONE, _BONE_SHARE = 250.0, 0.004
_HISTOGRAM = 256
#: Values that differ by less than this share, or than this, are one.
_SAME, _LEAST = 1e-9, 1e-30


def preset(name: str, values: Numbers) -> TransferFunction:
    """A preset of :data:`PRESETS` for a volume whose numbers ``values`` (a sample of them) are.

    Hounsfield units are taken as they are; the others are laid over the range of the values.
    """
    per: Per = "mm"
    if name in _HOUNSFIELD:
        points, shading, low, span = _HOUNSFIELD[name], 1.0, 0.0, 1.0
    else:
        (points, shading), per = _RELATIVE[name], "percent"
        low, high = _range(values)
        span = high - low
    return TransferFunction(
        low + span * np.array([value for value, _, _ in points]),
        np.array([linear_of_hex(color) for _, color, _ in points]),
        np.array([opacity for _, _, opacity in points]),
        per,
        shading,
        name,
    )


def linear_of_hex(color: str) -> tuple[float, float, float]:
    """Linear RGB of ``#rrggbb``."""
    codes = np.array([int(color[start : start + 2], 16) for start in (1, 3, 5)]) / 255.0
    red, green, blue = decode_srgb(codes).tolist()
    return red, green, blue


def automatic(values: Numbers, kind: Kind | None) -> TransferFunction:
    """The preset that suits numbers of a kind; without one, of which ``values`` (a sample of them) tell."""
    if kind == "ct" or (kind is None and _is_hounsfield(values)):
        has_bone = float((values > _BONE).mean()) > _BONE_SHARE
        return preset("ct-bone" if has_bone else "ct-soft", values)
    return preset("mr" if kind == "mr" else "grey", values)


def sample(grid: NDArray[np.generic], slope: float, intercept: float) -> Numbers:
    """Values ``(n,)`` of voxels all over a grid."""
    step = max(1, int(np.ceil((grid.size / _MOST_TELLING) ** (1 / 3))))
    values: Numbers = grid[::step, ::step, ::step].astype(np.float64).ravel() * slope + intercept
    return values


def _is_hounsfield(values: Numbers) -> bool:
    """Whether there is as much air and tissue as in a CT."""
    air = float(((values >= -1100.0) & (values <= -850.0)).mean())
    tissue = float(((values >= -200.0) & (values <= 300.0)).mean())
    return air > 0.05 and tissue > 0.02 and values.min() >= -5000.0 and values.max() <= 70000.0


def _range(values: Numbers) -> tuple[float, float]:
    """The lowest value that is shown, and that from which all are shown alike.

    Half-way from the lowest to where Otsu's threshold (1979) parts the dark from the bright; and all but outliers.
    From 0, if the lowest is less and most are 0: maps of a statistic have it where nothing was measured.
    """
    lowest, highest = float(values.min()), float(np.quantile(values, _BRIGHTEST))
    if highest <= lowest:
        highest = float(values.max())
    size = max(abs(lowest), abs(highest))
    if highest - lowest <= max(_SAME * size, _LEAST):
        return highest - max(1.0, size / 1e6), highest
    counts, edges = np.histogram(values.clip(lowest, highest), _HISTOGRAM)
    middles = (edges[:-1] + edges[1:]) / 2.0
    below = np.cumsum(counts)
    above = below[-1] - below
    sums = np.cumsum(counts * middles)
    with np.errstate(invalid="ignore", divide="ignore"):
        apart = np.square(sums / below - (sums[-1] - sums) / above) * below * above
    apart = np.where(above > 0, apart, -1.0)
    # All thresholds in a gap part the values alike: the middle one.
    best = np.flatnonzero(apart >= apart.max() * (1.0 - 1e-9))
    low = (lowest + float(edges[1 + best].mean())) / 2.0
    return (0.0 if low < 0.0 < highest and (values == 0.0).mean() > 0.5 else low), highest
