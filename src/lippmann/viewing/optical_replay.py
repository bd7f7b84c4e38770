"""Replay through the lenses that are really there: what an eye sees of a panel, with crosstalk, blur, strips and moire.

Each lens sends an eye light of several sub-pixels, of its neighbours' too: their weights are those of
:mod:`lippmann.optics.eye_light`. A lens has one colour across, a cylinder shows each row of pixels along it.
"""

from __future__ import annotations

import math

import numpy as np

from lippmann.display import NUMPY, Display
from lippmann.errors import UsageError
from lippmann.image.integral_image import Picture
from lippmann.image.stored_values import FloatArray
from lippmann.optics.eye_light import EyeLight, eye_light, panel_frame
from lippmann.options.option import checked
from lippmann.runtime.machine import usable_cores
from lippmann.runtime.row_threads import Bands
from lippmann.viewing.replay import Eye, Real, check_size, default_size, eye_before

#: Diameter of an eye's pupil in mm, indoors.
PUPIL = 4.0

#: Points of the picture that are gathered together.
_BLOCK = 1 << 18


@checked
def replay_optics(
    image: Picture, eye: Eye | None = None, *, size: tuple[int, int] | None = None, pupil: float = PUPIL
) -> FloatArray:
    """Picture that an eye really sees through the lenses of a display.

    Parameters
    ----------
    image, eye, size:
        As of :func:`lippmann.viewing.replay.replay`. Sub-pixels have the places that they have on the panel.
    pupil:
        Diameter of the eye's pupil in mm, 0 to 20.

    Returns
    -------
    ``(height, width, 3)`` float32 linear RGB, 1 for an even white panel straight ahead.

    Raises
    ------
    UsageError
        The eye is not in front of the lens plane, or a number is out of range.
    """
    display = image.display
    eye = eye_before(display, eye)
    width, height = check_size(default_size(display) if size is None else size)
    if not 0.0 <= pupil <= 20.0:
        raise UsageError(f"{pupil:g} mm", parameter="pupil", rule="a pupil is 0 to 20 mm wide")
    light = _light_of(display, eye, pupil)
    # A point of the picture shows one lens, so there are at least as many points as lenses.
    lattice, panel = display.lattice, display.panel
    finer_x = math.ceil(panel.size_mm[0] / width / lattice.pitch - 1e-9)
    finer_y = 1 if lattice.layout == "lenticular" else math.ceil(panel.size_mm[1] / height / lattice.row_pitch - 1e-9)
    finer_x, finer_y = max(1, finer_x), max(1, finer_y)
    picture = np.empty((height, width, 3), dtype=np.float32)
    lines = max(1, _BLOCK // (width * finer_x * finer_y))
    for first in range(0, height, lines):
        last = min(first + lines, height)
        fine = _gather(image, light, eye, (width * finer_x, height * finer_y), slice(first * finer_y, last * finer_y))
        picture[first:last] = fine.reshape(last - first, finer_y, width, finer_x, 3).mean(axis=(1, 3))
    return picture


def _light_of(display: Display, eye: Eye, pupil: float) -> EyeLight:
    """The light of all directions in which the eye stands over the display's corners."""
    half_x, half_y = (0.5 * side + display.lens_array.pitch for side in display.size_mm)
    corners = np.array([(x, y) for x in (-half_x, half_x) for y in (-half_y, half_y)])
    x, y = slopes_to_eye(display, eye, corners[:, 0], corners[:, 1])
    spans = [(float(each.min()), float(each.max())) for each in (x, y)]
    return eye_light(display, spans[0], spans[1], pupil / eye[2])


def slopes_to_eye(display: Display, eye: Eye, x: Real, y: Real) -> tuple[Real, Real]:
    """Slopes across and along the lenses of the directions from points of the lens plane to the eye."""
    right, up = (eye[0] - x) / eye[2], (eye[1] - y) / eye[2]
    if display.lens_array.layout != "lenticular":
        return right, up
    return display.lattice.across(right, up), display.lattice.along(right, up)


def _gather(image: Picture, light: EyeLight, eye: Eye, size: tuple[int, int], rows: slice) -> FloatArray:
    """Rows of a picture of ``size`` (width, height), each point of which shows one lens."""
    from lippmann.optics.eye_light_kernel import gather_light

    display, panel = image.display, image.display.panel
    lattice, is_line = display.lattice, display.lens_array.layout == "lenticular"
    u = (np.arange(size[0]) + 0.5) * (panel.width / size[0])
    v = (np.arange(rows.start, rows.stop) + 0.5) * (panel.height / size[1])
    x, y = display.panel_point(*np.meshgrid(u, v))
    center_x, center_y = lattice.center(*lattice.lens_at(x, y, NUMPY), x, y, NUMPY)
    slope_x, slope_y = slopes_to_eye(display, eye, center_x, center_y)
    number, place = light.nearest(slope_x, slope_y)
    lines = np.empty((0, 0, 2))
    if is_line:
        place[..., 0] += lattice.across(center_x, center_y)
        _, middle = display.pixel_coordinates(*display.visible_panel_point(*eye, x, y, NUMPY))
        half = 0.5 * max(1.0, panel.height / size[1])
        lines = np.stack([middle - half, middle + half], axis=-1)
        first, last = float(lines.min()), float(lines.max())
    else:
        place += np.stack([center_x, center_y], axis=-1)
        middle = 0.5 * panel.height - place[..., 1] / panel.pixel_pitch
        reach = 0.5 * light.weights.shape[2] * light.step / panel.pixel_pitch + 2.0
        first, last = float(middle.min()) - reach, float(middle.max()) + reach
    top, bottom = (min(max(0, each), panel.height) for each in (math.floor(first), math.ceil(last)))
    out = np.zeros((*x.shape, 3), dtype=np.float32)
    if top < bottom:
        tables = light.weights.reshape(-1, *light.weights.shape[2:])
        cells = np.array(panel.cells, dtype=np.float64)
        values = np.ascontiguousarray(image.rows(top, bottom), dtype=np.float32)
        gathering = values[..., None], top, panel_frame(display), cells, tables, light.step, number, place, lines
        Bands(usable_cores()).lines(gather_light, len(v), *gathering, out[..., None])
    return out
