"""The shape of a real lens: a crest of some radius on a sheet of some thickness and refractive index.

The crest lies ``sag(x) = c x^2 / (1 + sqrt(1 - (1 + K) c^2 x^2))`` below its top, with c = 1 / radius and the conic
constant K: 0 is a circle, -1 a parabola. A lenticular sheet has it as a cylinder, an array of micro-lenses as a surface
of revolution. The panel touches the flat back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from lippmann.display.lens_array import LensArray
from lippmann.display.validation import POSITIVE, finite, positive
from lippmann.errors import DisplayError

#: Refractive index of PETG and APET, which most sheets are made of; acrylic has 1.49.
DEFAULT_INDEX = 1.57

#: Lengths of real sheets, by the key that has them.
TYPICAL = {
    "radius": "sheets have 0.53 to 1.7 pitches",
    "thickness": "sheets are 1.2 to 4 pitches thick",
    "diameter": "lenses are at most a pitch wide",
    "blur": "prints have a fifth to half of a pixel",
}

#: Refractive indices of water and of the densest plastics and glasses that lenses are cast in.
INDICES = (1.3, 2.0)

#: Conic constants, far beyond those of any crest.
_CONICS = (-10.0, 10.0)

#: Pitches, far beyond any sheet: lenses that are thicker have no field of view to speak of.
_THICKEST = 100.0


@dataclass(frozen=True)
class LensProfile:
    """Cross-section of a lens. Its pitch is that of its :class:`~lippmann.display.lens_array.LensArray`.

    Parameters
    ----------
    radius:
        Crest radius in millimetres.
    thickness:
        From the top of the crest to the flat back, in millimetres.
    index:
        Refractive index, 1.3 to 2.
    conic:
        Conic constant of the crest, -10 to 10.
    diameter:
        Width of a cylindrical lens, or diameter of a round micro-lens, in millimetres: the array is flat between its
        lenses. None where lenses meet.

    Raises
    ------
    DisplayError
        If a value is out of range; ``where`` names it.
    """

    radius: float
    thickness: float
    index: float = DEFAULT_INDEX
    conic: float = 0.0
    diameter: float | None = None

    def __post_init__(self) -> None:
        for name in ("radius", "thickness"):
            object.__setattr__(self, name, check_length(getattr(self, name), f"lens.{name}"))
        object.__setattr__(self, "index", check_index(self.index, "lens.index"))
        object.__setattr__(self, "conic", check_conic(self.conic, "lens.conic"))
        if self.diameter is not None:
            object.__setattr__(self, "diameter", check_length(self.diameter, "lens.diameter"))

    def sag(self, distance: float) -> float:
        """Depth of the crest below its top in mm, at a distance from its axis."""
        curvature = 1.0 / self.radius
        root = math.sqrt(max(0.0, 1.0 - (1.0 + self.conic) * (curvature * distance) ** 2))
        return curvature * distance**2 / (1.0 + root)

    def reach(self, lenses: LensArray) -> float:
        """Farthest distance of the crest from its axis in mm: half the lens's width, or the corner of its cell."""
        if self.diameter is not None:
            return 0.5 * self.diameter
        if lenses.layout == "lenticular":
            return 0.5 * lenses.pitch
        return math.hypot(*lenses.half_cell) if lenses.layout == "square" else lenses.half_cell[1]

    def in_words(self) -> str:
        """The profile as people read it."""
        conic = f", conic {self.conic:.3g}" if self.conic else ""
        return f"{self.thickness:.4g} mm thick, index {self.index:g}, crest radius {self.radius:.4g} mm{conic}"

    def check(self, lenses: LensArray) -> None:
        """Raise :class:`DisplayError` if lenses of this profile cannot stand side by side at that pitch."""
        if self.diameter is not None and self.diameter > lenses.pitch:
            rule = f"lenses {lenses.pitch:.4g} mm apart cannot be wider than that"
            raise DisplayError(f"diameter is {self.diameter:.4g} mm", where="lens.diameter", rule=rule)
        reach = self.reach(lenses)
        least = reach * math.sqrt(max(0.0, 1.0 + self.conic))
        if self.radius <= least:
            rule = f"lenses {2 * reach:.4g} mm wide need more than {least:.4g} mm; {TYPICAL['radius']}"
            raise DisplayError(f"radius is {self.radius:.4g} mm", where="lens.radius", rule=rule)
        sag, most = self.sag(reach), _THICKEST * lenses.pitch
        if not sag < self.thickness <= most:
            limit = f"the crest alone is {sag:.4g} mm high" if self.thickness <= sag else f"{most:.4g} mm is the most"
            rule = f"{limit}; {TYPICAL['thickness']}"
            raise DisplayError(f"thickness is {self.thickness:.4g} mm", where="lens.thickness", rule=rule)


def check_length(value: object, key: str) -> float:
    """``value`` as a length of a lens in millimetres, finite and above zero."""
    return positive(value, key, length_rule(key, POSITIVE))


def length_rule(key: str, rule: str) -> str:
    """A rule of a length of a lens or its ink, with what real sheets and prints have."""
    return "; ".join(filter(None, (rule, TYPICAL.get(key.rpartition(".")[2]))))


def check_index(value: object, key: str) -> float:
    """``value`` as a refractive index of 1.3 to 2."""
    return _within(value, key, INDICES, "sheets have 1.49 (acrylic) to 1.64")


def check_conic(value: object, key: str) -> float:
    """``value`` as a conic constant of -10 to 10."""
    return _within(value, key, _CONICS, "crests have -1 (parabola) to 0 (circle)")


def _within(value: object, key: str, limits: tuple[float, float], real: str) -> float:
    rule = f"it must lie between {limits[0]:g} and {limits[1]:g}; {real}"
    checked = finite(value, key, rule=rule)
    if not limits[0] <= checked <= limits[1]:
        raise DisplayError(f"{key.rpartition('.')[2]} is {checked:g}", where=key, rule=rule)
    return checked
