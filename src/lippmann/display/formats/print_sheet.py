"""A print behind a lenticular sheet as a display.

The sheet has ``lpi`` lenses per inch. Seen from a distance D the micro-images of the print, which lie a gap g behind
the lens centres, must be a little wider than the lenses, p (D + g) / D: the print pitch, in lenses per inch
``lpi D / (D + g)``. Sheets differ from their nominal number by more than that, so a pitch test is printed: the strip
that stands still from D is labelled with the print pitch itself.

Makers state the thickness or the field of view F, the angle from one flip of the picture to the next, or both. A
thickness makes a real lens: with a crest radius that is stated, or that has this field, or that focuses best. A field
alone makes pinholes at the gap of tan(F / 2) = p (D + g) / (2 D g). Typical sheets are known by name.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import cast

from lippmann.display import validation
from lippmann.display.display import INFINITE, Display
from lippmann.display.formats.recorded_depth import default_aperture
from lippmann.display.lens_array import LensArray
from lippmann.display.lens_profile import DEFAULT_INDEX, LensProfile, check_index, check_length, length_rule
from lippmann.display.panel import Panel, stripe
from lippmann.display.pixel_aperture import PixelAperture
from lippmann.display.sheet import Sheet
from lippmann.display.validation import MAXIMUM_COUNT, finite, number, refuse_unknown
from lippmann.errors import DisplayError
from lippmann.runtime.engine_lock import cached_property


@dataclass(frozen=True)
class TypicalSheet:
    """Lenses per inch, crest radius and thickness in millimetres, and refractive index of a sheet."""

    lpi: float
    radius: float
    thickness: float
    index: float


#: By name.
TYPICAL_SHEETS = {
    f"{sheet.lpi:g}lpi": sheet
    for sheet in (
        TypicalSheet(18, 1.2319, 3.03, 1.5865),
        TypicalSheet(25, 1.7088, 3.92, 1.5865),
        TypicalSheet(32, 1.2049, 3.16, 1.5865),
        TypicalSheet(42, 0.7846, 2.01, 1.5865),
        TypicalSheet(50, 0.2707, 0.5895, 1.6357),
        TypicalSheet(75, 0.2279, 0.5281, 1.6357),
        TypicalSheet(100, 0.1493, 0.4078, 1.6357),
        TypicalSheet(161, 0.0995, 0.2456, 1.6357),
    )
}


def typical_sheet(name: str) -> TypicalSheet:
    """The sheet of that name, such as ``75lpi``; a :class:`DisplayError` that lists them if there is none."""
    if name not in TYPICAL_SHEETS:
        rule = f"typical sheets are {', '.join(TYPICAL_SHEETS)}"
        raise DisplayError.unknown("sheet", name, TYPICAL_SHEETS, where="sheet", rule=rule)
    return TYPICAL_SHEETS[name]


#: Keys of the short form of a print.
KEYS = (
    *("lpi", "print-lpi", "ppi", "size", "viewing-distance"),
    *("thickness", "index", "field", "radius", "conic", "blur", "sheet"),
)

_NUMBERS = ("lpi", "print-lpi", "ppi", "index", "field", "conic")
_LENGTHS = ("thickness", "radius", "blur")

#: Lenses and pixels per inch, far beyond any that are made.
_LPI = (1.0, 1000.0)
_PPI = (10.0, 20_000.0)

_FIELDS = (5.0, 150.0)

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
        Of the sheet, in millimetres, and its refractive index, 1.3 to 2.
    field:
        Angle in degrees from one flip of the picture to the next, 5 to 150. Without a thickness it is 54 degrees.
    radius, conic:
        Crest radius in millimetres and conic constant of the lenses. Without a radius the crest is the one that has
        the field, or that focuses best.
    blur:
        Standard deviation of the blur of ink in millimetres.
    sheet:
        Name of a typical sheet, such as ``75lpi``, see :mod:`~lippmann.display.formats.print_sheet`; in place of
        its pitch, thickness, index and crest radius.

    Raises
    ------
    DisplayError
        If a value is out of range, or two say the same; ``where`` names it.

    Examples
    --------
    >>> from lippmann.display.formats.print_sheet import Print
    >>> Print(ppi=600, size=(60.0, 45.0), lpi=60).display().panel.width
    1417
    """

    ppi: float
    size: tuple[float, float]
    lpi: float | None = None
    print_lpi: float | None = None
    viewing_distance: float = DEFAULT_DISTANCE
    thickness: float | None = None
    index: float | None = None
    field: float | None = None
    radius: float | None = None
    conic: float | None = None
    blur: float = 0.0
    sheet: str | None = None

    def __post_init__(self) -> None:
        if self.sheet is not None:
            self._take_sheet(typical_sheet(self.sheet))
        self._check_choices()
        _check(self._stated_lpi, "lpi" if self.print_lpi is None else "print_lpi", _LPI, "lenses per inch")
        _check(self.ppi, "ppi", _PPI, "pixels per inch")
        rule = f"it must be a length of at least {_NEAREST:g} mm, or infinite"
        if number(self.viewing_distance, "viewing_distance", rule=rule) < _NEAREST:
            raise DisplayError(f"viewing_distance is {self.viewing_distance:g} mm", where="viewing_distance", rule=rule)
        if self.field is not None:
            _check(self.field, "field", _FIELDS, "degrees; makers state 25 to 60")
        if self.thickness is not None:
            self._check_thickness(self.thickness)
            _ = self._lens_and_gap
        elif 4 * self._parallel_gap > self.viewing_distance:
            rule = f"lenses of {self._stated_lpi:g} lpi and this field are {self._parallel_gap:.3g} mm deep"
            what, fix = f"viewing_distance is {self.viewing_distance:g} mm", "look from farther away"
            raise DisplayError(what, where="viewing_distance", rule=rule, fix=fix)
        for side in self.size:
            self._check_side(side)
        self._check_pixels_per_lens()
        _ = self.pixel

    def _check_choices(self) -> None:
        if self.lpi is None and self.print_lpi is None:
            rule = "the lenses per inch of the sheet, or print_lpi as a pitch test found it, must be given"
            raise DisplayError("lpi is missing", where="lpi", rule=rule)
        pairs = (
            ("print_lpi", "lpi", "a pitch test's print_lpi takes its place"),
            ("radius", "field", "the crest radius of a sheet gives its field of view"),
        )
        for one, other, rule in pairs:
            if getattr(self, one) is not None and getattr(self, other) is not None:
                raise DisplayError(f"{one} and {other} are both given", where=one, rule=rule, fix="leave one out")
        for name in ("index", "radius", "conic"):
            if getattr(self, name) is not None and self.thickness is None:
                rule = "it means nothing alone: without a thickness the print has no lens"
                raise DisplayError(f"{name} is given without a thickness", where=name, rule=rule)

    def _take_sheet(self, sheet: TypicalSheet) -> None:
        """Take the values of a typical sheet, of which a pitch test may have measured the pitch."""
        for name in ("lpi", "thickness", "index", "field", "radius", "conic"):
            if getattr(self, name) is not None:
                rule, fix = "a typical sheet has its own", "leave one out"
                raise DisplayError(f"sheet and {name} are both given", where=name, rule=rule, fix=fix)
        if self.print_lpi is None:
            object.__setattr__(self, "lpi", sheet.lpi)
        for name in ("thickness", "index", "radius"):
            object.__setattr__(self, name, getattr(sheet, name))

    def _check_thickness(self, thickness: float) -> None:
        index = check_index(DEFAULT_INDEX if self.index is None else self.index, "index")
        slope = validation.INCH / self._stated_lpi / 2 * index / check_length(thickness, "thickness")
        field = math.degrees(2 * math.atan(slope))
        if field > _FIELDS[1]:
            # A sheet thinner than its own crest is refused for that.
            _ = self._lens_and_gap
        if not _FIELDS[0] <= field <= _FIELDS[1]:
            rule = f"such lenses must have a field of view of {_FIELDS[0]:g} to {_FIELDS[1]:g} degrees"
            rule, fix = length_rule("thickness", rule), "look at its unit"
            raise DisplayError(f"thickness is {thickness:g} mm", where="thickness", rule=rule, fix=fix)

    def _check_side(self, side: object) -> None:
        length = finite(side, "size")
        pixels = length * self.ppi / validation.INCH
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
        width, height = (round(side * self.ppi / validation.INCH) for side in self.size)
        return width, height

    @property
    def gap(self) -> float:
        """Air-equivalent distance from the print to the lens centres in millimetres."""
        if self.thickness is not None:
            return self._lens_and_gap[1]
        if self.lpi is None:
            return self._parallel_gap
        # The field is that of the micro-images, which are wider than the lenses.
        return self._parallel_gap / (1 - self._parallel_gap / self.viewing_distance)

    @property
    def lens(self) -> LensProfile | None:
        """Profile of the lenses; None where no thickness is known."""
        return None if self.thickness is None else self._lens_and_gap[0]

    @property
    def pixel(self) -> PixelAperture | None:
        """Aperture of the pixels; None without a blur of ink."""
        if not self.blur:
            return None
        with _own_keys():
            aperture = PixelAperture(blur=self.blur)
            aperture.lit_size(Panel(1, 1, validation.INCH / self.ppi))
        return aperture

    @cached_property
    def _lens_and_gap(self) -> tuple[LensProfile, float]:
        from lippmann.optics.fitting import fit_profile, gap_of, profile_behind

        def profile(pitch: float) -> LensProfile:
            index = DEFAULT_INDEX if self.index is None else self.index
            return fit_profile(
                LensArray("lenticular", pitch),
                thickness=cast("float", self.thickness),
                index=index,
                radius=self.radius,
                field=self.field,
                conic=0.0 if self.conic is None else self.conic,
            )

        stated = validation.INCH / self._stated_lpi
        with _own_keys():
            if self.lpi is None:
                lens, _, gap = profile_behind(profile, stated, self.viewing_distance)
                return lens, gap
            lens = profile(stated)
            return lens, gap_of(lens, LensArray("lenticular", stated))

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
        return cast("float", self.print_lpi if self.lpi is None else self.lpi)

    @property
    def _parallel_gap(self) -> float:
        """The gap for an infinite viewing distance: micro-images as far apart as the stated lenses per inch."""
        field = DEFAULT_FIELD if self.field is None else self.field
        return validation.INCH / self._stated_lpi / (2 * math.tan(math.radians(field) / 2))

    def display(self) -> Display:
        """The print and its sheet as a display, aligned as :class:`Display` aligns lenses."""
        from lippmann.optics.directions import distortion_of

        lpi, gap, pixel = self.pitch_of_sheet, self.gap, validation.INCH / self.ppi
        width, height = self.pixels
        distance = self.viewing_distance
        lens_pitch = validation.INCH / lpi
        lenses = LensArray("lenticular", lens_pitch)
        place = "afar" if math.isinf(distance) else f"{distance:g} mm"
        measured = "" if self.print_lpi is None else f" (print pitch {self.print_lpi:g} lpi)"
        size = f"{self.size[0]:g}x{self.size[1]:g} mm"
        return Display(
            name=f"print-{self._stated_lpi:g}lpi",
            title=f"{lpi:g}-lpi lenticular print{measured}, {size} at {self.ppi:g} ppi, seen from {place}",
            panel=Panel(width, height, pixel, stripe("none", "subpixels")),
            lens_array=lenses,
            gap=gap,
            viewing_distance=distance,
            aperture_distance=default_aperture(distance, lens_pitch=lens_pitch, gap=gap, pixel_pitch=pixel),
            sheet=Sheet(),
            lens=self.lens,
            pixel=self.pixel,
            distortion=None if self.lens is None else distortion_of(self.lens, lenses, gap),
        )


def print_of_texts(texts: Mapping[str, str]) -> Print:
    """The print of options as people write them.

    Keys are ``lpi`` or ``print-lpi``, ``ppi``, ``size`` (``200x300mm``), and, if wanted, ``viewing-distance``
    (``50cm`` or ``infinite``), ``thickness`` (``0.66mm``, ``26mil``), ``index``, ``field`` (degrees),
    ``radius`` and ``conic`` of the crest, ``blur`` of ink (``12um``), ``sheet`` (``75lpi``).

    Raises
    ------
    DisplayError
        If a key is unknown or missing, or a value is out of its range; ``where`` is the key as written here.
    """
    for key in ("bleed", "marks", "icc", "mirror"):
        if key in texts:
            raise DisplayError(
                f"{key} is no number of the lens sheet", where=key, fix=f"say it beside the print: {key}=..."
            )
    refuse_unknown(texts, KEYS)
    needed = ({"lpi", "print-lpi", "sheet"}, {"ppi"}, {"size"})
    if missing := [min(keys) for keys in needed if not keys & texts.keys()]:
        what = f"{', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing"
        raise DisplayError(what, where=missing[0], rule="a print needs lpi (or print-lpi, or sheet), ppi and size")
    numbers = {key: validation.plain_number(texts[key], key) for key in _NUMBERS if key in texts}
    lengths = {
        key: validation.length(texts[key], key, unit="", rule=length_rule(key, validation.LENGTH))
        for key in _LENGTHS
        if key in texts
    }
    distance = texts.get("viewing-distance", f"{DEFAULT_DISTANCE}mm")
    is_far = distance == INFINITE
    lengths["viewing-distance"] = math.inf if is_far else validation.length(distance, "viewing-distance", unit="")
    values = {key.replace("-", "_"): value for key, value in (numbers | lengths).items()}
    try:
        return Print(size=validation.size(texts["size"], "size"), sheet=texts.get("sheet"), **values)
    except DisplayError as error:
        where = error.where.replace("_", "-")
        raise DisplayError(error.what, where=where, rule=error.rule, fix=error.fix) from None


@contextmanager
def _own_keys() -> Iterator[None]:
    """Errors of the tables of a display name the keys of a print, which has no tables."""
    try:
        yield
    except DisplayError as error:
        raise DisplayError(error.what, where=error.where.rpartition(".")[2], rule=error.rule, fix=error.fix) from None


def _check(value: object, key: str, limits: tuple[float, float], unit: str) -> None:
    checked = finite(value, key)
    if not limits[0] <= checked <= limits[1]:
        rule = f"it must lie between {limits[0]:g} and {limits[1]:g} {unit}"
        raise DisplayError(f"{key} is {checked:g}", where=key, rule=rule.rstrip())
