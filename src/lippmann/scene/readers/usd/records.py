"""A stage's content on its way between two processes: JSON, and the arrays to which it refers by number."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: A part of a stage, in terms of JSON.
Record = dict[str, Any]

#: Bytes of the length of the JSON.
_LENGTH = 8


@dataclass
class Arrays:
    """Arrays that records refer to."""

    stored: list[NDArray[np.generic]] = field(default_factory=list)

    def add(self, array: NDArray[np.generic]) -> int:
        """Store an array; its number, which stands for it in a record."""
        self.stored.append(array)
        return len(self.stored) - 1


def pack(tree: Record, arrays: Arrays) -> bytes:
    """Records and their arrays as bytes: the length of the JSON, the JSON, and the numbers of all arrays."""
    kinds = [(array.dtype.str, array.shape) for array in arrays.stored]
    text = json.dumps([tree, kinds]).encode()
    return b"".join([len(text).to_bytes(_LENGTH, "little"), text, *(array.tobytes() for array in arrays.stored)])


def unpack(data: bytes) -> tuple[Record, list[NDArray[np.generic]]]:
    """Records and their arrays, as :func:`pack` was given them; the arrays are read-only."""
    place = _LENGTH + int.from_bytes(data[:_LENGTH], "little")
    tree, kinds = json.loads(data[_LENGTH:place])
    arrays = []
    for kind, shape in kinds:
        array = np.frombuffer(data, kind, math.prod(shape), place).reshape(shape)
        arrays.append(array)
        place += array.nbytes
    return tree, arrays
