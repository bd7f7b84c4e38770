"""What the name of a picture with colour beside depth says of it: ``photo_rgbd.png``, ``photo_rgbd-half-far.png``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal

#: What is white: near or far.
White = Literal["near", "far"]

_NAME = re.compile(r"_rgbd(-half)?(-far)?$", re.IGNORECASE)


def ending_of_rgbd(half: bool, white: White) -> str:
    """The ending of the stem; ``half``: colour and depth are halved in width."""
    return f"_rgbd{'-half' if half else ''}{'-far' if white == 'far' else ''}"


def rgbd_of_name(path: Path) -> tuple[bool, White] | None:
    """Whether both are halved in width, and what is white; None for other pictures."""
    match = _NAME.search(path.stem)
    return None if match is None else (match[1] is not None, "near" if match[2] is None else "far")
