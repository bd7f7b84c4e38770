"""What the sheet of a print changes in its file: pixels mirrored from left to right, and an ICC profile."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.icc import srgb_profile
from lippmann.color.transfer import Transfer
from lippmann.display import Display
from lippmann.display.sheet import SRGB
from lippmann.image.stored_values import Stored

Number = TypeVar("Number", bound=np.generic)


def is_mirrored(display: Display | None) -> bool:
    """Whether files of a display's pictures hold them mirrored."""
    return display is not None and display.sheet is not None and display.sheet.mirrored


def mirrored_in_file(rows: NDArray[Number], display: Display | None) -> NDArray[Number]:
    """``(H, W, ...)`` whole rows in memory as a file holds them; and those of a file as memory does."""
    return rows[:, ::-1] if is_mirrored(display) else rows


def profile_in_file(display: Display | None, stored: Stored, transfer: Transfer, icc: bytes = b"") -> bytes:
    """The ICC profile that a picture's file is given: ``icc``, else sRGB's if the sheet of a print says so.

    Empty for panels, whose players read pixels alone, and for values that are no display codes.
    """
    sheet = None if display is None else display.sheet
    if sheet is None or transfer != "srgb" or stored not in ("uint8", "uint16"):
        return b""
    return icc or (srgb_profile() if sheet.profile == SRGB else b"")
