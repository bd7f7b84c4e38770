"""The part of a (sub-)pixel that shines, or the ink of a printed one."""

from __future__ import annotations

from dataclasses import dataclass

from lippmann.display.lens_profile import length_rule
from lippmann.display.panel import Panel
from lippmann.display.validation import finite
from lippmann.errors import DisplayError


@dataclass(frozen=True)
class PixelAperture:
    """Size of a sub-pixel's light, in millimetres.

    Parameters
    ----------
    width, height:
        Of a sub-pixel with its share of the black matrix; None is the whole place that it has on the panel.
    black_matrix:
        Width of the dark line between neighbours.
    blur:
        Standard deviation of the blur of ink, a Gaussian: dot gain.

    Raises
    ------
    DisplayError
        If a length is out of range; ``where`` names it.
    """

    width: float | None = None
    height: float | None = None
    black_matrix: float = 0.0
    blur: float = 0.0

    def __post_init__(self) -> None:
        for name in ("width", "height", "black_matrix", "blur"):
            value = getattr(self, name)
            if value is None:
                continue
            least = "above zero" if name in ("width", "height") else "of zero or more"
            rule = length_rule(name, f"it must be a length {least}")
            length = finite(value, f"pixel.{name}", rule=rule)
            if length < 0 or (length == 0 and name in ("width", "height")):
                raise DisplayError(f"{name} is {length:g} mm", where=f"pixel.{name}", rule=rule)
            object.__setattr__(self, name, length)

    def lit_size(self, panel: Panel) -> tuple[float, float]:
        """Width and height in mm of the part of a sub-pixel that shines.

        Raises
        ------
        DisplayError
            If the black matrix leaves nothing of it, or it is larger than a pixel.
        """
        cell = subpixel_cell(panel)
        lit = []
        for name, given, own in zip(("width", "height"), (self.width, self.height), cell, strict=True):
            size = own if given is None else given
            if size > panel.pixel_pitch * (1 + 1e-9):
                rule = f"a pixel is {panel.pixel_pitch:.4g} mm wide"
                raise DisplayError(f"{name} is {size:.4g} mm", where=f"pixel.{name}", rule=rule)
            if self.black_matrix >= size:
                rule = f"it must leave some of a sub-pixel's {name} of {size:.4g} mm"
                what = f"black_matrix is {self.black_matrix:.4g} mm"
                raise DisplayError(what, where="pixel.black_matrix", rule=rule)
            lit.append(size - self.black_matrix)
        if self.blur > panel.pixel_pitch:
            rule = length_rule("blur", f"it must not exceed a pixel of {panel.pixel_pitch:.4g} mm")
            raise DisplayError(f"blur is {self.blur:.4g} mm", where="pixel.blur", rule=rule)
        return lit[0], lit[1]


def subpixel_cell(panel: Panel) -> tuple[float, float]:
    """Width and height in mm of the place of one sub-pixel: a third of the pixel where three lie side by side."""
    across, down = (len({round(offset[axis], 6) for offset in panel.subpixel_offsets}) for axis in (0, 1))
    pitch = panel.pixel_pitch
    return (pitch / across, pitch) if across >= down else (pitch, pitch / down)
