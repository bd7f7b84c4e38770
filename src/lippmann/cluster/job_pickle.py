"""Serialized jobs: arrays and files become parts named by their content, so that each is sent to a cluster once."""

from __future__ import annotations

import hashlib
import io
import pickle
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import ClusterError, UsageError
from lippmann.scene.mitsuba_source import MitsubaSource
from lippmann.scene.mitsuba_xml import MitsubaXml
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import SceneDescription
from lippmann.tiles.job import TileJob, find_xml

#: Arrays with fewer bytes stay in the outline.
SMALLEST_PART = 4096

_HASH = hashlib.sha256
_REDUCED = (TileJob, Scene, SceneDescription, MitsubaSource, MitsubaXml)


@dataclass(frozen=True, eq=False)
class Parcel:
    """A serialized job in parts.

    Attributes
    ----------
    key:
        SHA-256 of the whole job; equal jobs have equal keys.
    outline:
        ``(n,)`` uint8: the pickled job without its parts.
    names:
        Content hashes of the parts, in the order of the arguments of :func:`unpack`.
    parts:
        Arrays and contents of files by content hash.
    """

    key: str
    outline: NDArray[np.uint8]
    names: tuple[str, ...]
    parts: Mapping[str, NDArray[np.generic]]


def pack(job: object) -> Parcel:
    """Serialize a job in parts: any value that can be pickled, of the kinds of :mod:`lippmann.cluster.tasks`.

    Raises
    ------
    UsageError
        If the scene is a Mitsuba object, or a Mitsuba file refers to files outside its own folder.
    """
    parts: dict[str, NDArray[np.generic]] = {}
    stream = io.BytesIO()
    _Packer(stream, parts).dump(job)
    outline = stream.getvalue()
    names = tuple(sorted(parts))
    return Parcel(_HASH(outline).hexdigest(), np.frombuffer(outline, np.uint8), names, parts)


def unpack(
    key: str, outline: NDArray[np.uint8], names: Sequence[str], parts: Sequence[NDArray[np.generic]], folder: Path
) -> Any:
    """Restore a job that :func:`pack` serialized.

    Parameters
    ----------
    key:
        SHA-256 of the whole job.
    outline:
        ``(n,)`` uint8: the pickled job without its parts.
    names:
        Content hashes of the parts.
    parts:
        The parts in the order of ``names``.
    folder:
        Existing folder into which the files of a Mitsuba scene are written.

    Raises
    ------
    ClusterError
        If the outline or a part does not have the content of its hash, or a part is missing.
    """
    # Before anything is restored: a damaged outline could stand for any object.
    if _HASH(outline.tobytes()).hexdigest() != key or len(names) != len(parts):
        raise ClusterError("the outline of the scene was damaged in transit")
    by_name = dict(zip(names, parts, strict=True))
    for name, part in by_name.items():
        if content_name(part) != name:
            raise ClusterError("a part of the scene was damaged in transit")
    return _Unpacker(io.BytesIO(outline.tobytes()), by_name, folder).load()


def content_name(array: NDArray[np.generic]) -> str:
    """SHA-256, in hexadecimal, of an array's type, shape and values."""
    digest = _HASH(f"{array.dtype.str}{array.shape}".encode())
    digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


@dataclass(frozen=True)
class _SceneFile:
    """A file that a Mitsuba scene reads: its path from the scene's folder, and where it lies."""

    key: str
    path: Path


class _Packer(pickle.Pickler):
    def __init__(self, stream: io.BytesIO, parts: dict[str, NDArray[np.generic]]) -> None:
        super().__init__(stream, protocol=5)
        self._parts = parts

    def persistent_id(self, value: Any) -> object:
        if isinstance(value, _SceneFile):
            return value.key, self._add(np.frombuffer(value.path.read_bytes(), np.uint8))
        if type(value) is not np.ndarray or value.dtype.hasobject or value.nbytes < SMALLEST_PART:
            return None
        return self._add(value)

    def reducer_override(self, value: Any) -> Any:
        """Scenes without what was derived of them (bounds, hashes), by which equal jobs would differ."""
        state = {part.name: getattr(value, part.name) for part in fields(value)} if type(value) in _REDUCED else {}
        if isinstance(value, Scene):
            # Forms of the same scene: whether several frames share them decides what is built anew.
            state |= {form: vars(value)[form] for form in ("classic", "physical") if form in vars(value)}
        elif isinstance(value, MitsubaSource):
            state |= {"content": find_xml(value), "_loaded": {}}
        elif isinstance(value, MitsubaXml):
            state["files"] = {key: _check_inside(key, path) for key, path in value.files.items()}
        return (object.__new__, (type(value),), state) if state else NotImplemented

    def _add(self, array: NDArray[np.generic]) -> str:
        name = content_name(array)
        self._parts.setdefault(name, np.ascontiguousarray(array))
        return name


def _check_inside(key: str, path: Path) -> _SceneFile:
    if PurePosixPath(key).is_absolute() or ".." in PurePosixPath(key).parts:
        raise UsageError(
            f"the scene names '{path}', which lies outside its folder",
            parameter="cluster",
            rule="only files of the scene's own folder are sent",
            fix="move it there",
        )
    return _SceneFile(key, path)


class _Unpacker(pickle.Unpickler):
    """Restores a job; the files of Mitsuba scenes are written into a folder."""

    def __init__(self, stream: io.BytesIO, parts: Mapping[str, NDArray[np.generic]], folder: Path) -> None:
        super().__init__(stream)
        self._parts = parts
        self._folder = folder

    def persistent_load(self, pid: Any) -> NDArray[np.generic] | Path:
        key, name = pid if isinstance(pid, tuple) else (None, pid)
        part = self._parts.get(name)
        if part is None:
            raise ClusterError("a part of the scene was lost in transit")
        if key is None:
            return part
        path: Path = self._folder / key
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(part.tobytes())
        return path
