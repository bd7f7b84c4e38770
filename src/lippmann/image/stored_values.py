"""The types of a picture's values and of its placement, and the check of the placement's matrix."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import PictureError

FloatArray = NDArray[np.float32]
Matrix = NDArray[np.float64]

#: Values as files hold them: codes of 8 or 16 bits, or linear floats.
Values = NDArray[np.uint8 | np.uint16 | np.float16 | np.float32]

#: Layers beside the RGB, ``(H, W)`` or ``(H, W, 2 to 4)``; the RGB too where both are meant.
Layer = NDArray[np.generic]
#: Rows, columns or other whole numbers, element by element.
Indices = NDArray[np.integer[Any]]

#: How values were stored in the file that a picture came from; ``float32`` if it came from none.
Stored = Literal["uint8", "uint16", "float16", "float32"]

#: Deviation of ``world_from_display`` from a rotation and scales that rounding may leave.
_TOLERANCE = 1e-6


def checked_placement(matrix: object) -> Matrix:
    """``matrix`` as a read-only ``(4, 4)`` float64 array; a :class:`PictureError` if it places no display.

    Columns 0 to 2 are the display's axes in the world: right-handed, x and y at a right angle and equally long. That of
    z may be longer, where the display shows the scene's depth compressed, and lean, where a camera's lens is shifted.
    """
    rule = "it must be 4 x 4: a rotation times a scale (z may differ and lean), a translation, and (0, 0, 0, 1) below"
    try:
        values: Matrix = np.array(matrix, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise PictureError("world_from_display is no matrix", rule=rule) from None
    if values.shape != (4, 4) or not np.isfinite(values).all() or list(values[3]) != [0, 0, 0, 1]:
        raise PictureError(f"world_from_display is {values.tolist()}", rule=rule)
    linear = values[:3, :3]
    with np.errstate(all="ignore"):  # what overflows places nothing either: NaN is within no tolerance
        lengths = np.linalg.norm(linear, axis=0)
        axes = linear / lengths
        is_regular = np.linalg.det(axes) > 0.0 and abs(lengths[0] / lengths[1] - 1.0) <= _TOLERANCE
        is_square = abs(axes[:, 0] @ axes[:, 1]) <= _TOLERANCE
    if not (is_regular and is_square):
        raise PictureError(f"world_from_display is {values.tolist()}", rule=rule)
    values.flags.writeable = False
    return values
