"""Arrays in NumPy's files (``.npy``, and those within ``.npz``)."""

from __future__ import annotations

import io
import math
import warnings

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.parts import Readable, read_up_to

#: Most bytes of the text that tells of an array.
_LONGEST_HEADER = 1 << 16
_RULE = "an array of real numbers"


def read_numpy_array(file: Readable, name: str, where: str) -> NDArray[np.generic]:
    """The array of a file, its memory asked for before it is taken."""
    begin = read_up_to(file, 10)
    wide = begin[6:7] != b"\x01"  # the length of the header takes four bytes
    begin += read_up_to(file, 2 if wide else 0)
    length = int.from_bytes(begin[8:], "little")
    if length > _LONGEST_HEADER:
        raise SceneError(f"'{name}' has a header of {length} bytes", where=where, rule=f"at most {_LONGEST_HEADER}")
    head = io.BytesIO(begin + read_up_to(file, length))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Python's on damaged headers, NumPy's on old ones
        np.lib.format.read_magic(head)
        parse = np.lib.format.read_array_header_2_0 if wide else np.lib.format.read_array_header_1_0
        shape, is_fortran, dtype = parse(head)
    if dtype.kind not in "iufb" or dtype.itemsize > 8:
        raise SceneError(f"'{name}' is of {dtype}", where=where, rule=_RULE)
    if any(side < 0 or side > 1 << 40 for side in shape):
        raise SceneError(f"'{name}' is {shape}", where=where, rule=_RULE)
    size = math.prod(shape)
    check_input(size * (dtype.itemsize + 4), f"'{name}'", where=where)
    data = read_up_to(file, size * dtype.itemsize)
    if len(data) < size * dtype.itemsize:
        raise SceneError(f"holds {len(data)} of {size * dtype.itemsize} bytes of '{name}'", where=where)
    array = np.frombuffer(data, dtype)
    return array.reshape(shape[::-1]).T if is_fortran else array.reshape(shape)
