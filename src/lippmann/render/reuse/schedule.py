"""In which order the micro-images are made, and from which others each receives its points.

``paper``: lens by lens from the left, each from the one before. ``dyadic`` (the default): key lenses ``2^n`` apart are
traced, then the lenses halfway between receive points from the done ones on every side, and so on down to neighbours.
Points of a surface at height z are seen through ``|z| / gap`` lenses, so that a surface far from the lens plane is
already covered by the keys, and one near to it is traced where the finer levels first meet it: each lens receives from
the nearest lenses that are done, and whole levels are traced at once.
"""

from __future__ import annotations

from dataclasses import dataclass

from lippmann.display import Display

#: Distance of the key lenses in the default order, in lenses. A point twice the gap times this far away is seen by all
#: lenses between two keys; nearer ones are caught by the finer levels.
KEY_STRIDE = 16


@dataclass(frozen=True)
class Level:
    """Lenses ``(i, j)`` made together.

    A lens is made if both indices are multiples of ``stride`` and it has not been made before; it receives from lenses
    at the ``offsets`` (di, dj) that are. No offsets: all its pixels are traced.
    """

    stride: tuple[int, int]
    offsets: tuple[tuple[int, int], ...]


def dyadic_levels(display: Display, key_stride: int = KEY_STRIDE) -> list[Level]:
    """Levels of the default order, keys first."""
    grid = display.lens_grid
    flat = display.lens_array.layout == "lenticular"
    stride = key_stride
    while stride > 1 and stride >= grid.columns:
        stride //= 2
    down = 1 if flat else stride
    levels = [Level((stride, down), ())]
    while stride > 1:
        half = stride // 2
        rows = (0,) if flat else (-half, 0, half)
        offsets = tuple((di, dj) for di in (-half, 0, half) for dj in rows if (di, dj) != (0, 0))
        levels.append(Level((half, 1 if flat else half), offsets))
        stride = half
    return levels
