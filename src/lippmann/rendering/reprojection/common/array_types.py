"""Arrays that compiled kernels of reprojection take, by what they hold."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

#: Pixel numbers, columns, lenses, counts.
IntArray: TypeAlias = NDArray[np.integer]
#: Disparities, shifts, weights, colours.
RealArray: TypeAlias = NDArray[np.floating]
#: Which pixels or runs are meant.
BoolArray: TypeAlias = NDArray[np.bool_]
