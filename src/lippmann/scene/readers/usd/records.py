"""A stage's content on its way between two processes: JSON, and the arrays to which it refers by number."""

from __future__ import annotations

import io
import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: A part of a stage, in terms of JSON.
Record = dict[str, Any]

_TREE = "tree"


@dataclass
class Arrays:
    """Arrays that records refer to."""

    stored: list[NDArray[np.generic]] = field(default_factory=list)

    def add(self, array: NDArray[np.generic]) -> int:
        """Store an array; its number, which stands for it in a record."""
        self.stored.append(array)
        return len(self.stored) - 1


def pack(tree: Record, arrays: Arrays) -> bytes:
    """Records and their arrays as bytes."""
    written = io.BytesIO()
    numbered = {f"a{number}": array for number, array in enumerate(arrays.stored)}
    text = np.frombuffer(json.dumps(tree).encode(), np.uint8)
    np.savez(written, **{_TREE: text}, **numbered)  # type: ignore[arg-type]  # names are free
    return written.getvalue()


def unpack(data: bytes) -> tuple[Record, list[NDArray[np.generic]]]:
    """Records and their arrays, as :func:`pack` was given them."""
    with np.load(io.BytesIO(data), allow_pickle=False) as stored:
        arrays = dict(stored)
    tree: Record = json.loads(arrays.pop(_TREE).tobytes())
    return tree, [arrays[f"a{number}"] for number in range(len(arrays))]
