"""Forms of colour beside depth in files' names: ``photo_rgbd.png``, ``photo_rgbd-half-far.png``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

#: The end of the depth range that is white: near or far.
White = Literal["near", "far"]

_NAME = re.compile(r"_rgbd(-half)?(-far)?$", re.IGNORECASE)


@dataclass(frozen=True)
class RgbdForm:
    """How colour and depth become one picture.

    Parameters
    ----------
    half:
        Whether each is halved in width, so that both together have the width of one.
    white:
        Whether near or far is white.
    """

    half: bool = False
    white: White = "near"

    @property
    def ending(self) -> str:
        """The ending of a file's stem that says this form; ``_rgbd`` alone is what the maker's player takes."""
        return f"_rgbd{'-half' if self.half else ''}{'-far' if self.white == 'far' else ''}"


def rgbd_of_name(path: Path) -> RgbdForm | None:
    """The form that the name says; None for other pictures."""
    match = _NAME.search(path.stem)
    return None if match is None else RgbdForm(match[1] is not None, "near" if match[2] is None else "far")
