"""The native picture of a lenticular display from views of the scene: each sub-pixel takes the views that it shows.

A sub-pixel at the right edge under its lens is seen from the left, so it shows view 0, the leftmost camera's; one at
the left edge shows the last. Views are counted by the place under the lens, which is even in the tangent of the
direction. In the view, the colour is taken where the sub-pixel's light line meets the lens plane: a view shows the
panel's rectangle in the lens plane, as an off-axis camera focused there sees it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann._version import VERSION
from lippmann.display import NUMPY, Display
from lippmann.errors import PictureError, UsageError
from lippmann.image import IntegralImage, Provenance
from lippmann.image.banded import write_in_bands
from lippmann.image.integral_image import FloatArray
from lippmann.image.metadata import Metadata
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.quilt import Quilt

Real = NDArray[np.float64]
ViewChoice = Literal["nearest", "linear"]

#: Sub-pixels woven at a time: some 50 arrays of as many numbers.
_BLOCK = 1 << 18

#: Relative difference of aspects that rounding in names and displays' shapes leaves.
_ASPECT_TOLERANCE = 0.02


def weave(
    quilt: Quilt,
    display: Display,
    *,
    choice: ViewChoice = "linear",
    scene: str = "",
    progress: ProgressCallback = silent,
) -> IntegralImage:
    """The picture that shows the views of ``quilt`` on ``display``.

    Parameters
    ----------
    quilt:
        The views, the leftmost camera's first.
    display:
        A lenticular display, slanted or not.
    choice:
        ``nearest`` takes the one view nearest to a sub-pixel's direction, ``linear`` mixes the two next to it. In a
        view, colours are interpolated between pixels in either case.
    scene:
        Name for the picture's provenance.

    Raises
    ------
    UsageError
        If the choice is unknown.
    PictureError
        If the display is not lenticular, or the quilt was made for another shape of panel.
    """
    _check(quilt, display, choice)
    width, height = display.panel.width, display.panel.height
    pixels = np.empty((height, width, 3), dtype=np.float32)
    step = max(1, _BLOCK // width)
    for first in range(0, height, step):
        last = min(first + step, height)
        pixels[first:last] = _woven(quilt, display, choice, first, last)
        progress(Progress("weave", last, height))
    return IntegralImage(pixels, display, provenance=_made(quilt, choice, scene))


def weave_to_file(
    quilt: Quilt,
    display: Display,
    path: Path,
    *,
    choice: ViewChoice = "linear",
    scene: str = "",
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> None:
    """Write what :func:`weave` gives to a TIFF or Zarr file, in memory that does not grow with the panel.

    Parameters and errors as there; of the file as for :func:`lippmann.image.banded.write_in_bands`.
    """
    _check(quilt, display, choice)
    step = max(1, _BLOCK // display.panel.width)

    def rows(first: int, last: int) -> FloatArray:
        band = np.empty((last - first, display.panel.width, 3), dtype=np.float32)
        for start in range(first, last, step):
            stop = min(start + step, last)
            band[start - first : stop - first] = _woven(quilt, display, choice, start, stop)
            progress(Progress("weave", stop, display.panel.height))
        return band

    write_in_bands(rows, Metadata(display, np.eye(4), _made(quilt, choice, scene)), path, bits=bits)


def _made(quilt: Quilt, choice: ViewChoice, scene: str) -> Provenance:
    options = {"views": quilt.layout.views, "view_choice": choice, "direction": "even in the tangent"}
    return Provenance(method="weave", subpixels=True, scene=scene, version=VERSION, options=options)


def _woven(quilt: Quilt, display: Display, choice: ViewChoice, first: int, last: int) -> FloatArray:
    """Some rows of the picture, ``(last - first, W, 3)``."""
    width = display.panel.width
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(first, last) + 0.5)
    woven = np.empty((last - first, width, 3), dtype=np.float32)
    for channel in range(3):
        x, y = display.subpixel_point(u, v, channel, NUMPY)
        place_x, place_y = _place_in_view(quilt, display, x, y)
        number, share = _views(view_fraction(display, x, y), quilt.layout.views, choice)
        colors = _sampled(quilt, channel, number, place_x, place_y)
        if choice == "linear":
            following = np.minimum(number + 1, quilt.layout.views - 1)
            colors += share * (_sampled(quilt, channel, following, place_x, place_y) - colors)
        woven[..., channel] = colors
    return woven


def view_fraction(display: Display, x: Real, y: Real) -> Real:
    """Which view a panel point (mm) of a lenticular display shows: 0 the leftmost edge of the cone, 1 the rightmost."""
    lattice, scale = display.lattice, display.magnification
    i, _ = display.lens_of(x, y, NUMPY)
    axis = (lattice.origin_x + i * lattice.pitch) * scale
    place = (lattice.across(x, y) - axis) / (lattice.pitch * scale)
    fraction: Real = np.clip(0.5 - place, 0.0, 1.0)
    return fraction


def _check(quilt: Quilt, display: Display, choice: str) -> None:
    if choice not in get_args(ViewChoice):
        raise UsageError(f"the choice {choice!r} is not known", rule=f"known are {', '.join(get_args(ViewChoice))}")
    _check_fit(quilt, display)


def _check_fit(quilt: Quilt, display: Display) -> None:
    if display.lens_array.layout != "lenticular":
        rule = "a quilt's views lie side by side, for cylindrical lenses"
        raise PictureError(f"the display {display.name} has {display.lens_array.layout} lenses", rule=rule)
    shape = display.panel.width / display.panel.height
    aspect = quilt.layout.aspect
    if aspect is not None and abs(aspect / shape - 1) > _ASPECT_TOLERANCE:
        rule = f"the display {display.name} has {shape:.6g}"
        raise PictureError(f"the quilt's picture has the aspect {aspect:.6g}", rule=rule, fix="take its own display")


def _views(fraction: Real, count: int, choice: ViewChoice) -> tuple[NDArray[np.intp], Real]:
    """The view to take and the share of the next one."""
    if choice == "nearest":
        return np.minimum((fraction * count).astype(np.intp), count - 1), np.zeros_like(fraction)
    # View i is right in the middle of its part of the cone.
    position = np.clip(fraction * count - 0.5, 0.0, count - 1.0)
    number = position.astype(np.intp)
    return number, position - number


def _place_in_view(quilt: Quilt, display: Display, x: Real, y: Real) -> tuple[Real, Real]:
    """Pixel coordinates in a view, 0 at the middle of its first pixel, of what the panel points show."""
    lens = display.lens_of(x, y, NUMPY)
    lens_x, lens_y = display.lens_center(*lens, x, y, NUMPY)
    width, height = quilt.view_size
    panel_width, panel_height = display.size_mm
    across = (lens_x / panel_width + 0.5) * width - 0.5
    down = (0.5 - lens_y / panel_height) * height - 0.5
    return np.clip(across, 0.0, width - 1.0), np.clip(down, 0.0, height - 1.0)


def _sampled(quilt: Quilt, channel: int, number: NDArray[np.intp], across: Real, down: Real) -> Real:
    """Values of views at places in them, interpolated between their pixels; never from a neighbouring tile."""
    width, height = quilt.view_size
    left, top = across.astype(np.intp), down.astype(np.intp)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    column, row = quilt.corner(number)
    values = quilt.pixels[..., channel]
    part_x, part_y = across - left, down - top
    upper = values[row + top, column + left] * (1 - part_x) + values[row + top, column + right] * part_x
    lower = values[row + bottom, column + left] * (1 - part_x) + values[row + bottom, column + right] * part_x
    mixed: Real = upper * (1 - part_y) + lower * part_y
    return mixed
