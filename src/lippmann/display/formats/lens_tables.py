"""The tables ``[lens]`` and ``[pixel]`` of a display file.

::

    [lens]
    thickness = "26 mil"           # from the top of the crest to the panel; must be given
    index = 1.57
    radius = "0.266 mm"            # of the crest; or
    field = 54                     # the viewing angle in degrees that its maker states; neither: best focus
    conic = 0
    diameter = "0.4 mm"            # where the sheet is flat between its lenses

    [pixel]
    width = "0.33 px"              # of a sub-pixel; lengths may be pixels
    height = "1 px"
    black_matrix = "0.05 px"       # dark line between neighbours
    blur = "12 um"                 # of ink: standard deviation

A lens gives the gap, so that a file has one of both.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, replace

from lippmann.display.display import Display
from lippmann.display.formats.monitor_toml import TABLE as MONITOR
from lippmann.display.formats.monitor_toml import monitor_of_tables
from lippmann.display.lens_array import LensArray
from lippmann.display.lens_profile import LensProfile, length_rule
from lippmann.display.pixel_aperture import PixelAperture
from lippmann.display.validation import INCH, LENGTH, MILLIMETRES, Arguments, check_keys, length, table_of
from lippmann.errors import DisplayError

_LENS_KEYS = ("thickness", "index", "radius", "field", "conic", "diameter")
_LENS_LENGTHS = ("thickness", "radius", "diameter")
_PIXEL_LENGTHS = ("width", "height", "black_matrix", "blur")


def monitor_display(values: Arguments) -> Display:
    """The display of a file with the table ``[monitor]``; ``[lens]`` takes the place of its view cone."""
    from lippmann.optics.directions import distortion_of
    from lippmann.optics.fitting import profile_behind

    values = dict(values)
    lens, pixel = values.pop("lens", None), values.pop("pixel", None)
    monitor = monitor_of_tables(values)
    if lens is not None:
        if "view_cone" in values[MONITOR]:
            rule = "a lens gives its view cone"
            raise DisplayError("view_cone and lens are both given", where=f"{MONITOR}.view_cone", rule=rule)
        apparent, slant = INCH / monitor.pitch, math.atan(1.0 / monitor.slope)
        profile, _, gap = profile_behind(
            lambda pitch: profile_of_table(lens, LensArray("lenticular", pitch)), apparent, monitor.viewing_distance
        )
        cone = math.degrees(2.0 * math.atan(0.5 * apparent / (gap * math.cos(slant))))
        monitor = replace(monitor, view_cone=cone)
    display = monitor.display()
    if lens is not None:
        distortion = distortion_of(profile, display.lens_array, display.gap)
        display = replace(display, lens=profile, distortion=distortion)
    return display if pixel is None else replace(display, pixel=aperture_of_table(pixel, display.panel.pixel_pitch))


def with_profile(values: Arguments) -> Arguments:
    """The values of a display in millimetres, with the profile and the gap of its table ``[lens]``."""
    from lippmann.optics.directions import distortion_of
    from lippmann.optics.fitting import gap_of

    if "gap" in values:
        rule = "a lens gives its gap"
        raise DisplayError("gap and lens are both given", where="gap", rule=rule, fix="leave one out")
    lenses = LensArray(**values["lens_array"])
    profile = profile_of_table(values["lens"], lenses)
    gap = gap_of(profile, lenses)
    distortion = distortion_of(profile, lenses, gap)
    return {**values, "gap": gap, "lens": asdict(profile), "distortion": asdict(distortion)}


def profile_of_table(table: object, lenses: LensArray) -> LensProfile:
    """The profile of a table ``[lens]`` in front of these lenses."""
    from lippmann.optics.fitting import fit_profile

    stated = table_of(table, "lens", _LENS_KEYS, ["thickness"])
    return fit_profile(lenses, **_in_millimetres(stated, _LENS_LENGTHS, "lens", MILLIMETRES))


def aperture_of_table(table: object, pixel_pitch: float) -> PixelAperture:
    """The aperture of a table ``[pixel]`` on a panel of such pixels."""
    stated = check_keys(table, PixelAperture, "pixel")
    return PixelAperture(**_in_millimetres(stated, _PIXEL_LENGTHS, "pixel", {**MILLIMETRES, "px": pixel_pitch}))


def _in_millimetres(table: Arguments, lengths: tuple[str, ...], name: str, scales: Mapping[str, float]) -> Arguments:
    return {
        key: length(value, f"{name}.{key}", scales, rule=length_rule(key, LENGTH))
        if key in lengths and isinstance(value, str)
        else value
        for key, value in table.items()
    }
