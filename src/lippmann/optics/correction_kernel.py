"""Compiled least squares of corrected pictures. It is imported late: Numba takes time to load."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.numba_jit import compiled, uncounted

Real = NDArray[np.float64]
Floats = NDArray[np.float32]

#: Rows that are solved at a time, side by side in the processor's registers.
_LANES = 32


def fista_momenta(steps: int) -> Floats:
    """The share of the last change that is added after each of so many steps of FISTA (Beck and Teboulle 2009)."""
    factors, t = np.empty(steps, dtype=np.float32), 1.0
    for number in range(steps):
        following = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * t * t))
        factors[number] = (t - 1.0) / following
        t = following
    return factors


@uncounted
def add_normal_band(first: NDArray[np.int64], shares: Real, band: Real) -> None:
    """Add ``W'W`` to ``band`` ``(width, 2 m - 1)``, whose middle column is the diagonal."""
    reach = shares.shape[1]
    for n in range(shares.shape[0]):
        for i in range(reach):
            if shares[n, i] > 0.0:
                for j in range(reach):
                    if shares[n, j] > 0.0:
                        band[first[n] + i, j - i + reach - 1] += shares[n, i] * shares[n, j]


@compiled
def solve(
    first_row: int,
    last_row: int,
    meant: Floats,
    first: NDArray[np.int64],
    shares: Floats,
    band: Floats,
    momenta: Floats,
    solved: Floats,
) -> None:
    """Solve rows ``first_row`` to before ``last_row``.

    ``meant`` is ``(parts, rows, width)``, ``solved`` ``(rows, width)``; ``first`` and ``shares`` are those of the parts
    of a pixel one after the other, ``band`` is that of :func:`add_normal_band`, and ``momenta`` are those of
    :func:`fista_momenta`.
    """
    width = meant.shape[2]
    limits = np.zeros((width, 2), dtype=np.int64)
    state = np.empty((4, width, _LANES), dtype=np.float32)
    slope = np.empty(_LANES, dtype=np.float32)
    _solve(first_row, last_row, meant, first, shares, band, momenta, solved, limits, state, slope)


@uncounted
def _solve(
    first_row: int,
    last_row: int,
    meant: Floats,
    first: NDArray[np.int64],
    shares: Floats,
    band: Floats,
    momenta: Floats,
    solved: Floats,
    limits: NDArray[np.int64],
    state: Floats,
    slope: Floats,
) -> None:
    """:func:`solve`. ``state`` is, by lane: the goal ``W'T``, the pixels x, and two buffers of FISTA's y."""
    parts, width, reach = meant.shape[0], meant.shape[2], shares.shape[1]
    largest = np.float32(0.0)
    for c in range(width):
        total = np.float32(0.0)
        limits[c, 0] = band.shape[1]
        for k in range(band.shape[1]):
            if band[c, k] > 0.0:
                total += band[c, k]
                limits[c, 0] = min(limits[c, 0], k)
                limits[c, 1] = k + 1
        largest = max(largest, total)
    step = np.float32(1.0) / largest
    for top in range(first_row, last_row, _LANES):
        lanes = min(_LANES, last_row - top)
        for c in range(width):
            for lane in range(_LANES):
                state[0, c, lane], state[1, c, lane] = np.float32(0.0), np.float32(0.0)
        for c in range(width):
            for part in range(parts):
                n = c * parts + part
                for lane in range(lanes):
                    state[1, c, lane] += meant[part, top + lane, c] / np.float32(parts)
                for i in range(reach):
                    if shares[n, i] > 0.0:
                        weight, at = shares[n, i], first[n] + i
                        for lane in range(lanes):
                            state[0, at, lane] += weight * meant[part, top + lane, c]
            for lane in range(_LANES):
                state[2, c, lane] = state[1, c, lane]
        for number in range(len(momenta)):
            now, ahead = 2 + number % 2, 3 - number % 2
            speed = momenta[number]
            for c in range(width):
                for lane in range(_LANES):
                    slope[lane] = -state[0, c, lane]
                for k in range(limits[c, 0], limits[c, 1]):
                    weight, at = band[c, k], c + k - reach + 1
                    for lane in range(_LANES):
                        slope[lane] += weight * state[now, at, lane]
                for lane in range(_LANES):
                    value = state[now, c, lane] - step * slope[lane]
                    value = min(max(value, np.float32(0.0)), np.float32(1.0))
                    state[ahead, c, lane] = value + speed * (value - state[1, c, lane])
                    state[1, c, lane] = value
        for lane in range(lanes):
            for c in range(width):
                solved[top + lane, c] = state[1, c, lane]


@uncounted
def add_stencil(
    first_row: int,
    last_row: int,
    values: Floats,
    numbers: NDArray[np.int32],
    offsets: NDArray[np.int64],
    weights: Floats,
    sums: Floats,
) -> None:
    """Add to rows of ``sums`` ``(rows, width)`` the ``values`` ``(parts, rows, width)`` about each pixel.

    ``numbers`` ``(rows, width)`` choose each pixel's ``weights`` ``(n, numbers)`` of the values at ``offsets``
    ``(n, 3)``: part, rows down and columns to the right. There is nothing beside the panel.
    """
    height, width = sums.shape
    for row in range(first_row, last_row):
        for m in range(offsets.shape[0]):
            part, other, right = offsets[m, 0], row + offsets[m, 1], offsets[m, 2]
            if 0 <= other < height:
                for column in range(max(0, -right), min(width, width - right)):
                    sums[row, column] += weights[m, numbers[row, column]] * values[part, other, column + right]


@uncounted
def descend(
    first_row: int,
    last_row: int,
    now: Floats,
    numbers: NDArray[np.int32],
    offsets: NDArray[np.int64],
    weights: Floats,
    goal: Floats,
    step: float,
    speed: float,
    solved: Floats,
    ahead: Floats,
) -> None:
    """A step of FISTA: from ``now`` ``(1, rows, width)`` to ``solved`` and, beyond it, ``ahead`` ``(rows, width)``."""
    ahead[first_row:last_row] = np.float32(0.0)
    add_stencil(first_row, last_row, now, numbers, offsets, weights, ahead)
    for row in range(first_row, last_row):
        for column in range(goal.shape[1]):
            value = now[0, row, column] - step * (ahead[row, column] - goal[row, column])
            value = min(max(value, np.float32(0.0)), np.float32(1.0))
            ahead[row, column] = value + speed * (value - solved[row, column])
            solved[row, column] = value
