"""Makes splats of trained parameters: exponents of log scales, sigmoids of logits, and unit quaternions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.runtime.machine import check_input
from lippmann.scene.values.splats import COEFFICIENTS, FloatArray, Splats

#: The harmonic of degree 0, by which colours of files are divided that store them as such.
SH_0 = 0.28209479177387814

#: Centres and standard deviations beyond this are damage: single precision could not multiply them.
_FARTHEST = 1e12

Bytes = NDArray[np.uint8]


def ask_memory(count: int, coefficients: int, *, where: str) -> None:
    """Ask for the memory of ``count`` splats with so many coefficients a colour, before any of it is taken.

    Raises
    ------
    MemoryLimitError
        There is less.
    """
    check_input(2 * 4 * count * (11 + 3 * coefficients), f"{count} Gaussian splats", where=where)


def coefficients_of(rest: int, what: str, *, where: str) -> int:
    """Coefficients of a colour, where a file has ``rest`` numbers beside those of degree 0, all colours together.

    Raises
    ------
    SceneError
        No degree has as many.
    """
    known = {3 * (count - 1): count for count in COEFFICIENTS}
    if rest not in known:
        rule = f"degrees 0 to 4 have {', '.join(str(each) for each in known)}"
        raise SceneError(f"has {rest} {what}", where=where, rule=rule)
    return known[rest]


def activate(
    centers: FloatArray,
    log_scales: FloatArray,
    quaternions: FloatArray,
    opacities: FloatArray,
    harmonics: FloatArray,
    *,
    where: str,
) -> tuple[Splats, tuple[str, ...]]:
    """Splats of what trainers optimize, and notes.

    Parameters
    ----------
    centers, log_scales:
        ``(n, 3)``: places, and natural logarithms of standard deviations.
    quaternions:
        ``(n, 4)``: (x, y, z, w) of any length.
    opacities:
        ``(n,)`` in [0, 1].
    harmonics:
        ``(n, k, 3)``.

    Raises
    ------
    SceneError
        There are no splats, or none whose numbers are finite.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        scales = np.exp(log_scales.astype(np.float32, copy=False))
        return clean(centers, scales, quaternions, opacities, harmonics, where=where)


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # of damaged numbers, which are left out
def clean(
    centers: FloatArray,
    scales: FloatArray,
    quaternions: FloatArray,
    opacities: FloatArray,
    harmonics: FloatArray,
    *,
    linear: bool = False,
    where: str,
) -> tuple[Splats, tuple[str, ...]]:
    """As :func:`activate`, of standard deviations themselves; ``linear`` is that of the splats."""
    if not len(centers):
        raise SceneError("holds no Gaussian splats", where=where)
    # In double precision, which holds the square of every single number.
    wide = quaternions.astype(np.float64)
    rotations = (wide / np.sqrt(np.square(wide).sum(axis=1, keepdims=True))).astype(np.float32)
    sound = (np.abs(centers) < _FARTHEST).all(axis=1) & ((scales >= 0.0) & (scales < _FARTHEST)).all(axis=1)
    sound &= np.isfinite(rotations).all(axis=1) & (opacities >= 0.0) & (opacities <= 1.0)
    sound &= (np.abs(harmonics) < _FARTHEST).all(axis=(1, 2))
    splats = Splats(centers, scales, rotations, opacities, harmonics, linear)
    if sound.all():
        return splats, ()
    lost = int(len(sound) - sound.sum())
    if lost == len(sound):
        raise SceneError("holds no Gaussian splat whose numbers are all finite", where=where, fix="is it damaged?")
    return splats.select(sound), (
        f"{lost} of {len(sound)} splats have numbers that are out of range, and are left out",
    )


def sigmoid(logits: FloatArray) -> FloatArray:
    """Opacities in [0, 1] of what trainers optimize."""
    with np.errstate(over="ignore", invalid="ignore"):  # of damaged numbers, which are left out
        return np.asarray(1.0 / (1.0 + np.exp(-logits.astype(np.float32, copy=False))), np.float32)


#: Most that a component of a unit quaternion can be which is not its largest: two may share that rank.
MOST_SMALL = np.float32(np.sqrt(0.5))


def largest_left_out(three: FloatArray, largest: NDArray[np.integer]) -> FloatArray:
    """Unit quaternions ``(n, 4)`` of which three components ``(n, 3)`` are stored, in order, without the largest.

    ``largest`` ``(n,)`` is the place of that one, 0 to 3.
    """
    rest = np.sqrt(np.maximum(0.0, 1.0 - np.square(three).sum(axis=1))).astype(np.float32)
    whole = np.empty((len(three), 4), np.float32)
    places = np.arange(4)
    for place in range(4):
        own = largest == place
        whole[own, place] = rest[own]
        whole[np.ix_(own, places[places != place])] = three[own]
    return whole
