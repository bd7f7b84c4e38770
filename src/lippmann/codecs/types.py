"""Names for what files hold, whose types only the files themselves tell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

#: Endings of films that others made.
FILMS = (".mp4", ".m4v", ".mov", ".webm")
#: Pixels or a map, of whatever stored type.
Pixels: TypeAlias = NDArray[Any]
#: A stored type.
StoredType: TypeAlias = np.dtype[Any]
#: Attributes of a file: what JSON holds, not yet checked. A document is not to be changed.
Attributes: TypeAlias = dict[str, Any]
Document: TypeAlias = Mapping[str, Any]
#: The module ``zarr``, and an array of it: of two major versions, whose interfaces differ.
ZarrModule: TypeAlias = Any
ZarrArray: TypeAlias = Any
