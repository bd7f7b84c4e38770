"""Files of the Light Field Toolbox for MATLAB (D. Dansereau): a variable ``LF`` in a ``.mat`` file.

``LF`` is ``[t, s, v, u, c]`` (uint8, uint16 or single): ``s`` and ``t`` count the views across and down, ``u`` and
``v`` the pixels of a view. A fourth colour holds the weight of each value. One of grey has no ``c``, since MATLAB drops
last dimensions of 1. Files are written in version 7.3 (HDF5),
where the axes are reversed, since MATLAB is column-major. Versions 5 to 7 are read as well.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.exchange.light_field import (
    WEIGHT,
    LightField,
    check_rectangular,
    check_shape,
    decode_weights,
    encode_weights,
)
from lippmann.exchange.matlab5 import Matlab5Error, read_variables
from lippmann.exchange.metadata_text import TEXT_KEY, from_note, to_note
from lippmann.exchange.optional_import import optional
from lippmann.runtime.atomic_write import replacing
from lippmann.runtime.machine import check_input
from lippmann.runtime.regular_file import check_kind, unreadable

LAYOUT = "lftoolbox"

#: The header that MATLAB requires before the HDF5 part: text, a version, and the byte order.
_USER_BLOCK = 512
_HEADER = b"MATLAB 7.3 MAT-file, written by Lippmann".ljust(116) + b"\0" * 8 + b"\x00\x02IM"

_CLASSES = {"uint8": b"uint8", "uint16": b"uint16", "float32": b"single"}
_VARIABLE = "LF"

#: HDF5 filters that are accepted, by number. HDF5 would load others as plugins.
_FILTERS = {1: "deflate", 2: "shuffle", 3: "fletcher32", 32000: "lzf"}

#: Limit on characters of the metadata text, which has some thousand.
_MOST_TEXT = 1 << 22


def write_matlab(light_field: LightField, display: Display, path: Path) -> None:
    """Write a ``.mat`` file of version 7.3, losslessly compressed.

    Display, placement and provenance become a variable of their own.

    Parameters
    ----------
    light_field:
        The views; half floats become single floats. A map ``weight`` becomes the fourth colour.
    display:
        The display whose views these are.
    path:
        The file; appears whole or not at all.

    Raises
    ------
    UsageError
        If h5py is not installed.
    PictureError
        If the display's views are not those of a rectangular grid of cameras.
    OutputError
        If the file cannot be written.
    """
    h5py = optional("h5py")
    check_rectangular(display, "LFToolbox")
    values: NDArray[Any] = light_field.values
    if values.dtype == np.float16:
        values = values.astype(np.float32)
    if light_field.weight is not None:
        values = np.concatenate([values, encode_weights(light_field.weight, values.dtype)[..., None]], axis=-1)
    # In memory, and written by Python: where a disk is full the library would end the process.
    with h5py.File(path.name, "w", driver="core", backing_store=False) as file:
        reversed_ = values.transpose()
        # One colour of one view per chunk, the part that tools display.
        chunks = (1, *reversed_.shape[1:3], 1, 1)
        stored = file.create_dataset(_VARIABLE, data=reversed_, chunks=chunks, compression="gzip", shuffle=True)
        stored.attrs["MATLAB_class"] = np.bytes_(_CLASSES[values.dtype.name])
        if note := to_note(light_field.metadata, LAYOUT):
            text = file.create_dataset(TEXT_KEY, data=np.frombuffer(note.encode("ascii"), "u1").astype("u2")[:, None])
            text.attrs["MATLAB_class"] = np.bytes_(b"char")
            text.attrs["MATLAB_int_decode"] = np.int32(2)
        file.flush()
        image = file.id.get_file_image()
    with replacing(path) as temporary, temporary.open("wb") as raw:
        raw.write(_HEADER.ljust(_USER_BLOCK, b"\0"))
        raw.write(image)


def read_matlab(path: Path) -> LightField:
    """Read the variable ``LF`` of a ``.mat`` file, version 5 to 7.3.

    Its type is uint8, uint16, single, or double, which is rounded to single. Floats are linear light.

    Raises
    ------
    UsageError
        If h5py is not installed, for version 7.3.
    PictureError
        If the file is missing, damaged or no ``.mat`` file, or holds no light field.
    """
    check_kind(path, PictureError)
    try:
        with path.open("rb") as file:
            head = file.read(128)
    except OSError as error:
        raise unreadable(path, error, PictureError) from error
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
    values = values.reshape(*values.shape[:4], -1)
    if values.shape[4] == 1:
        values = np.repeat(values, 3, axis=4)
    maps = {WEIGHT: decode_weights(values[..., 3])} if values.shape[4] == 4 else {}
    try:
        return LightField(values[..., :3], metadata, maps)
    except PictureError as error:
        raise PictureError(error.what, where=str(path), rule=error.rule) from None


def _check_variable(shape: tuple[int, ...], names: list[str], path: Path) -> None:
    """Raise :class:`PictureError` if ``LF`` is no light field; ``()`` stands for a missing ``LF``."""
    if not shape:
        held = ", ".join(names) or "nothing"
        raise PictureError(f"has no variable {_VARIABLE}; it holds {held}", where=str(path))
    if len(shape) not in (4, 5) or shape[4:] not in ((), (1,), (3,), (4,)):
        rule = "it must be [t, s, v, u, c] with 1 or 3 colours, or 4 with a weight"
        raise PictureError(f"{_VARIABLE} has the shape {shape}", where=str(path), rule=rule)
    check_shape((*shape[:4], 3), str(path))


def _not_numeric(name: str, kind: str, path: Path) -> PictureError:
    fix = f"in MATLAB: {name} = {name}.{name}; save('lf.mat', '{name}', '-v7.3')" if "struct" in kind else ""
    return PictureError(f"{name} holds {kind}", where=str(path), rule="a light field holds numbers", fix=fix)


def _read_hdf5(path: Path) -> tuple[NDArray[Any], str]:
    h5py = optional("h5py")
    try:
        with h5py.File(path, "r") as file:
            names = [name for name in map(str, file) if not name.startswith("#")]
            light_field = _dataset(h5py, file, _VARIABLE, path)
            # The 4D Light Field Benchmark's LF.mat is a structure, whose field LF holds the views.
            if light_field is None and file.get(_VARIABLE, getclass=True) is h5py.Group:
                light_field = _dataset(h5py, file, f"{_VARIABLE}/{_VARIABLE}", path)
            shape = () if light_field is None else light_field.shape or ()  # a null dataset has no shape
            _check_variable(shape[::-1], names, path)
            note = _dataset(h5py, file, TEXT_KEY, path)
            text = "" if note is None else _text(note, path)
            values: NDArray[Any] = light_field[...].transpose()
    except (OSError, RuntimeError, KeyError, UnicodeDecodeError) as error:
        raise _damaged(path, error) from error
    return values, text


def _dataset(h5py: Any, file: Any, name: str, path: Path) -> Any:
    """The HDF5 dataset of that name, not yet read; None if there is none.

    HDF5 can read values from other files and load filter plugins, which run code: both raise :class:`PictureError`, as
    does a dataset that is not numeric.
    """
    link = file.get(name, getlink=True)
    if link is None:
        return None
    rule = "variables must be in the file itself"
    if not isinstance(link, h5py.HardLink):
        raise PictureError(f"{name} is a link", where=str(path), rule=rule)
    dataset = file.get(name)
    if not isinstance(dataset, h5py.Dataset):
        return None
    if dataset.is_virtual or dataset.external:
        raise PictureError(f"{name} lies in another file", where=str(path), rule=rule)
    if dataset.dtype.kind not in "uif":
        raise _not_numeric(name, str(dataset.dtype), path)
    properties = dataset.id.get_create_plist()
    for number in (properties.get_filter(i)[0] for i in range(properties.get_nfilters())):
        if number not in _FILTERS:
            rule = f"accepted are {', '.join(_FILTERS.values())}"
            raise PictureError(f"{name} is compressed by the HDF5 filter {number}", where=str(path), rule=rule)
    return dataset


def _text(note: Any, path: Path) -> str:
    """The text of a variable of characters."""
    if note.size is None or note.size > _MOST_TEXT:
        rule = f"it has at most {_MOST_TEXT} characters"
        raise PictureError(f"{TEXT_KEY} has the shape {note.shape}", where=str(path), rule=rule)
    return bytes(note[...].astype("u1").ravel()).decode("ascii")


def _read_version_5(path: Path) -> tuple[NDArray[Any], str]:
    try:
        check_input(path.stat().st_size, "the file", where=str(path))
        variables = {variable.name: variable for variable in read_variables(path.read_bytes())}
        array = variables.get(_VARIABLE)
        if array is not None and not array.is_numeric:  # cells, structures, objects or functions
            raise _not_numeric(_VARIABLE, f"the class {array.kind}", path)
        _check_variable(() if array is None else array.shape, sorted(variables), path)
        assert array is not None
        values: NDArray[Any] = array.values(str(path))
    except (Matlab5Error, OSError) as error:
        raise _damaged(path, error) from error
    return values, ""


def _damaged(path: Path, error: Exception) -> PictureError:
    return PictureError(f"this .mat file is damaged: {error}", where=str(path), fix="make or fetch it anew")
