"""Light fields as the Light Field Toolbox for MATLAB keeps them: a variable ``LF`` in a ``.mat`` file.

``LF`` is ``[t, s, v, u, c]`` (uint8, uint16 or single), where ``s`` and ``t`` count the views across and down, ``u``
and ``v`` the pixels of a view, and a fourth colour, where there is one, is the weight of each value (D. Dansereau,
Light Field Toolbox). What is written has the version 7.3 (HDF5), whose arrays HDF5 sees with the axes reversed, since
MATLAB keeps the first index together; versions 5 to 7 are read too.
"""

from __future__ import annotations

import mmap
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.exchange.light_field import WEIGHT, LightField, check_rectangular, check_shape
from lippmann.exchange.metadata_text import TEXT_KEY, from_note, to_note
from lippmann.exchange.weights import weight_codes, weights
from lippmann.runtime.atomic_write import replacing
from lippmann.runtime.optional_import import optional

LAYOUT = "lftoolbox"

#: What MATLAB looks for before the HDF5 part: text, a version, and the order of bytes.
_USER_BLOCK = 512
_HEADER = b"MATLAB 7.3 MAT-file, written by Lippmann".ljust(116) + b"\0" * 8 + b"\x00\x02IM"

_CLASSES = {"uint8": b"uint8", "uint16": b"uint16", "float32": b"single"}
_VARIABLE = "LF"

#: Filters of HDF5 that are read, by number. HDF5 loads others as plugins.
_FILTERS = {1: "deflate", 2: "shuffle", 3: "fletcher32", 32000: "lzf"}

#: Characters of the text that says what the light field is; ours has some thousand.
_MOST_TEXT = 1 << 22

#: Classes of a MATLAB variable of version 5 that are arrays of numbers.
_NUMBERS = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "single", "double")


def write_matlab(light_field: LightField, display: Display, path: Path) -> None:
    """Write a ``.mat`` file of the version 7.3, losslessly compressed; half floats become single ones, exactly.

    A map ``weight`` becomes the fourth colour. Display, placement and provenance go into a variable of their own.

    Raises
    ------
    UsageError, PictureError, OutputError
        If h5py is not installed, the display's views are not what a grid of cameras sees, or the file cannot be
        written.
    """
    h5py = optional("h5py")
    check_rectangular(display, "LFToolbox")
    values = light_field.values
    if values.dtype == np.float16:
        values = values.astype(np.float32)
    if light_field.weight is not None:
        values = np.concatenate([values, weight_codes(light_field.weight, values.dtype)[..., None]], axis=-1)
    with replacing(path) as temporary:
        with h5py.File(temporary, "w", userblock_size=_USER_BLOCK) as file:
            reversed_ = values.transpose()
            # One view and one colour a chunk: what tools look at.
            chunks = (1, *reversed_.shape[1:3], 1, 1)
            stored = file.create_dataset(_VARIABLE, data=reversed_, chunks=chunks, compression="gzip", shuffle=True)
            stored.attrs["MATLAB_class"] = np.bytes_(_CLASSES[values.dtype.name])
            if note := to_note(light_field.metadata, LAYOUT):
                text = file.create_dataset(
                    TEXT_KEY, data=np.frombuffer(note.encode("ascii"), "u1").astype("u2")[:, None]
                )
                text.attrs["MATLAB_class"] = np.bytes_(b"char")
                text.attrs["MATLAB_int_decode"] = np.int32(2)
        with temporary.open("r+b") as raw:
            raw.write(_HEADER)


def read_matlab(path: Path) -> LightField:
    """Read ``LF`` of a ``.mat`` file: uint8, uint16, single, or double, which is rounded to single.

    Floats are taken for linear light.

    Raises
    ------
    UsageError, PictureError
        If the library that reads this version is not installed, or the file is missing, damaged, no ``.mat`` file, or
        has no light field in it.
    """
    try:
        with path.open("rb") as file:
            head = file.read(128)
    except FileNotFoundError:
        raise PictureError("is not there", where=str(path)) from None
    except OSError as error:
        raise PictureError(f"cannot be read: {error.strerror}", where=str(path)) from error
    version = head[124:128]
    if version in (b"\x00\x02IM", b"\x02\x00MI"):
        values, note = _read_hdf5(path)
    elif version in (b"\x00\x01IM", b"\x01\x00MI"):
        values, note = _read_version_5(path)
    else:
        raise PictureError("is no .mat file", where=str(path), rule="versions 5 to 7.3 are read")
    metadata = from_note(note, LAYOUT, str(path))
    if values.dtype == np.float64:
        values = values.astype(np.float32)
    maps = {} if values.shape[4] == 3 else {WEIGHT: weights(values[..., 3])}
    try:
        return LightField(values[..., :3], metadata, maps)
    except PictureError as error:
        raise PictureError(error.what, where=str(path), rule=error.rule) from None


def _check_variable(shape: tuple[int, ...], names: list[str], path: Path) -> None:
    """Refuses before anything is loaded what is no light field; an empty shape says that there is no such variable."""
    if not shape:
        held = ", ".join(names) or "nothing"
        raise PictureError(f"has no variable {_VARIABLE}; it holds {held}", where=str(path))
    if len(shape) != 5 or shape[4] not in (3, 4):
        rule = "it must be [t, s, v, u, c] with 3 colours, or 4 with a weight"
        raise PictureError(f"{_VARIABLE} has the shape {shape}", where=str(path), rule=rule)
    check_shape((*shape[:4], 3), str(path))


def _no_numbers(name: str, kind: str, path: Path) -> PictureError:
    return PictureError(f"{name} holds {kind}", where=str(path), rule="a light field holds numbers")


def _read_hdf5(path: Path) -> tuple[NDArray[Any], str]:
    h5py = optional("h5py")
    try:
        with h5py.File(path, "r") as file:
            names = [name for name in map(str, file) if not name.startswith("#")]  # bytes that are no text stay bytes
            found = _dataset(h5py, file, _VARIABLE, path)
            shape = () if found is None else found.shape or ()  # an array can have no shape at all
            _check_variable(shape[::-1], names, path)
            note = _dataset(h5py, file, TEXT_KEY, path)
            text = "" if note is None else _text(note, path)
            values: NDArray[Any] = found[...].transpose()
    except (OSError, RuntimeError, KeyError, UnicodeDecodeError) as error:
        raise _damaged(path, error) from error
    return values, text


def _dataset(h5py: Any, file: Any, name: str, path: Path) -> Any:
    """The array of that name, not yet read; None if there is none.

    HDF5 can take values from other files, and load programs that unpack them.

    Raises
    ------
    PictureError
        If its values lie in another file, it holds no numbers, or it is packed by a filter that is not read.
    """
    link = file.get(name, getlink=True)
    if link is None:
        return None
    rule = "a variable lies in the file itself"
    if not isinstance(link, h5py.HardLink):
        raise PictureError(f"{name} is a link", where=str(path), rule=rule)
    found = file.get(name)
    if not isinstance(found, h5py.Dataset):
        return None
    if found.is_virtual or found.external:
        raise PictureError(f"{name} is kept in another file", where=str(path), rule=rule)
    if found.dtype.kind not in "uif":
        raise _no_numbers(name, str(found.dtype), path)
    how = found.id.get_create_plist()
    for number in (how.get_filter(place)[0] for place in range(how.get_nfilters())):
        if number not in _FILTERS:
            rule = f"read are {', '.join(_FILTERS.values())}"
            raise PictureError(f"{name} is packed by the HDF5 filter {number}", where=str(path), rule=rule)
    return found


def _text(note: Any, path: Path) -> str:
    """The text of a variable of characters."""
    if note.size is None or note.size > _MOST_TEXT:
        rule = f"it has at most {_MOST_TEXT} characters"
        raise PictureError(f"{TEXT_KEY} has the shape {note.shape}", where=str(path), rule=rule)
    return bytes(note[...].astype("u1").ravel()).decode("ascii")


def _read_version_5(path: Path) -> tuple[NDArray[Any], str]:
    optional("scipy")
    from scipy import io

    try:
        # Mapped: a plain file gives memory to as many bytes as a damaged header asks for.
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            variables = {name: (shape, kind) for name, shape, kind in io.whosmat(content)}
            shape, kind = variables.get(_VARIABLE, ((), ""))
            _check_variable(shape, sorted(variables), path)
            if kind not in _NUMBERS:  # cells, structures, objects and functions hold anything
                raise _no_numbers(_VARIABLE, f"the class {kind}", path)
            values: NDArray[Any] = io.loadmat(content, variable_names=[_VARIABLE])[_VARIABLE]
    except PictureError:
        raise
    except Exception as error:  # the reader stumbles over damaged files in every way there is
        raise _damaged(path, error) from error
    if values.dtype.kind not in "uif":
        raise _no_numbers(_VARIABLE, str(values.dtype), path)
    return values, ""


def _damaged(path: Path, error: Exception) -> PictureError:
    return PictureError(f"this .mat file is damaged: {error}", where=str(path), fix="make or fetch it anew")
