"""Slices of DICOM files become a stack: which belong together, how they lie, and how far they are apart."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

#: Slices of the same orientation to so many decimals lie in one stack.
_DECIMALS = 3
#: Distances that differ by no more than this share are one, as are places that lie nearer than this share of it.
_EVEN = 0.05
#: Slices of a stack whose gaps are filled.
_MOST_SLICES = 8192
#: Series, and gaps, that a line names.
_NAMED = 8


class SeriesError(Exception):
    """Files that show nothing: ``said`` holds ``error``, ``rule`` and ``fix`` of a line, or ``usage``."""

    def __init__(self, **said: str) -> None:
        super().__init__(said)
        self.said: dict[str, Any] = dict(said)


@dataclass(frozen=True)
class Frame:
    """A slice: picture ``index`` of ``count`` in a file, and what its header tells. Lengths are millimetres.

    ``position`` is that of the middle of the first pixel, ``orientation`` the direction along a row, then down a
    column, ``spacing`` the distance of rows, then of columns; None where the header lacks it.
    ``is_moment`` says that frames of a file follow each other in time, ``is_tile`` that they lie side by side.
    """

    file: str
    index: int
    count: int
    series: str
    description: str
    modality: str
    number: float
    shape: tuple[int, int]
    channels: int = 1
    shows_low_bright: bool = False
    is_moment: bool = False
    is_palette: bool = False
    is_tile: bool = False
    position: tuple[float, ...] | None = None
    orientation: tuple[float, ...] | None = None
    spacing: tuple[float, ...] | None = None
    thickness: float = 0.0
    slope: float = 1.0
    intercept: float = 0.0


@dataclass(frozen=True, eq=False)
class Stack:
    """Slices in order.

    ``patient_from_voxel`` ``(4, 4)`` leads to millimetres toward the left, the back and the head. ``places`` ``(n,)``
    are the slices of an even stack, counted in those that are there, fractions between two; None if it is even.
    """

    frames: list[Frame]
    patient_from_voxel: Numbers
    notes: list[str]
    places: Numbers | None = None


def choose_series(frames: list[Frame], series: str | None, own: str | None) -> tuple[list[Frame], list[str]]:
    """The slices of one series that fit together, and remarks on the others.

    Parameters
    ----------
    series:
        Number, description or UID; None for the series ``own``, or without one that with the most slices.

    Raises
    ------
    SeriesError
        There is none, none of that name, or ``own`` holds nothing that is shown.
    """
    candidates = [frame for frame in frames if frame.channels == 1 and not frame.is_palette and not frame.is_tile]
    counts = Counter(frame.series for frame in candidates)
    if not candidates or (own and series is None and own not in counts):
        asked = [frame for frame in frames if not own or frame.series == own]
        what = "colour pictures alone" if asked else "no pictures"
        if any(frame.is_tile for frame in asked):
            what = "tiles of a microscope's slide, which is no volume"
        raise SeriesError(error=f"holds {what}", rule="series of slices with one number a pixel are shown")
    order = list(counts)
    names = {frame.series: frame.description for frame in reversed(candidates)}
    listed = [f"{place} '{names[uid][:40]}' ({counts[uid]})" for place, uid in enumerate(order[:_NAMED], 1)]
    list_of = ", ".join(listed) + (f" and {len(order) - _NAMED} more" if len(order) > _NAMED else "")
    if series is not None:
        fits = [uid for place, uid in enumerate(order, 1) if series in (str(place), uid)]
        fits = fits or [uid for uid in order if names[uid].casefold() == series.casefold()]
        if not fits:
            raise SeriesError(usage=f"series (and their slices) are {list_of}")
        chosen = fits[0]
    else:
        chosen = own if own is not None and own in counts else max(order, key=lambda uid: counts[uid])
    notes = []
    if len(order) > 1 and series is None and chosen != own:
        place = order.index(chosen) + 1
        notes.append(f"series {place} of {len(order)} is shown; series (and their slices) are {list_of}")
    kinds: dict[object, list[Frame]] = {}
    for frame in candidates:
        if frame.series == chosen:
            turned = None if frame.orientation is None else tuple(np.round(frame.orientation, _DECIMALS).tolist())
            kinds.setdefault((frame.shape, turned, frame.spacing), []).append(frame)
    largest = max(kinds.values(), key=len)
    if largest[0].shows_low_bright:
        notes.append("viewers show its low values bright (MONOCHROME1): here, high values are dense")
    if largest[0].is_moment:
        notes.append("its frames are moments (FrameTime): they are shown as slices")
    others = counts[chosen] - len(largest)
    if others:
        notes.append(f"{others} slices of another size or orientation are left out")
    return largest, notes


def make_stack(frames: list[Frame]) -> Stack:
    """Slices of one size and orientation in the order in which they lie."""
    notes: list[str] = []
    first = frames[0]
    rows_apart, columns_apart = first.spacing or (1.0, 1.0)
    if first.spacing is None or min(first.spacing) <= 0.0:
        rows_apart = columns_apart = 1.0
        notes.append("the size of pixels is not told: 1 mm is taken")
    axes = np.array(first.orientation or (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)).reshape(2, 3)
    lengths = np.linalg.norm(axes, axis=1)
    if lengths.min() < 0.5 or np.linalg.norm(np.cross(*axes)) < 0.5:
        raise SeriesError(error="its slices have no orientation", rule="two directions at right angles")
    axes = axes / lengths[:, None]
    normal = np.cross(axes[0], axes[1])
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1] = axes[0] * columns_apart, axes[1] * rows_apart
    thickness = first.thickness if np.isfinite(first.thickness) and first.thickness > 0.0 else 1.0
    if any(frame.position is None for frame in frames):
        ordered = sorted(frames, key=lambda frame: (frame.number, frame.file, frame.index))
        if len(ordered) > 1:
            notes.append("the slices' places are not told: they are taken in the order of their numbers")
            gap = _gaps(np.array([frame.number for frame in ordered]), 1.0, "numbers")
            notes.extend([gap] if gap else [])
        # Nothing says that the first is the lowest: in most scanners' order it is not.
        matrix[:3, 2] = normal * thickness
        return Stack(ordered, matrix, notes)
    heights = np.array([np.dot(normal, np.array(frame.position)) for frame in frames])
    order = sorted(range(len(frames)), key=lambda each: (heights[each], frames[each].number, frames[each].file))
    heights, ordered = heights[order], [frames[each] for each in order]
    distances = np.diff(heights)
    real = distances[distances > 1e-3]
    step = _usual(real) if len(real) else thickness
    keep = np.concatenate([[True], distances > _EVEN * step])
    if not keep.all():
        notes.append(f"{int((~keep).sum())} slices lie where others lie, and are left out")
        heights, ordered = heights[keep], [frame for frame, kept in zip(ordered, keep, strict=True) if kept]
    origin = np.array(ordered[0].position)
    matrix[:3, 3] = origin
    if len(ordered) == 1:
        matrix[:3, 2] = normal * thickness
        return Stack(ordered, matrix, notes)
    distances = np.diff(heights)
    whole = np.array(ordered[-1].position) - origin
    if np.abs(distances - step).max() <= _EVEN * step:
        # From the first to the last, which also tells of a gantry that is tilted.
        matrix[:3, 2] = whole / (len(ordered) - 1)
        return Stack(ordered, matrix, notes)
    count = round((heights[-1] - heights[0]) / step) + 1
    if count > _MOST_SLICES:
        raise SeriesError(error="its slices lie too far apart", rule=f"{_MOST_SLICES} at their usual distance")
    matrix[:3, 2] = whole / (count - 1)
    even = np.linspace(heights[0], heights[-1], count)
    why = _gaps(heights, step, "mm") or "slices are unevenly spaced"
    notes.append(f"{why}; {count} are interpolated from {len(ordered)}")
    return Stack(ordered, matrix, notes, np.interp(even, heights, np.arange(len(ordered))))


def _usual(distances: Numbers) -> float:
    """The most common distance; of several that are as common the least, as gaps are wider."""
    ordered = np.sort(distances)
    counts = np.searchsorted(ordered, ordered * (1.0 + _EVEN), "right") - np.searchsorted(ordered, ordered)
    least = int(np.argmax(counts))
    return float(np.median(ordered[least : least + counts[least]]))


def _gaps(places: Numbers, step: float, unit: str) -> str:
    """Gaps of missing slices among sorted places that lie a step apart, in words; empty if there is none."""
    missing = np.rint(np.diff(places) / step).astype(int) - 1
    gaps = [f"{places[at]:g} and {places[at + 1]:g}" for at in np.flatnonzero(missing > 0)]
    if not gaps:
        return ""
    count = int(missing[missing > 0].sum())
    more = f", {len(gaps) - _NAMED} more gaps" if len(gaps) > _NAMED else ""
    is_missing = "1 slice is" if count == 1 else f"{count} slices are"
    return f"{is_missing} missing: between {', '.join(gaps[:_NAMED])} {unit}{more}"


def interpolate(grid: NDArray[np.generic], places: Numbers) -> NDArray[np.generic]:
    """Slices between those of a grid ``(n, h, w)``, of the same kind of number; ``places`` as of :class:`Stack`."""
    made = np.empty((len(places), *grid.shape[1:]), grid.dtype)
    for number, place in enumerate(places):
        below = min(int(place), len(grid) - 1)
        above = min(below + 1, len(grid) - 1)
        share = place - below
        mixed = (1.0 - share) * grid[below].astype(np.float64) + share * grid[above].astype(np.float64)
        made[number] = np.rint(mixed) if grid.dtype.kind in "iu" else mixed
    return made
