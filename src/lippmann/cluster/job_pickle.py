"""A job cut into parts that travel by content: each array and file once, however many tiles and jobs need it."""

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
from lippmann.tiles.job import TileJob

#: Smaller arrays travel with what holds them.
SMALLEST_PART = 4096

_HASH = hashlib.sha256


@dataclass(frozen=True, eq=False)
class Parcel:
    """A job in parts.

    Attributes
    ----------
    key:
        Stands for the whole content.
    outline:
        The job with its parts left out, as bytes.
    names:
        Content hashes of the parts, in the order in which :meth:`unpack` wants them.
    parts:
        The parts by content hash.
    """

    key: str
    outline: NDArray[np.uint8]
    names: tuple[str, ...]
    parts: Mapping[str, NDArray[Any]]


def pack(job: TileJob) -> Parcel:
    """Cut a job into parts.

    Raises
    ------
    UsageError
        Its scene is an object of Mitsuba's, or a Mitsuba file names files outside its own folder.
    """
    parts: dict[str, NDArray[Any]] = {}
    files = _scene_files(job, parts)
    stream = io.BytesIO()
    # What was worked out on the way (a scene's bounds, its hash) would travel, too, and make equal jobs differ.
    plain = replace(job, scene=replace(job.scene))
    if files is not None:
        plain = _with_files(plain, {})
    _Packer(stream, parts).dump((plain, files))
    outline = stream.getvalue()
    names = tuple(sorted(parts))
    return Parcel(_HASH(outline).hexdigest(), np.frombuffer(outline, np.uint8), names, parts)


def unpack(outline: NDArray[np.uint8], names: Sequence[str], parts: Sequence[NDArray[Any]], folder: Path) -> TileJob:
    """The job of :func:`pack`; scene files, where it has any, are written into ``folder``.

    Raises
    ------
    ClusterError
        A part has not the content that its name stands for.
    """
    by_name = dict(zip(names, parts, strict=True))
    for name, part in by_name.items():
        if content_name(part) != name:
            raise ClusterError("a part of the scene was damaged on the way")
    job, files = _Unpacker(io.BytesIO(outline.tobytes()), by_name).load()
    assert isinstance(job, TileJob)
    if files is None:
        return job
    there = {}
    for key, name in files.items():
        there[key] = path = folder.joinpath(*PurePosixPath(key).parts)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(by_name[name].tobytes())
    return _with_files(job, there)


def content_name(array: NDArray[Any]) -> str:
    """The hash of an array's type, shape and values."""
    found = _HASH(f"{array.dtype.str}{array.shape}".encode())
    found.update(np.ascontiguousarray(array).data)
    return found.hexdigest()


def _scene_files(job: TileJob, parts: dict[str, NDArray[Any]]) -> dict[str, str] | None:
    """The files that a Mitsuba scene reads, by key, and names of their content; None for other scenes."""
    described = job.scene.description
    if not isinstance(described, MitsubaSource):
        return None
    job.scene_hash  # noqa: B018 - refuses objects of Mitsuba's, with the reason
    assert isinstance(described.content, MitsubaXml)
    found: dict[str, str] = {}
    for key, path in described.content.files.items():
        if PurePosixPath(key).is_absolute() or ".." in PurePosixPath(key).parts:
            raise UsageError(
                f"the scene names '{path}', which lies outside its folder",
                where="--cluster",
                rule="a scene travels with the files of its own folder",
                fix="move it there",
            )
        content = np.frombuffer(path.read_bytes(), np.uint8)
        found[key] = name = content_name(content)
        parts[name] = content
    return found


def _with_files(job: TileJob, files: Mapping[str, Path]) -> TileJob:
    """The job with other places for the files of its Mitsuba scene, which is not loaded yet."""
    described = job.scene.description
    assert isinstance(described, MitsubaSource)
    described = replace(described, content=replace(described.content, files=files), _loaded={})
    return replace(job, scene=replace(job.scene, description=described))


class _Packer(pickle.Pickler):
    def __init__(self, stream: io.BytesIO, parts: dict[str, NDArray[Any]]) -> None:
        super().__init__(stream, protocol=5)
        self._parts = parts

    def persistent_id(self, value: Any) -> str | None:
        if type(value) is not np.ndarray or value.dtype.hasobject or value.nbytes < SMALLEST_PART:
            return None
        name = content_name(value)
        self._parts.setdefault(name, np.ascontiguousarray(value))
        return name


class _Unpacker(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, parts: Mapping[str, NDArray[Any]]) -> None:
        super().__init__(stream)
        self._parts = parts

    def persistent_load(self, name: Any) -> NDArray[Any]:
        return self._parts[name]
