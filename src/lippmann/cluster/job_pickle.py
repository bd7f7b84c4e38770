"""Serialized jobs: arrays and files become parts named by their content, so that each is sent to a cluster once."""

from __future__ import annotations

import hashlib
import io
import pickle
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import ClusterError, UsageError
from lippmann.scene.mitsuba_source import MitsubaSource
from lippmann.scene.mitsuba_xml import MitsubaXml
from lippmann.scene.values.description import SceneDescription
from lippmann.tiles.job import TileJob

#: Arrays with fewer bytes stay in the outline.
SMALLEST_PART = 4096

_HASH = hashlib.sha256
_INCOMPLETE = "a part of the scene was lost in transit"


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


def pack(job: TileJob) -> Parcel:
    """Serialize a job in parts.

    Raises
    ------
    UsageError
        If the scene is a Mitsuba object, or a Mitsuba file refers to files outside its own folder.
    """
    parts: dict[str, NDArray[np.generic]] = {}
    files = _scene_files(job, parts)
    stream = io.BytesIO()
    # Fresh copies drop cached values (a scene's bounds, its hash), by which equal jobs would differ.
    description = job.scene.description
    if isinstance(description, SceneDescription):
        description = replace(description)
    plain = replace(job, scene=replace(job.scene, description=description))
    if files is not None:
        plain = _with_files(plain, {})
    _Packer(stream, parts).dump((plain, files))
    outline = stream.getvalue()
    names = tuple(sorted(parts))
    return Parcel(_HASH(outline).hexdigest(), np.frombuffer(outline, np.uint8), names, parts)


def unpack(
    key: str, outline: NDArray[np.uint8], names: Sequence[str], parts: Sequence[NDArray[np.generic]], folder: Path
) -> TileJob:
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
    job, files = _Unpacker(io.BytesIO(outline.tobytes()), by_name).load()
    assert isinstance(job, TileJob)
    if files is None:
        return job
    if not by_name.keys() >= set(files.values()):
        raise ClusterError(_INCOMPLETE)
    paths = {}
    for key, name in files.items():
        paths[key] = path = folder.joinpath(*PurePosixPath(key).parts)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(by_name[name].tobytes())
    return _with_files(job, paths)


def content_name(array: NDArray[np.generic]) -> str:
    """SHA-256, in hexadecimal, of an array's type, shape and values."""
    digest = _HASH(f"{array.dtype.str}{array.shape}".encode())
    digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


def _scene_files(job: TileJob, parts: dict[str, NDArray[np.generic]]) -> dict[str, str] | None:
    """Content hashes of the files that a Mitsuba scene reads, by key; None for other scenes. Fills ``parts``."""
    described = job.scene.description
    if not isinstance(described, MitsubaSource):
        return None
    job.scene_hash  # noqa: B018 - raises UsageError for Mitsuba objects
    assert isinstance(described.content, MitsubaXml)
    names: dict[str, str] = {}
    for key, path in described.content.files.items():
        if PurePosixPath(key).is_absolute() or ".." in PurePosixPath(key).parts:
            raise UsageError(
                f"the scene names '{path}', which lies outside its folder",
                parameter="cluster",
                rule="only files of the scene's own folder are sent",
                fix="move it there",
            )
        content = np.frombuffer(path.read_bytes(), np.uint8)
        names[key] = name = content_name(content)
        parts[name] = content
    return names


def _with_files(job: TileJob, files: Mapping[str, Path]) -> TileJob:
    """The job with other paths of the files of its Mitsuba scene, which is not loaded yet."""
    described = job.scene.description
    assert isinstance(described, MitsubaSource)
    assert isinstance(described.content, MitsubaXml)
    described = replace(described, content=replace(described.content, files=files), _loaded={})
    return replace(job, scene=replace(job.scene, description=described))


class _Packer(pickle.Pickler):
    def __init__(self, stream: io.BytesIO, parts: dict[str, NDArray[np.generic]]) -> None:
        super().__init__(stream, protocol=5)
        self._parts = parts

    def persistent_id(self, value: Any) -> str | None:
        if type(value) is not np.ndarray or value.dtype.hasobject or value.nbytes < SMALLEST_PART:
            return None
        name = content_name(value)
        self._parts.setdefault(name, np.ascontiguousarray(value))
        return name


class _Unpacker(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, parts: Mapping[str, NDArray[np.generic]]) -> None:
        super().__init__(stream)
        self._parts = parts

    def persistent_load(self, name: Any) -> NDArray[np.generic]:
        if name not in self._parts:
            raise ClusterError(_INCOMPLETE)
        return self._parts[name]
