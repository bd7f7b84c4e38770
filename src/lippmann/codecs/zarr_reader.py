"""Zarr arrays opened for reading, without trust in what lies in their folder.

The library is given a store of our own. It holds the metadata that :mod:`lippmann.codecs.zarr_metadata` admitted,
written anew, and the files of chunks, each opened only as a plain file inside the folder and of a size that a chunk can
have. The library sees nothing else: no consolidated metadata, no other node, no file that a link leads to elsewhere,
and nothing that was changed after it was checked.
"""

from __future__ import annotations

import bz2
import json
import os
import stat
import zlib
from collections.abc import Callable, Iterator, MutableMapping
from pathlib import Path
from typing import Any, Literal

from lippmann.codecs.types import Attributes, ZarrArray, ZarrModule
from lippmann.codecs.zarr_metadata import ARRAY_2, ATTRIBUTES_2, GROUP_2, NODE_3, ArrayMetadata, admit
from lippmann.errors import PictureError
from lippmann.runtime.machine import check_input

#: Bytes of a file of metadata; a light field of ours has some thousand.
_MOST_METADATA = 1 << 22
#: Bytes that a packed chunk may have beyond its values: headers, check sums, the places of 16 bytes in a shard.
_SLACK = 1 << 16
_SLACK_PER_CHUNK = 64

#: Arrays of a group that a line names.
_MOST_NAMES = 8

_ZSTD = b"\x28\xb5\x2f\xfd"


def node_kind(folder: Path, root: Path | None = None) -> Literal["array", "group"] | None:
    """Whether a folder is a Zarr array or a group, in either version of the format, or neither.

    Parameters
    ----------
    root:
        The folder that links may not lead out of, by default ``folder`` itself.

    Raises
    ------
    PictureError
        If its metadata is damaged, or a link leads out of ``root``.
    """
    values = _json(folder, NODE_3, root or folder)
    if values is not None:
        kind = values.get("node_type")
        return kind if kind in ("array", "group") else None
    if _json(folder, ARRAY_2, root or folder) is not None:
        return "array"
    return None if _json(folder, GROUP_2, root or folder) is None else "group"


def array_names(group: Path) -> list[str]:
    """Paths of the arrays in a group and those below it, as far as :data:`_MOST_NAMES`; links are left alone."""
    names: list[str] = []
    groups = [group]
    while groups and len(names) < _MOST_NAMES:
        folder = groups.pop(0)
        for path in sorted(folder.iterdir()):
            if path.is_symlink() or not path.is_dir():
                continue
            kind = node_kind(path, group)
            if kind == "array":
                names.append(path.relative_to(group).as_posix())
            elif kind == "group" and len(groups) < _MOST_NAMES:
                groups.append(path)
    return names[:_MOST_NAMES]


def read_attributes(folder: Path) -> Attributes:
    """The attributes of an array or group; empty if it has none.

    Raises
    ------
    PictureError
        If they are damaged, or a link leads out of the folder.
    """
    return _attributes(folder, _json(folder, NODE_3, folder))


def read_array_metadata(folder: Path, root: Path | None = None) -> ArrayMetadata:
    """Metadata of an array, checked by :func:`lippmann.codecs.zarr_metadata.admit`.

    Raises
    ------
    PictureError
        If there is no array, or its metadata is not admitted.
    """
    return _array_metadata(folder, root or folder)[0]


def read_array(folder: Path) -> tuple[ArrayMetadata, Attributes]:
    """:func:`read_array_metadata` and :func:`read_attributes` together: each file is read once."""
    metadata, values = _array_metadata(folder, folder)
    return metadata, _attributes(folder, values if metadata.version == 3 else None)


def _array_metadata(folder: Path, root: Path) -> tuple[ArrayMetadata, Attributes]:
    """The metadata admitted, and the JSON object that holds it."""
    for name, version in ((NODE_3, 3), (ARRAY_2, 2)):
        values = _json(folder, name, root)
        if values is not None:
            return admit(values, version, str(folder / name)), values
    raise _damaged(folder, "there is no array in it")


def _attributes(folder: Path, node: Attributes | None) -> Attributes:
    """The attributes in the metadata of a node in format 3; without one, those of format 2, in a file of their own."""
    if node is None:
        return _json(folder, ATTRIBUTES_2, folder) or {}
    attributes = node.get("attributes") or {}
    if not isinstance(attributes, dict):
        raise _damaged(folder, "its attributes are no object")
    return attributes


def axis_names(metadata: ArrayMetadata, attributes: Attributes) -> tuple[str, ...]:
    """Names of an array's axes, by format 3 or as xarray keeps them in format 2; empty where not all have one."""
    names = metadata.document.get("dimension_names") or attributes.get("_ARRAY_DIMENSIONS")
    if not isinstance(names, list) or len(names) != len(metadata.shape):
        return ()
    return tuple(names) if all(isinstance(name, str) for name in names) else ()


def open_array(zarr: ZarrModule, folder: Path, metadata: ArrayMetadata, root: Path | None = None) -> ZarrArray:
    """The library's array of a folder; its values are read as they are asked for.

    Parameters
    ----------
    zarr:
        The library.
    metadata:
        Of :func:`read_array_metadata`.
    root:
        As of :func:`node_kind`.

    Raises
    ------
    PictureError
        If the array has too many chunks or the library cannot read it. Reading its values raises that too, or whatever
        the library stumbles with over damaged chunks.
    """
    metadata.check_chunks(str(folder))
    three = hasattr(zarr, "create_array")
    if metadata.version == 3 and not three:
        rule = f"the installed library zarr {zarr.__version__} reads format 2"
        raise PictureError("is in format 3 of Zarr", where=str(folder), rule=rule, fix="install zarr 3 or newer")
    files = _Files(folder, metadata, root or folder, _buffer if three else bytes)
    store = zarr.storage.MemoryStore(files, read_only=True) if three else files
    try:
        return zarr.open_array(store=store, mode="r")
    except Exception as error:  # whatever the library stumbles with over values that make no sense together
        raise _damaged(folder, str(error)) from error


def _buffer(data: bytes) -> Any:
    """Bytes as the library's third version takes them."""
    from zarr.core.buffer import default_buffer_prototype

    return default_buffer_prototype().buffer.from_bytes(data)


class _Files(MutableMapping[str, Any]):
    """The files of an array's folder by name, as the library sees them; they cannot be changed."""

    def __init__(self, folder: Path, metadata: ArrayMetadata, root: Path, wrapped: Callable[[bytes], Any]) -> None:
        self._folder = folder
        self._root = root
        self._wrapped = wrapped
        self._names = metadata.chunk_names
        self._packing = metadata.packing
        self._most = metadata.chunk_bytes
        self._slack = self._most // 64 + _SLACK + _SLACK_PER_CHUNK * metadata.chunks_of_a_shard
        name = NODE_3 if metadata.version == 3 else ARRAY_2
        self._documents = {name: json.dumps(metadata.document).encode()}
        self._last: tuple[str, Any] | None = None

    def __getitem__(self, key: str) -> Any:
        if key in self._documents:
            return self._wrapped(self._documents[key])
        last = self._last
        if last is not None and last[0] == key:  # the library asks for a shard once for each of its chunks
            return last[1]
        if not self._names.fullmatch(key):
            raise KeyError(key)
        data = _file_inside(self._folder, key, self._root, self._most + self._slack)
        if data is None:
            raise KeyError(key)
        # Unpacked, and again while the library brings it into its own order.
        check_input(2 * self._most, f"its chunk {key}", where=str(self._folder))
        _check_expansion(self._packing, data, self._most, self._folder, key)
        chunk = self._wrapped(data)
        self._last = key, chunk
        return chunk

    def __contains__(self, key: object) -> bool:
        if not isinstance(key, str):
            return False
        return key in self._documents or (bool(self._names.fullmatch(key)) and os.path.lexists(self._folder / key))

    def __iter__(self) -> Iterator[str]:
        return iter(self._documents)

    def __len__(self) -> int:
        return len(self._documents)

    def __setitem__(self, key: str, value: Any) -> None:
        raise TypeError("an array opened for reading cannot be changed")

    def __delitem__(self, key: str) -> None:
        raise TypeError("an array opened for reading cannot be changed")


def _json(folder: Path, name: str, root: Path) -> Attributes | None:
    """The object of a JSON file; None if there is no such file."""
    data = _file_inside(folder, name, root, _MOST_METADATA)
    if data is None:
        return None
    try:
        values = json.loads(data)
    except (ValueError, RecursionError):
        values = None
    if not isinstance(values, dict):
        raise _damaged(folder, f"{name} holds no JSON object")
    return values


def _file_inside(folder: Path, name: str, root: Path, most: int) -> bytes | None:
    """The content of a plain file inside ``root``, wherever links lead; None if there is none.

    Raises
    ------
    PictureError
        If it lies outside, is no plain file, or has more than ``most`` bytes.
    """
    try:
        place = (folder / name).resolve(strict=True)
        inside = place.is_relative_to(root.resolve(strict=True))
    except (FileNotFoundError, NotADirectoryError):
        if (folder / name).is_symlink():
            raise _damaged(folder, f"{name} is a link that leads nowhere") from None
        return None
    except (OSError, RuntimeError, ValueError) as error:  # links that run in a circle, a name that no file can have
        raise _damaged(folder, f"{name} is no name of a file") from error
    if not inside:
        raise PictureError(
            f"{name} is a link that leads out of the folder",
            where=str(folder),
            rule="the files of a Zarr array lie in its folder",
            fix="put the file itself there",
        )
    try:
        # Links were followed above; a pipe would be waited for.
        descriptor = os.open(place, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise PictureError(f"{name} cannot be read: {error.strerror}", where=str(folder)) from error
    with open(descriptor, "rb") as file:
        about = os.fstat(file.fileno())
        if not stat.S_ISREG(about.st_mode):
            raise _damaged(folder, f"{name} is no plain file")
        if about.st_size > most:
            raise _damaged(folder, f"{name} has {about.st_size} bytes, and needs at most {most}")
        return file.read(most)


def _check_expansion(packing: str, data: bytes, most: int, folder: Path, name: str) -> None:
    """Refuse a packed chunk that unpacks to more than a chunk holds, before memory is given to it."""
    size = _packed_size(packing, data, most)
    if size is None:
        raise _damaged(folder, f"{name} is nothing that {packing} packs, or does not say its size")
    if size > most:
        raise _damaged(folder, f"{name} unpacks to more than the {most} bytes of a chunk")


def _packed_size(packing: str, data: bytes, most: int) -> int | None:
    """Bytes that a chunk says it unpacks to, or more than ``most``; None if it says nothing of the kind."""
    if packing == "zstd":
        return _zstd_size(data)
    if packing == "blosc":
        return int.from_bytes(data[4:8], "little") if len(data) >= 16 else None
    if packing == "lz4":
        return int.from_bytes(data[:4], "little") if len(data) >= 4 else None
    if packing in ("gzip", "zlib", "bz2"):
        return _unpacked_size(zlib.decompressobj(47) if packing != "bz2" else bz2.BZ2Decompressor(), data, most)
    return 0


def _zstd_size(data: bytes) -> int | None:
    """The content size in the header of a Zstandard frame (RFC 8878, 3.1.1.1); None if it is absent."""
    if data[:4] != _ZSTD or len(data) < 6:
        return None
    single = bool(data[4] & 0x20)
    place = 5 + (not single) + (0, 1, 2, 4)[data[4] & 3]
    length = (1 if single else 0, 2, 4, 8)[data[4] >> 6]
    if not length or len(data) < place + length:
        return None
    return int.from_bytes(data[place : place + length], "little") + (256 if length == 2 else 0)


def _unpacked_size(unpacker: Any, data: bytes, most: int) -> int | None:
    """Bytes that a stream unpacks to, counted up to ``most`` + 1; None if it is damaged or more than one stream."""
    step, size = 1 << 20, 0
    try:
        while not unpacker.eof and size <= most:
            part = unpacker.decompress(data, step)
            data = getattr(unpacker, "unconsumed_tail", b"")
            size += len(part)
            if not part and not data:
                break
    except (zlib.error, OSError):
        return None
    return None if unpacker.unused_data else size


def _damaged(folder: Path, what: str) -> PictureError:
    return PictureError(f"is damaged: {what}", where=str(folder), fix="make it anew")
