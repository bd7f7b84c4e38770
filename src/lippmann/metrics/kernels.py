"""The compiled parts of a comparison. The modules that use them import them late: loading Numba takes half a second."""

from __future__ import annotations

import math
from typing import Any

from lippmann.runtime.numba_jit import inlined, uncounted

#: Values of a row that SSIM is worked out for at a time: the rows that its window sees of them stay in the cache.
COLUMNS = 512

#: Rows of :func:`add_similarities`'s room.
SIMILARITY_ROOM = 10


@uncounted
def add_similarities(
    first: Any,
    second: Any,
    present: Any,
    masked: bool,
    channels: int,
    down: Any,
    across: Any,
    c1: float,
    c2: float,
    room: Any,
) -> float:
    """The sum of SSIM over all windows that lie inside two pictures and are centred on values that exist.

    Parameters
    ----------
    first, second:
        ``(H, W * channels)`` float64; where ``masked``, zero at what does not exist.
    present:
        Alike, 1 at what exists and 0 elsewhere, if ``masked``: what does not exist weighs nothing. Else anything of
        that type.
    down, across:
        Weights of the window's rows and columns, odd in number, symmetric, each with the sum 1.
    c1, c2:
        SSIM's constants.
    room:
        ``(SIMILARITY_ROOM, at least COLUMNS + (len(across) - 1) * channels)`` float64, overwritten.
    """
    tall, wide = len(down), len(across)
    places_down = first.shape[0] - tall + 1
    places_across = first.shape[1] - (wide - 1) * channels
    sums, means = room[:5], room[5:]
    kinds = 5 if masked else 4
    total = 0.0
    for start in range(0, places_across, COLUMNS):
        values = min(COLUMNS, places_across - start)
        seen = values + (wide - 1) * channels
        for row in range(places_down):
            sums[:, :seen] = 0.0
            for k in range(tall // 2 + 1):
                # The weights are the same on both sides of the middle, which is its own other side.
                share = down[k] if k < tall // 2 else 0.5 * down[k]
                top, bottom = row + k, row + tall - 1 - k
                a, b, a2, b2 = first[top, start:], second[top, start:], first[bottom, start:], second[bottom, start:]
                _add_pair(sums[0], share, a, a2, seen)
                _add_pair(sums[1], share, b, b2, seen)
                _add_squares(sums[2], share, a, b, a2, b2, seen)
                _add_products(sums[3], share, a, b, a2, b2, seen)
                if masked:
                    _add_pair(sums[4], share, present[top, start:], present[bottom, start:], seen)
            means[:, :values] = 0.0
            for k in range(wide // 2 + 1):
                share = across[k] if k < wide // 2 else 0.5 * across[k]
                left, right = k * channels, (wide - 1 - k) * channels
                for kind in range(kinds):
                    _add_pair(means[kind], share, sums[kind, left:], sums[kind, right:], values)
            if masked:
                # Where nothing of a window exists its weight is 0; it is not centred on a value and does not count.
                weights = means[4]
                for kind in range(4):
                    for x in range(values):
                        means[kind, x] /= weights[x]
            mean_a, mean_b, squares, products = means[0], means[1], means[2], means[3]
            for x in range(values):
                # Both variances are needed as a sum only.
                both, alike = mean_a[x] * mean_a[x] + mean_b[x] * mean_b[x], 2.0 * mean_a[x] * mean_b[x]
                mean_a[x] = ((alike + c1) * (2.0 * products[x] - alike + c2)) / ((both + c1) * (squares[x] - both + c2))
            if masked:
                centre = present[row + tall // 2, start + wide // 2 * channels :]
                for x in range(values):
                    if centre[x] > 0.0:
                        total += mean_a[x]
            else:
                for x in range(values):
                    total += mean_a[x]
    return total


@inlined
def _add_pair(total: Any, share: float, one: Any, other: Any, count: int) -> None:
    # As those below: a loop that writes to one place only becomes vector code.
    for x in range(count):
        total[x] += share * (one[x] + other[x])


@inlined
def _add_squares(total: Any, share: float, a: Any, b: Any, a2: Any, b2: Any, count: int) -> None:
    for x in range(count):
        total[x] += share * (a[x] * a[x] + b[x] * b[x] + a2[x] * a2[x] + b2[x] * b2[x])


@inlined
def _add_products(total: Any, share: float, a: Any, b: Any, a2: Any, b2: Any, count: int) -> None:
    for x in range(count):
        total[x] += share * (a[x] * b[x] + a2[x] * b2[x])


@uncounted
def look_up(codes: Any, levels: Any, values: Any) -> None:
    """``values = levels[codes]``, all of one dimension, a few times quicker than NumPy."""
    for k in range(len(codes)):
        values[k] = levels[codes[k]]


@uncounted
def gather(pixels: Any, row: Any, column: Any, found: Any, gathered: Any) -> None:
    """``gathered (H, W, 3) = pixels[row, column]`` where ``found``, else 0; the other three are ``(H, W)``."""
    for y in range(gathered.shape[0]):
        for x in range(gathered.shape[1]):
            if found[y, x]:
                for c in range(3):
                    gathered[y, x, c] = pixels[row[y, x], column[y, x], c]
            else:
                for c in range(3):
                    gathered[y, x, c] = 0


@uncounted
def add_changes(before: Any, seen_before: Any, after: Any, seen_after: Any, sums: Any) -> int:
    """How errors ``(H, W, 3)`` differ between two views, where ``(H, W)`` flags say that both have a pixel.

    Adds to ``sums`` the squared differences and half the squares of both; returns how many values that were.
    """
    squared, own, count = 0.0, 0.0, 0
    for row in range(before.shape[0]):
        for column in range(before.shape[1]):
            if not (seen_before[row, column] and seen_after[row, column]):
                continue
            for c in range(3):
                one, other = before[row, column, c], after[row, column, c]
                squared += (other - one) * (other - one)
                own += one * one + other * other
            count += 3
    sums[0] += squared
    sums[1] += 0.5 * own
    return count


@uncounted
def mark_jumps(values: Any, at: Any, limit: float, marks: Any) -> None:
    """Mark pixels that differ from a neighbour, along all four axes of the micro-images.

    Parameters
    ----------
    values:
        ``(pixels, channels)``; NaN where nothing is seen. Two differ if a channel does by more than ``limit``, or is
        NaN in one of them.
    at:
        ``(lens_rows, lens_cols, ny, nx)``: one more than the number of the pixel at each place, 0 where there is none.
    marks:
        ``(pixels,)`` bool; both of a pair that differs become True.
    """
    rows, columns, ny, nx = at.shape
    channels = values.shape[1]
    for j in range(rows):
        for i in range(columns):
            for y in range(ny):
                for x in range(nx):
                    pixel = at[j, i, y, x] - 1
                    if pixel < 0:
                        continue
                    for axis in range(4):
                        other = -1
                        if axis == 0 and x + 1 < nx:
                            other = at[j, i, y, x + 1] - 1
                        elif axis == 1 and y + 1 < ny:
                            other = at[j, i, y + 1, x] - 1
                        elif axis == 2 and i + 1 < columns:
                            other = at[j, i + 1, y, x] - 1
                        elif axis == 3 and j + 1 < rows:
                            other = at[j + 1, i, y, x] - 1
                        if other < 0:
                            continue
                        for c in range(channels):
                            a, b = values[pixel, c], values[other, c]
                            if abs(a - b) > limit or math.isnan(a) != math.isnan(b):
                                marks[pixel] = True
                                marks[other] = True
                                break
