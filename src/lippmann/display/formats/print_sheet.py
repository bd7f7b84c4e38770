"""A print behind a lenticular sheet as a display.

The sheet has ``lpi`` lenses per inch. Seen from a distance D the micro-images of the print, which lie a gap g behind
the lens centres, must be a little wider than the lenses, p (D + g) / D: the print pitch, in lenses per inch
``lpi D / (D + g)``. Sheets differ from their nominal number by more than that, so a pitch test is printed: the strip
that stands still from D is labelled with the print pitch itself.

The gap is the air-equivalent depth of the lenses. A ray through the middle of a lens is broken at its surface; for
small angles the print seems to lie at thickness / index. Makers state either the thickness or the field of view F, the
angle from one flip of the picture to the next: tan(F / 2) = p (D + g) / (2 D g).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

from lippmann.display import units
from lippmann.display.display import INFINITE, Display
from lippmann.display.formats.recorded_depth import default_aperture
from lippmann.display.lens_array import LensArray
from lippmann.display.panel import Panel
from lippmann.display.sheet import Sheet
from lippmann.display.validation import MAXIMUM_COUNT, finite, number, refuse_unknown
from lippmann.errors import DisplayError

#: Keys of the short form of a print.
KEYS = ("lpi", "print-lpi", "ppi", "size", "viewing-distance", "thickness", "index", "field")

_NUMBERS = ("lpi", "print-lpi", "ppi", "index", "field")

#: Lenses and pixels per inch, far beyond any that are made.
_LPI = (1.0, 1000.0)
_PPI = (10.0, 20_000.0)

_INDICES = (1.0, 3.0)
_FIELDS = (5.0, 150.0)

#: A refractive index of the plastics that sheets are made of: PETG and APET have about 1.57, acrylic has 1.49.
DEFAULT_INDEX = 1.57

#: Degrees; makers state some 25 (for depth) to 60 (for flips).
DEFAULT_FIELD = 54.0

#: Viewing distance of a print held in the hand, mm.
DEFAULT_DISTANCE = 500.0

#: Shortest viewing distance, mm.
_NEAREST = 10.0


@dataclass(frozen=True)
class Print:
    """A print of square pixels behind a sheet of upright cylindrical lenses.

    Parameters
    ----------
    ppi:
        Pixels per inch of the print, 10 to 20 000.
    size:
        Width and height in millimetres; the print has the whole number of pixels next to it.
    lpi:
        Lenses per inch of the sheet itself, 1 to 1000; or None, if ``print_lpi`` is given.
    print_lpi:
        The print pitch in lenses per inch, as a pitch test found it at the viewing distance.
    viewing_distance:
        Millimetres from the sheet to the eye, at least 10; ``math.inf`` is allowed.
    thickness, index:
        Of the sheet, in millimetres, and its refractive index, 1 to 3.
    field:
        Angle in degrees from one flip of the picture to the next, 5 to 150; instead of a thickness. With neither it is
        54 degrees.

    Raises
    ------
    DisplayError
        If a value is out of range, or two say the same; ``where`` names it.
    """

    ppi: float
    size: tuple[float, float]
    lpi: float | None = None
    print_lpi: float | None = None
    viewing_distance: float = DEFAULT_DISTANCE
    thickness: float | None = None
    index: float | None = None
    field: float | None = None

    def __post_init__(self) -> None:
        self._check_choices()
        _check(self._stated_lpi, "lpi" if self.print_lpi is None else "print_lpi", _LPI, "lenses per inch")
        _check(self.ppi, "ppi", _PPI, "pixels per inch")
        rule = f"it must be a length of at least {_NEAREST:g} mm, or infinite"
        if number(self.viewing_distance, "viewing_distance", rule=rule) < _NEAREST:
            raise DisplayError(f"viewing_distance is {self.viewing_distance:g} mm", where="viewing_distance", rule=rule)
        if self.field is not None:
            _check(self.field, "field", _FIELDS, "degrees")
        if self.index is not None:
            _check(self.index, "index", _INDICES, "")
        if self.thickness is not None:
            self._check_thickness(self.thickness)
        elif 4 * self._parallel_gap > self.viewing_distance:
            rule = f"lenses of {self._stated_lpi:g} lpi and this field are {self._parallel_gap:.3g} mm deep"
            what, fix = f"viewing_distance is {self.viewing_distance:g} mm", "look from farther away"
            raise DisplayError(what, where="viewing_distance", rule=rule, fix=fix)
        for side in self.size:
            self._check_side(side)
        self._check_pixels_per_lens()

    def _check_choices(self) -> None:
        if self.lpi is None and self.print_lpi is None:
            rule = "the lenses per inch of the sheet, or print_lpi as a pitch test found it, must be given"
            raise DisplayError("lpi is missing", where="lpi", rule=rule)
        pairs = (("print_lpi", "lpi", "a pitch test's print_lpi takes its place"), ("thickness", "field", ""))
        for one, other, rule in pairs:
            if getattr(self, one) is not None and getattr(self, other) is not None:
                rule = rule or "the thickness of a sheet gives its field of view"
                raise DisplayError(f"{one} and {other} are both given", where=one, rule=rule, fix="leave one out")
        if self.index is not None and self.thickness is None:
            raise DisplayError("index is given without a thickness", where="index", rule="it means nothing alone")

    def _check_thickness(self, thickness: float) -> None:
        field = 0.0
        if finite(thickness, "thickness") > 0:
            field = math.degrees(2 * math.atan(units.INCH / self._stated_lpi / 2 / self.gap))
        if not _FIELDS[0] <= field <= _FIELDS[1]:
            rule = f"such lenses must have a field of view of {_FIELDS[0]:g} to {_FIELDS[1]:g} degrees"
            fix = "look at its unit"
            raise DisplayError(f"thickness is {thickness:g} mm", where="thickness", rule=rule, fix=fix)

    def _check_side(self, side: object) -> None:
        length = finite(side, "size")
        pixels = length * self.ppi / units.INCH
        if not 0.5 < pixels < MAXIMUM_COUNT + 0.5:
            rule = f"at {self.ppi:g} pixels per inch it must be 1 to {MAXIMUM_COUNT} pixels"
            raise DisplayError(f"a side of {length:g} mm is {pixels:.6g} pixels", where="size", rule=rule)

    def _check_pixels_per_lens(self) -> None:
        count = self.ppi / self.pitch_on_print
        if count < 2:
            rule, fix = "two are the least that show two views", "print finer, or take wider lenses"
            raise DisplayError(f"a lens covers {count:.4g} pixels", where="ppi", rule=rule, fix=fix)
        width = self.pixels[0]
        if count > width:
            raise DisplayError(f"a lens covers {count:.6g} pixels", where="size", rule=f"the print has only {width}")

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height in pixels."""
        width, height = (round(side * self.ppi / units.INCH) for side in self.size)
        return width, height

    @property
    def gap(self) -> float:
        """Air-equivalent distance from the print to the lens centres in millimetres."""
        if self.thickness is not None:
            return self.thickness / (DEFAULT_INDEX if self.index is None else self.index)
        if self.lpi is None:
            return self._parallel_gap
        # The field is that of the micro-images, which are wider than the lenses.
        return self._parallel_gap / (1 - self._parallel_gap / self.viewing_distance)

    @property
    def pitch_on_print(self) -> float:
        """The print pitch: micro-images per inch, ``lpi D / (D + g)`` where it was not measured."""
        return self._stated_lpi if self.lpi is None else self.lpi / (1 + self.gap / self.viewing_distance)

    @property
    def pitch_of_sheet(self) -> float:
        """Lenses per inch of the sheet."""
        return self._stated_lpi * (1 + self.gap / self.viewing_distance) if self.lpi is None else self.lpi

    @property
    def _stated_lpi(self) -> float:
        return cast(float, self.print_lpi if self.lpi is None else self.lpi)

    @property
    def _parallel_gap(self) -> float:
        """The gap for an infinite viewing distance: micro-images as far apart as the stated lenses per inch."""
        field = DEFAULT_FIELD if self.field is None else self.field
        return units.INCH / self._stated_lpi / (2 * math.tan(math.radians(field) / 2))

    def display(self) -> Display:
        """The print and its sheet as a display, aligned as :class:`Display` aligns lenses."""
        lpi, gap, pixel = self.pitch_of_sheet, self.gap, units.INCH / self.ppi
        width, height = self.pixels
        distance = self.viewing_distance
        lens_pitch = units.INCH / lpi
        place = "afar" if math.isinf(distance) else f"{distance:g} mm"
        size = f"{self.size[0]:g}x{self.size[1]:g} mm"
        return Display(
            name=f"print-{lpi:g}lpi",
            title=f"{lpi:g}-lpi lenticular print, {size} at {self.ppi:g} ppi, seen from {place}",
            panel=Panel(width, height, pixel, units.stripe("none", "subpixels")),
            lens_array=LensArray("lenticular", lens_pitch),
            gap=gap,
            viewing_distance=distance,
            aperture_distance=default_aperture(distance, lens_pitch=lens_pitch, gap=gap, pixel_pitch=pixel),
            sheet=Sheet(),
        )


def print_of_texts(texts: Mapping[str, str]) -> Print:
    """The print of options as people write them.

    Keys are ``lpi`` or ``print-lpi``, ``ppi``, ``size`` (``200x300mm``), and, if wanted, ``viewing-distance``
    (``500``, ``50cm`` or ``infinite``), ``thickness`` (``0.66mm``, ``26mil``), ``index``, ``field`` (degrees).

    Raises
    ------
    DisplayError
        If a key is unknown or missing, or a value is out of its range; ``where`` is the key as written here.
    """
    refuse_unknown(texts, KEYS)
    for key in ("ppi", "size"):
        if key not in texts:
            raise DisplayError(f"{key} is missing", where=key, rule="a print needs lpi (or print-lpi), ppi and size")
    numbers = {key: units.plain_number(texts[key], key) for key in _NUMBERS if key in texts}
    lengths = {key: units.length(texts[key], key) for key in ("thickness",) if key in texts}
    distance = texts.get("viewing-distance", str(DEFAULT_DISTANCE))
    lengths["viewing-distance"] = math.inf if distance == INFINITE else units.length(distance, "viewing-distance")
    values = {key.replace("-", "_"): value for key, value in (numbers | lengths).items()}
    try:
        return Print(size=units.size(texts["size"], "size"), **values)
    except DisplayError as error:
        where = error.where.replace("_", "-")
        raise DisplayError(error.what, where=where, rule=error.rule, fix=error.fix) from None


def _check(value: object, key: str, limits: tuple[float, float], unit: str) -> None:
    checked = finite(value, key)
    if not limits[0] <= checked <= limits[1]:
        rule = f"it must lie between {limits[0]:g} and {limits[1]:g} {unit}"
        raise DisplayError(f"{key} is {checked:g}", where=key, rule=rule.rstrip())
