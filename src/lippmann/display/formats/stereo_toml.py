"""Eye-tracked monitors as display files: the table ``[stereo]`` in place of ``[panel]`` and ``[lens_array]``.

::

    title = "A 27-inch monitor"

    [stereo]
    width = 3840
    height = 2160
    diagonal = "27 in"
    viewing_distance = "60 cm"
    eyes = 63                        # millimetres
    layout = "half"                  # or "full"

The monitor's own software weaves the two eyes' pictures. It counts as the sheet that shows either eye one of two pixels
under each of its upright lenses: a micro-image is two pixels wide, and the gap ``pixel_pitch * D / eyes`` sends
neighbouring pixels to places one eye distance apart, at the viewing distance D.
"""

from __future__ import annotations

import math

from lippmann.display.display import Display
from lippmann.display.lens_array import LensArray
from lippmann.display.panel import RGB_STRIPE, Panel
from lippmann.display.stereo import EYE_DISTANCE, StereoPair
from lippmann.display.validation import (
    Arguments,
    Table,
    millimetres,
    positive,
    refuse_unknown,
    table_of,
    whole_count,
)
from lippmann.errors import DisplayError

#: The table's name.
TABLE = "stereo"

_NEEDED = ("width", "height", "diagonal", "viewing_distance")
_KEYS = (*_NEEDED, "eyes", "layout")

#: Nearest and farthest viewing distance, mm: from a phone in the hand to beyond a desk. From much farther any depth is
#: comfortable, and there is no budget to fill.
_DISTANCES = 150.0, 1500.0

#: Share of the viewing distance at which recorded rays begin. What lies nearer than half way cannot be fused.
_APERTURE = 0.5


def stereo_display(values: Table) -> Display:
    """The display of a file's values: ``name``, ``title`` and the table ``stereo``.

    Raises
    ------
    DisplayError
        If a key is missing or unknown, or a value is out of its range; ``where`` is the dotted key.
    """
    refuse_unknown(values, ("name", "title", TABLE))
    return _display(values, table_of(values[TABLE], TABLE, _KEYS, _NEEDED))


def _display(values: Arguments, table: Arguments) -> Display:
    columns, rows = (whole_count(table[key], f"{TABLE}.{key}") for key in ("width", "height"))
    diagonal = _length(table["diagonal"], "diagonal")
    distance = _length(table["viewing_distance"], "viewing_distance")
    least, most = _DISTANCES
    if not least <= distance <= most:
        rule = f"it must be {least:g} to {most:g} mm"
        raise DisplayError(f"viewing_distance is {distance:g} mm", where=f"{TABLE}.viewing_distance", rule=rule)
    pair = StereoPair(table.get("eyes", EYE_DISTANCE), table.get("layout", "half"))
    pitch = diagonal / math.hypot(columns, rows)
    gap = pitch * distance / pair.eyes
    return Display(
        values["name"],
        Panel(columns, rows, pitch, RGB_STRIPE),
        LensArray("lenticular", 2.0 * pitch * distance / (distance + gap)),
        gap,
        title=values.get("title", ""),
        viewing_distance=distance,
        aperture_distance=_APERTURE * distance,
        stereo=pair,
    )


def _length(value: object, key: str) -> float:
    return positive(millimetres(value, f"{TABLE}.{key}"), f"{TABLE}.{key}")
