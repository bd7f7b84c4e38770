"""Weaving: the native picture of a lenticular display from the views of a quilt.

A sub-pixel at the right edge of its lens is seen from the left, so it shows view 0, that of the leftmost camera; one at
the left edge shows the last view. The view is linear in the position under the lens, which is linear in the tangent of
the direction. Within the view, the colour is that of the point at which the sub-pixel's light line meets the lens
plane: a view shows the panel's rectangle in the lens plane, as an off-axis camera focused there sees it. Of a print it
shows the trim; the bleed repeats the views' edges.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann._version import VERSION
from lippmann.calibration.finish import NO_FINISH, Finish
from lippmann.display import NUMPY, Display
from lippmann.display.sheet_layout import trim_of
from lippmann.errors import PictureError, UsageError
from lippmann.image import IntegralImage, Provenance
from lippmann.image.metadata import Metadata
from lippmann.image.stored_values import FloatArray
from lippmann.image.write import write_rows
from lippmann.options.choices import Correction
from lippmann.options.correction import check_correction
from lippmann.options.option import checked
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.quilts.quilt import Quilt
from lippmann.runtime.engine_lock import cached_property

if TYPE_CHECKING:
    from lippmann.optics.correction import CorrectionStep, LensCorrection

Real = NDArray[np.float64]
ViewChoice = Literal["nearest", "linear"]

#: Pixels per block, with some 50 arrays of this length; and pixels of the views that are made linear for a block.
_BLOCK, _VIEW_BLOCK = 1 << 18, 1 << 24

#: Tolerance of aspect ratios: relative error that rounding in names and panel sizes causes.
ASPECT_TOLERANCE = 0.02


@checked
def weave(
    quilt: Quilt,
    display: Display,
    *,
    choice: ViewChoice | None = None,
    correct: Correction = "none",
    headroom: float = 0.0,
    scene: str = "",
    progress: ProgressCallback = silent,
) -> IntegralImage:
    """Native picture that shows the views of a quilt on a display.

    Parameters
    ----------
    quilt:
        The views, that of the leftmost camera first.
    display:
        A lenticular display, slanted or not.
    choice:
        ``nearest`` takes the view nearest to a sub-pixel's direction; ``linear`` interpolates between the two nearest
        views. Within a view, colours are interpolated between pixels in either case. None: :func:`usual_choice`.
    correct:
        ``lens``: the pixels whose light through the display's real lenses comes nearest to the views.
    headroom:
        How far above black and below white a corrected picture's light is to keep, as a share of white: 0 to 0.25.
    scene:
        Name of the scene, for the provenance.
    progress:
        Called after every block of rows.

    Raises
    ------
    UsageError
        If the choice or the correction is unknown, or the headroom out of range or without a correction.
    PictureError
        If the display is not lenticular, or the quilt has another aspect ratio than its panel.

    Examples
    --------
    >>> import numpy as np
    >>> from lippmann.quilts.quilt import Quilt, QuiltLayout
    >>> from lippmann.quilts.weave import weave
    >>> small = lippmann.load_display("seed-lenticular").resized(16, 8)
    >>> weave(Quilt(np.zeros((20, 120, 3), np.float32), QuiltLayout(3, 1, 2.0)), small).pixels.shape
    (8, 16, 3)
    """
    choice = choice or usual_choice(quilt)
    check_weave(quilt, display, choice)
    weaving = Weaving(quilt, display, choice, correct, headroom)
    options, notes = weaving.describe_correction()
    width, height = display.panel.width, display.panel.height
    pixels = np.empty((height, width, 3), dtype=np.float32)
    step = _rows_at_a_time(quilt, display)
    for first in range(0, height, step):
        last = min(first + step, height)
        pixels[first:last] = weaving.rows(first, last)
        progress(Progress("weave", last, height))
    return IntegralImage(pixels, display, provenance=weave_provenance(quilt, choice, scene, options, notes))


@checked
def weave_to_file(
    quilt: Quilt,
    display: Display,
    path: Path,
    *,
    choice: ViewChoice | None = None,
    correct: Correction = "none",
    headroom: float = 0.0,
    scene: str = "",
    bits: int | None = None,
    finish: Finish = NO_FINISH,
    progress: ProgressCallback = silent,
) -> tuple[str, ...]:
    """Write the native picture that shows the views of a quilt, in memory that does not grow with the panel.

    Parameters
    ----------
    quilt, display, choice, correct, headroom, scene, progress:
        As for :func:`weave`, with its errors.
    path:
        The TIFF or Zarr file.
    bits:
        Bits per value; None for the format's default.
    finish:
        What is done to the picture for its print.

    Returns
    -------
    What is to be said of the picture, in lines.

    Raises
    ------
    OutputError
        If the format is not TIFF or Zarr or has no such bits, or the file cannot be written.
    """
    choice = choice or usual_choice(quilt)
    check_weave(quilt, display, choice)
    weaving = Weaving(quilt, display, choice, correct, headroom)
    options, notes = weaving.describe_correction()
    step = _rows_at_a_time(quilt, display)

    def rows(first: int, last: int) -> FloatArray:
        band = np.empty((last - first, display.panel.width, 3), dtype=np.float32)
        for start in range(first, last, step):
            stop = min(start + step, last)
            band[start - first : stop - first] = weaving.rows(start, stop)
            progress(Progress("weave", stop, display.panel.height))
        return band

    metadata = Metadata(finish.display(display), np.eye(4), weave_provenance(quilt, choice, scene, options, notes))
    write_rows(finish.rows(rows, display), metadata, path, bits=bits, icc=finish.icc)
    return notes


@dataclass(frozen=True)
class Weaving:
    """How a picture is woven: rows of it, corrected for the display's lenses or not.

    Parameters are those of :func:`weave`.
    """

    quilt: Quilt
    display: Display
    choice: ViewChoice
    correct: Correction = "none"
    headroom: float = 0.0

    def __post_init__(self) -> None:
        check_correction(self.correct, self.headroom)

    def rows(self, first: int, last: int) -> FloatArray:
        """Rows ``first`` to before ``last``, ``(rows, width, 3)`` float32 linear RGB."""
        if self._correction is None:
            return weave_window(self.quilt, self.display, self.choice, (first, last))
        correction, step = self._correction
        start, stop = max(0, first - correction.margin), min(self.display.panel.height, last + correction.margin)
        return correction.rows(self._parts(start, stop), start, step.share)[first - start : last - start]

    def describe_correction(self) -> tuple[dict[str, object], tuple[str, ...]]:
        """Metadata of the correction, and lines for people."""
        if self._correction is None:
            return {}, ()
        from lippmann.optics.correction import judged_rows

        bands = [self.rows(rows.start, rows.stop) for rows in judged_rows(self.display.panel.height)]
        pixels = np.concatenate(bands)
        options, note = self._correction[1].describe(float(np.mean((pixels <= 0.0) | (pixels >= 1.0))))
        return options, (note,)

    def _parts(self, first: int, last: int) -> list[FloatArray]:
        from lippmann.optics.correction import parts_beside

        return [
            weave_window(self.quilt, self.display, self.choice, (first, last), None, beside)
            for beside in parts_beside()
        ]

    @property
    def _has_subpixels(self) -> bool:
        return len(set(self.display.panel.subpixel_offsets)) > 1

    @cached_property
    def _correction(self) -> tuple[LensCorrection, CorrectionStep] | None:
        if self.correct == "none":
            return None
        from lippmann.optics.correction import LensCorrection, judged_rows

        correction = LensCorrection(self.display, self._has_subpixels, self.headroom)
        bands = judged_rows(self.display.panel.height)
        return correction, correction.step([(rows.start, [self._parts(rows.start, rows.stop)]) for rows in bands])


def weave_provenance(
    quilt: Quilt,
    choice: ViewChoice,
    scene: str,
    correction: Mapping[str, object] | None = None,
    notes: tuple[str, ...] = (),
) -> Provenance:
    """Provenance of a woven picture."""
    options = {
        "views": quilt.layout.views,
        "view_choice": choice,
        "direction": "even in the tangent",
        **(correction or {}),
    }
    return Provenance(method="weave", subpixels=True, scene=scene, version=VERSION, options=options, notes=notes)


def _rows_at_a_time(quilt: Quilt, display: Display) -> int:
    width, height = quilt.size
    return max(1, min(_BLOCK // display.panel.width, _VIEW_BLOCK * display.panel.height // (width * height)))


def weave_window(
    quilt: Quilt,
    display: Display,
    choice: ViewChoice,
    rows: tuple[int, int],
    columns: tuple[int, int] | None = None,
    beside: float = 0.0,
) -> FloatArray:
    """A window of the woven picture.

    Parameters
    ----------
    quilt, display, choice:
        As for :func:`weave`, by which they are checked.
    rows, columns:
        First and past-the-last row and column of the window, within the panel. None: all columns.
    beside:
        Pixels to the right of each (sub-)pixel's middle at which the views are sampled.

    Returns
    -------
    ``(rows, columns, 3)`` float32 linear RGB.
    """
    from lippmann.quilts.weave_kernel import weave_channel

    columns = columns or (0, display.panel.width)
    result = np.empty((rows[1] - rows[0], columns[1] - columns[0], 3), dtype=np.float32)
    channels = _samples_of_window(quilt, display, choice, rows, columns, beside)
    # Only this part of the views is sampled.
    top, left = (min(int(samples[axis].min()) for samples in channels) for axis in (3, 2))
    bottom, right = (max(int(samples[axis].max()) for samples in channels) + 2 for axis in (3, 2))
    width, height = quilt.view_size
    views = quilt.view_rows(top, min(bottom, height), left, min(right, width))
    for channel, (number, share, across, down) in enumerate(channels):
        weave_channel(views, channel, number, share, across - left, down - top, result)
    return result


class _Samples(NamedTuple):
    """Samples of the views that sub-pixels show, as arrays that broadcast to the pixels.

    ``number`` is a view and ``share`` the weight of the next one; ``across`` and ``down`` are the position in them, in
    pixels from the centre of the first pixel.
    """

    number: NDArray[np.intp]
    share: Real
    across: Real
    down: Real


def _samples_of_window(
    quilt: Quilt,
    display: Display,
    choice: ViewChoice,
    rows: tuple[int, int],
    columns: tuple[int, int],
    beside: float = 0.0,
) -> list[_Samples]:
    """Samples of the sub-pixels of a window, by channel."""
    panel = display.panel
    u: Real = np.arange(*columns, dtype=np.float64)[None] + (0.5 + beside)
    v: Real = np.arange(*rows, dtype=np.float64)[:, None] + 0.5
    channels: list[_Samples] = []
    for channel in range(3):
        offset, before = panel.subpixel_offsets[channel], panel.subpixel_offsets[:channel]
        if panel.subpixel_cells is None and offset in before:
            channels.append(channels[before.index(offset)])
        elif panel.subpixel_cells is None and display.lattice.rows_are_alike:
            # All columns have the same heights as well.
            column = _samples_at(quilt, display, choice, channel, u[:, :1], v)
            channels.append(_samples_at(quilt, display, choice, channel, u, v[:1])._replace(down=column.down))
        else:
            channels.append(_samples_at(quilt, display, choice, channel, *np.meshgrid(u, v)))
    return channels


def _samples_at(quilt: Quilt, display: Display, choice: ViewChoice, channel: int, u: Real, v: Real) -> _Samples:
    x, y = display.subpixel_point(u, v, channel, NUMPY)
    number, share = _views(view_fraction(display, x, y), quilt.layout.views, choice)
    lens_x, lens_y = display.lens_center(*display.lens_of(x, y), x, y)
    return _Samples(number, share, *position_in_view(quilt, display, lens_x, lens_y))


def view_fraction(display: Display, x: Real, y: Real) -> Real:
    """View that a panel point (mm) of a lenticular display shows: 0 at the left edge of the view cone, 1 at the
    right."""
    lattice, scale = display.lattice, display.magnification
    i, _ = display.lens_of(x, y, NUMPY)
    axis = (lattice.origin_x + i * lattice.pitch) * scale
    place = display.pinhole_place(lattice.across(x, y) - axis) / (lattice.pitch * scale * display.edge_factor)
    fraction: Real = np.clip(0.5 - place, 0.0, 1.0)
    return fraction


def usual_choice(quilt: Quilt) -> ViewChoice:
    """How views are chosen unless said: of a stereo pair the nearest, since both eyes would see a mixture double."""
    return "nearest" if quilt.layout.views == 2 else "linear"


def check_weave(quilt: Quilt, display: Display, choice: str) -> None:
    """Raise the errors of :func:`weave`."""
    if choice not in get_args(ViewChoice):
        raise UsageError.unknown("choice of views", choice, get_args(ViewChoice), parameter="views")
    check_weavable(display)
    _check_fit(quilt, display)


def check_weavable(display: Display) -> None:
    """Refuse a display that takes no native pixels, or whose lenses do not show the views of a quilt."""
    display.check_native()
    if display.lens_array.layout != "lenticular":
        rule = "a quilt needs cylindrical lenses"
        raise PictureError(f"the display {display.name} has {display.lens_array.layout} lenses", rule=rule)


def _check_fit(quilt: Quilt, display: Display) -> None:
    trim = trim_of(display)
    shape = trim.width / trim.height
    aspect = quilt.layout.aspect
    if aspect is not None and abs(aspect / shape - 1) > ASPECT_TOLERANCE:
        rule = f"the display {display.name} has {shape:.6g}"
        raise PictureError(
            f"the quilt has the aspect {aspect:.6g}", rule=rule, fix='use its display, or weave it with fit="cover"'
        )


def _views(fraction: Real, count: int, choice: ViewChoice) -> tuple[NDArray[np.intp], Real]:
    """The view and the weight of the next one."""
    if choice == "nearest":
        return np.minimum((fraction * count).astype(np.intp), count - 1), np.zeros_like(fraction)
    # View i is exact at the centre of its part of the cone.
    position = np.clip(fraction * count - 0.5, 0.0, count - 1.0)
    number = position.astype(np.intp)
    return number, position - number


def position_in_view(quilt: Quilt, display: Display, x: Real, y: Real) -> tuple[Real, Real]:
    """Pixel coordinates in a view, 0 at the centre of its first pixel, of points of the lens plane (mm)."""
    width, height = quilt.view_size
    trim, pixel = trim_of(display), display.panel.pixel_pitch
    across = (x / (trim.width * pixel) + 0.5) * width - 0.5
    down = (0.5 - y / (trim.height * pixel)) * height - 0.5
    return np.clip(across, 0.0, width - 1.0), np.clip(down, 0.0, height - 1.0)
