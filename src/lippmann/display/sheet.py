"""The sheet that a print is made on: the finished print, the bleed around it, the margin with marks around that."""

from __future__ import annotations

from dataclasses import dataclass

from lippmann.display.validation import MAXIMUM_COUNT, check_text
from lippmann.errors import DisplayError

#: Name of the standard colour space, whose profile prints carry where none is asked for.
SRGB = "sRGB"


@dataclass(frozen=True)
class Sheet:
    """The margin of a finished print, and how the sheet is printed.

    Parameters
    ----------
    bleed:
        Pixels on every side of the trim that show the picture and are cut off.
    margin:
        Pixels on every side of the bleed that hold marks.
    mirrored:
        Whether files hold the sheet mirrored from left to right, for ink on the back of the lenses. Pictures in memory
        never are.
    profile:
        Name of the ICC profile that says what the codes in files mean.

    Raises
    ------
    DisplayError
        If a value has the wrong type or range; ``where`` names it.
    """

    bleed: int = 0
    margin: int = 0
    mirrored: bool = False
    profile: str = SRGB

    def __post_init__(self) -> None:
        for name in ("bleed", "margin"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MAXIMUM_COUNT:
                rule = f"it must be a whole number of pixels, 0 to {MAXIMUM_COUNT}"
                raise DisplayError(f"{name} is {value!r}", where=f"sheet.{name}", rule=rule)
        if not isinstance(self.mirrored, bool):
            raise DisplayError(
                f"mirrored is {self.mirrored!r}", where="sheet.mirrored", rule="it must be true or false"
            )
        check_text(self.profile, "sheet.profile")

    @property
    def border(self) -> int:
        """Pixels on every side that are cut off: bleed and margin."""
        return self.bleed + self.margin
