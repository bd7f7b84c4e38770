"""The proof of a display: what its lenses and pixels will show, before it is printed or rendered for."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import cast

import numpy as np

from lippmann.display.display import INFINITE, Display
from lippmann.display.pixel_aperture import PixelAperture
from lippmann.display.validation import INCH
from lippmann.display.view_cone import visible_size
from lippmann.errors import DisplayError
from lippmann.json_values import JsonObject, JsonValue
from lippmann.optics.crosstalk import ANNOYING, MOST_STRIPS, VISIBLE, crosstalk, independent_directions, most_strips
from lippmann.optics.directions import true_directions
from lippmann.optics.first_order import extreme_ray_field, rule_of_depth
from lippmann.optics.fitting import fit_profile, gap_of
from lippmann.optics.lens import Lens, check_display
from lippmann.optics.moire import Wave, moire_waves
from lippmann.optics.zone import ViewingZone
from lippmann.wording import html_table

#: By how much a sheet may be thicker than its maker says.
THICKER = 1.03

#: Dot gain that is tried on prints: standard deviation of the blur, in pixels.
DOT_GAIN = 0.5

#: Place beside the middle for which crosstalk is given: share of half the zone.
_ASIDE = 0.5


@dataclass(frozen=True)
class ThickerSheet:
    """The same picture behind a sheet 3 % thicker: angles in degrees, ``shift`` in pixels at the picture's edge."""

    gap: float
    field: float
    crosstalk: float
    shift: float


@dataclass(frozen=True)
class PrintTolerances:
    """Production errors of prints.

    Attributes
    ----------
    best_strips, invisible_strips:
        Most strips a lens with a crosstalk straight ahead that is not annoying, and that is not seen.
    dot_gain:
        Crosstalk straight ahead with a blur of ink of half a pixel.
    misregistration, misregistration_depth:
        An ink that lies a pixel off shows its picture this many degrees to the side, and this far off in mm at the
        usable depth.
    pitch_drift:
        Deviation of the sheet's pitch, as a share of it, that turns the edge of the picture by one strip.
    """

    best_strips: int
    invisible_strips: int
    dot_gain: float
    misregistration: float
    misregistration_depth: float
    pitch_drift: float


@dataclass(frozen=True)
class Proof:
    """The proof of a display. Lengths in millimetres, angles in degrees, crosstalk as a share of the light.

    Attributes
    ----------
    display, title, lens:
        Name of the display, a line on it, and the lens; None where the display gives none and an ideal one is taken.
    pixels:
        Pixels of one lens across.
    directions:
        Directions that one lens tells apart.
    crosstalk, crosstalk_aside:
        Straight ahead, and half-way to the edge of the zone.
    depth, rule_of_depth:
        Usable depth on both sides of the lenses, together: by the light of one direction, which spreads over one lens
        there; and 2 N t / n by the rule of the trade, None without a lens.
    field, field_of_extreme_ray:
        Between the outermost true directions of a lens, and by the formula; None without a lens.
    zone:
        Where the whole display shows one set of views.
    viewing_distance:
        Infinite where the views of all lenses are parallel.
    moire:
        Waves of an even white picture that are seen, the slowest first.
    thicker:
        Behind a sheet 3 % thicker; None without a lens.
    tolerances:
        None for displays that are no prints.
    advice:
        What to change, in one line.

    Examples
    --------
    >>> from lippmann.optics.proof import prove
    >>> prove(lippmann.load_display("print-60lpi")).in_words()["directions"]
    '12 that one lens tells apart, of 12.01 pixels'
    """

    display: str
    title: str
    lens: str | None
    pixels: float
    directions: float
    crosstalk: float
    crosstalk_aside: float
    depth: float
    rule_of_depth: float | None
    field: float
    field_of_extreme_ray: float | None
    zone: ViewingZone
    viewing_distance: float
    moire: tuple[Wave, ...]
    thicker: ThickerSheet | None
    tolerances: PrintTolerances | None
    advice: str

    def in_words(self) -> dict[str, str]:
        """The proof's results by name, in the order of a table."""
        rule = "" if self.rule_of_depth is None else f" (rule of the trade: {self.rule_of_depth:.3g} mm)"
        extreme = self.field_of_extreme_ray
        words = {
            "display": f"{self.display}: {self.title}" if self.title else self.display,
            "lens": self.lens or "none is given: an ideal pinhole at the gap",
            "directions": f"{self.directions:.3g} that one lens tells apart, of {self.pixels:.4g} pixels",
            "crosstalk": f"{_ghost(self.crosstalk)} straight ahead, {_ghost(self.crosstalk_aside)} half-way aside",
            "depth": f"{self.depth:.3g} mm in all, half of it behind the lenses{rule}",
            "field": f"{self.field:.3g} deg" + (f", {extreme:.3g} deg by the extreme ray" if extreme else ""),
            "zone": self._zone_in_words(),
            "moire": self._moire_in_words(),
        }
        if self.thicker is not None:
            thicker = self.thicker
            words["3 % thicker"] = (
                f"field {thicker.field:.3g} deg, crosstalk {_ghost(thicker.crosstalk)}, "
                f"the picture's edge is {thicker.shift:.2g} pixels off"
            )
        if self.tolerances is not None:
            words |= _tolerances_in_words(self.tolerances)
        return {**words, "advice": self.advice}

    def _repr_html_(self) -> str:
        """The table of :meth:`in_words` for notebooks."""
        return html_table("Proof", self.in_words())

    def to_dict(self) -> JsonObject:
        """Plain values for JSON; an infinite distance is ``"infinite"``."""
        zone = {"nearest": self.zone.nearest, "farthest": self.zone.farthest, "width": None}
        if math.isfinite(self.viewing_distance):
            zone["width"] = self.zone.width_at(self.viewing_distance)
        return cast("JsonObject", _finite({**asdict(self), "zone": zone}))

    def _zone_in_words(self) -> str:
        near, far = self.zone.nearest, self.zone.farthest
        reach = f"from {near:.0f} mm on" if math.isinf(far) else f"from {near:.0f} to {far:.0f} mm"
        if math.isinf(self.viewing_distance):
            return f"the whole picture {reach}"
        width = self.zone.width_at(self.viewing_distance)
        return f"{width:.0f} mm wide at {self.viewing_distance:.0f} mm; the whole picture {reach}"

    def _moire_in_words(self) -> str:
        if not self.moire:
            return "none slower than the lenses and stronger than 1 %"
        slowest = self.moire[0]
        return f"bars every {slowest.period:.3g} mm, {_share(slowest.contrast)} of contrast in one colour"


def prove(display: Display) -> Proof:
    """The proof of a display, with its own lens or, where it gives none, with an ideal pinhole.

    Raises
    ------
    DisplayError
        ``display`` is no :class:`~lippmann.Display`, or an eye-tracked monitor, whose lenses are not known.

    Examples
    --------
    >>> from lippmann.optics.proof import prove
    >>> prove(lippmann.load_display("print-60lpi")).advice
    'keep the scene within 4.59 mm in front of and behind the lenses ...'
    """
    check_display(display)
    if display.stereo is not None:
        rule, fix = "an eye-tracked monitor steers the light of unknown lenses", "'lippmann plan' says its depth"
        raise DisplayError(f"{display.name} has no proof", parameter="display", rule=rule, fix=fix)
    directions, straight = independent_directions(display), crosstalk(display, 0.0)
    slope = edge_slope(display)
    depth = 2.0 * directions * display.gap
    tolerances = _tolerances(display, depth) if is_print(display) else None
    lens = display.lens
    return Proof(
        display=display.name,
        title=display.title,
        lens=None if lens is None else lens.in_words(),
        pixels=display.pixels_per_lens[0],
        directions=directions,
        crosstalk=straight,
        crosstalk_aside=crosstalk(display, _ASIDE * slope),
        depth=depth,
        rule_of_depth=None if lens is None else rule_of_depth(lens, display.pixels_per_lens[0]),
        field=math.degrees(2.0 * math.atan(slope)),
        field_of_extreme_ray=None if lens is None else _extreme(display),
        zone=zone_of(display),
        viewing_distance=display.viewing_distance,
        moire=tuple(moire_waves(display)),
        thicker=None if lens is None else _thicker(display),
        tolerances=tolerances,
        advice=_advice(display, straight, depth, tolerances),
    )


def is_print(display: Display) -> bool:
    """Whether a display is a print: upright cylinders over pixels without sub-pixels of their own places."""
    lenses = display.lens_array
    return lenses.layout == "lenticular" and not lenses.slant and len(set(display.panel.subpixel_offsets)) == 1


def edge_slope(display: Display) -> float:
    """Slope across the lenses of the outermost true direction that a lens shows of its own micro-image."""
    half = 0.5 * display.micro_image_pitch
    if display.lens is None:
        return half / display.gap
    return -float(true_directions(Lens.of(display)).direction_of(np.array(half)))


def zone_of(display: Display) -> ViewingZone:
    """The viewing zone of an eye that moves level, by the true directions of the lens."""
    # The cone of slanted lenses is wider.
    level = edge_slope(display) / math.cos(math.radians(display.lens_array.slant))
    return ViewingZone(visible_size(display)[0], display.viewing_distance, level)


def _extreme(display: Display) -> float | None:
    assert display.lens is not None
    field = extreme_ray_field(display.lens, display.lens_array.pitch)
    return None if math.isnan(field) else field


def _thicker(display: Display) -> ThickerSheet:
    assert display.lens is not None
    profile = replace(display.lens, thickness=THICKER * display.lens.thickness)
    gap = gap_of(profile, display.lens_array)
    thicker = replace(display, lens=profile, gap=gap)
    # At the edge of the picture micro-images would have to lie farther out.
    shift = 0.5 * visible_size(display)[0] * (gap - display.gap) / display.viewing_distance
    return ThickerSheet(
        gap=gap,
        field=math.degrees(2.0 * math.atan(edge_slope(thicker))),
        crosstalk=crosstalk(thicker, 0.0),
        shift=abs(shift) / display.panel.pixel_pitch,
    )


def _tolerances(display: Display, depth: float) -> PrintTolerances:
    pixel = display.panel.pixel_pitch
    aperture = replace(display.pixel or PixelAperture(), blur=DOT_GAIN * pixel)
    off = pixel / display.gap
    return PrintTolerances(
        best_strips=most_strips(display, ANNOYING),
        invisible_strips=most_strips(display, VISIBLE),
        dot_gain=crosstalk(replace(display, pixel=aperture), 0.0),
        misregistration=math.degrees(math.atan(off)),
        misregistration_depth=0.5 * depth * off,
        pitch_drift=pixel / (0.5 * display.size_mm[0]),
    )


def _advice(display: Display, straight: float, depth: float, tolerances: PrintTolerances | None) -> str:
    """Advice in one line: on crosstalk first, then on pixels that the lens does not tell apart, or could."""
    keep = f"keep the scene within {0.5 * depth:.3g} mm in front of and behind the lenses"
    if display.resolved_size > display.lens_array.pitch:
        keep += f" (scenes are fitted to {display.resolvable_depth[0]:.3g} mm, where points are "
        keep += f"{display.resolved_size:.2g} mm wide)"
    if display.lens is None:
        return f"{keep}; with the table [lens] of a display file, or thickness= of a print, the true lens is proved"
    pixels = display.pixels_per_lens[0]
    if tolerances is None:
        return keep if straight <= ANNOYING or display.lens_array.slant else f"crosstalk is annoying; {keep}"
    strips, ppi = tolerances.best_strips, INCH / display.panel.pixel_pitch
    if straight <= ANNOYING:
        more = strips > 1.2 * pixels
        finer = f"; the lens could show {strips} strips, at {ppi * strips / pixels:.0f} ppi" if more else ""
        return keep + finer
    best = fit_profile(
        display.lens_array,
        thickness=display.lens.thickness,
        index=display.lens.index,
        conic=display.lens.conic,
        diameter=display.lens.diameter,
    )
    fewer = f"use {strips} strips a lens in place of {pixels:.3g} ({ppi * strips / pixels:.0f} ppi)"
    if strips < 2:
        fewer = f"print finer than {ppi:.0f} ppi with less blur"
    away = abs(best.radius / display.lens.radius - 1.0)
    sharper = f", or a sheet with a crest radius of {best.radius:.4g} mm" if away > 0.01 else ""
    return f"{fewer}{sharper}; {keep}"


def _share(share: float) -> str:
    """A share of light in percent."""
    return f"{float(f'{100 * share:.2g}'):g} %" if share >= 5e-4 else "0 %"


def _ghost(share: float) -> str:
    """Crosstalk in percent, and the mark that it is above."""
    mark = " (annoying)" if share > ANNOYING else " (visible)" if share > VISIBLE else ""
    return f"{_share(share)}{mark}"


def _tolerances_in_words(tolerances: PrintTolerances) -> dict[str, str]:
    best, invisible = tolerances.best_strips, tolerances.invisible_strips
    strips = f"up to {best} a lens are not annoying (5.8 %), up to {invisible} not seen (1 %)"
    return {
        "strips": strips if invisible < MOST_STRIPS else "an ideal lens shows any number apart",
        "dot gain": f"of half a pixel: crosstalk {_ghost(tolerances.dot_gain)}",
        "register": f"an ink one pixel off is turned by {tolerances.misregistration:.2g} deg, "
        f"{tolerances.misregistration_depth:.2g} mm at the usable depth",
        "pitch": f"{100 * tolerances.pitch_drift:.2g} % off turns the picture's edge by one strip",
    }


def _finite(value: object) -> JsonValue:
    """The value with infinities as words, for JSON."""
    if isinstance(value, dict):
        return {name: _finite(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(part) for part in value]
    return INFINITE if isinstance(value, float) and math.isinf(value) else cast("JsonValue", value)
