"""The types of a picture's values and of its placement."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

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
