"""Models and environments dropped onto the page, with the files that they name: kept beside the outputs.

A drop is written into a folder that is named after its content. States, command lines and unfinished pictures that name
a file of it stay valid when the studio has ended, and what is dropped twice is kept once.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import AsyncIterator
from dataclasses import dataclass
from http import HTTPStatus
from pathlib import Path, PurePosixPath

import anyio
from starlette.requests import ClientDisconnect, Request

from lippmann.errors import SceneError
from lippmann.runtime.atomic_write import disk_name, reason_and_fix, sweep, temporary_folder
from lippmann.scene.readers.load import unknown_kind
from lippmann.studio_app.dropped_scene import ENVIRONMENTS, main_file
from lippmann.viewer.responses import RefusedError
from lippmann.viewer.site_application import check_body

#: Bytes of one drop, and of all that one studio takes.
MOST_BYTES = 1 << 29
MOST_BYTES_IN_ALL = 1 << 31

#: Files of one drop, how deep they may lie, and bytes of the list of them.
_MOST_FILES, _MOST_DEPTH, _MOST_LIST = 10_000, 8, 1 << 20

#: Bytes of a file's name on disk.
_MOST_NAME = 200


@dataclass(frozen=True)
class Dropped:
    """A drop on disk.

    Attributes
    ----------
    path:
        The scene or the environment: a file, or a folder of slices.
    name:
        Its name as it was dropped; on disk it may be shorter.
    folder:
        What the drop lies in.
    size:
        Bytes that it takes.
    is_new:
        Whether nothing of the same content was kept before.
    """

    path: Path
    name: str
    folder: Path
    size: int
    is_new: bool


class Uploads:
    """Folder of what was dropped onto the pages of a studio.

    Parameters
    ----------
    folder:
        Created with the first drop; other users cannot read it.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._bytes = 0

    def holds(self, path: Path) -> bool:
        """Whether a file was dropped onto this studio or an earlier one of the same folder, and is still there."""
        return path.exists() and path.resolve().is_relative_to(self._folder.resolve())

    async def receive(self, name: str, request: Request) -> Dropped:
        """Keep the body of a request.

        Parameters
        ----------
        name:
            Name of the file that is the body. If it is empty, the body holds several files: a line of JSON, a list of
            ``[name, bytes]``, and then the files in this order. Their names may begin with those of folders.
        request:
            POST of ``application/octet-stream``.

        Raises
        ------
        RefusedError
            A name is not allowed, there are too many bytes, or they cannot be written.
        SceneError
            None of several files, or more than one, is the scene.
        """
        length = check_body(request, "application/octet-stream", MOST_BYTES)
        places = [_place(name)] if name else []
        if name and (error := _unknown(name, places[0])) is not None:
            raise RefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, str(error))
        if self._bytes + length > MOST_BYTES_IN_ALL:
            raise RefusedError(HTTPStatus.INSUFFICIENT_STORAGE, "too many models were dropped; start the studio anew")
        self._bytes += length
        is_new = False
        part = temporary_folder(self._folder / "drop")
        try:
            self._folder.mkdir(mode=0o700, exist_ok=True)
            sweep(self._folder / "drop")
            part.mkdir()
            body = _Body(request.stream())
            if name:
                names, sizes = [name], [length]
            else:
                names, sizes = _list_of(await body.line(), length)
                places = [_place(each) for each in names]
                if len(names) == 1 and (error := _unknown(names[0], places[0])) is not None:
                    raise error
            digest = hashlib.sha256()
            for place, size in zip(places, sizes, strict=True):
                digest.update(f"{place.as_posix()}\0{size}\0".encode("utf-8", "surrogateescape"))
                (part / place).parent.mkdir(parents=True, exist_ok=True)
                async with await anyio.open_file(part / place, "xb") as file:
                    async for chunk in body.parts(size):
                        digest.update(chunk)
                        await file.write(chunk)
            main = main_file(part, places)
            folder = self._folder / digest.hexdigest()[:12]
            if not folder.is_dir():
                part.rename(folder)
                is_new = True
        except (OSError, ClientDisconnect) as error:
            raise _refusal(error) from None
        finally:
            shutil.rmtree(part, ignore_errors=True)
            if not is_new:
                self._bytes -= length
        title = names[places.index(main)] if main in places else main.name or names[0]
        return Dropped(folder / main, PurePosixPath(title).name, folder, length, is_new)

    def discard(self, dropped: Dropped) -> None:
        """Remove a drop that cannot be opened, if it was kept for the first time."""
        if dropped.is_new:
            self._bytes -= dropped.size
            shutil.rmtree(dropped.folder, ignore_errors=True)


class _Body:
    """The body of a request, to be read in pieces."""

    def __init__(self, chunks: AsyncIterator[bytes]) -> None:
        self._chunks = chunks
        self._rest = b""

    async def line(self) -> bytes:
        while b"\n" not in self._rest and len(self._rest) <= _MOST_LIST:
            self._rest += await self._next()
        line, _, self._rest = self._rest.partition(b"\n")
        return line

    async def parts(self, size: int) -> AsyncIterator[bytes]:
        while size > 0:
            self._rest = self._rest or await self._next()
            chunk, self._rest = self._rest[:size], self._rest[size:]
            size -= len(chunk)
            yield chunk

    async def _next(self) -> bytes:
        async for chunk in self._chunks:
            if chunk:
                return chunk
        raise RefusedError(HTTPStatus.BAD_REQUEST, "the files are shorter than was said")


def _list_of(line: bytes, length: int) -> tuple[list[str], list[int]]:
    """Names and sizes of the files of a body."""
    try:
        listed = json.loads(line)
        names, sizes = [str(name) for name, _ in listed], [size for _, size in listed]
        is_whole = all(type(size) is int and size >= 0 for size in sizes) and sum(sizes) + len(line) + 1 == length
    except (ValueError, TypeError, RecursionError):
        is_whole = False
    if not is_whole or not 1 <= len(listed) <= _MOST_FILES:
        raise RefusedError(HTTPStatus.BAD_REQUEST, f"this is no list of 1 to {_MOST_FILES} files")
    return names, sizes


def _place(name: str) -> Path:
    """The place on disk of a file of any name, within the drop's folder."""
    parts = name.split("/")
    is_control = any(ord(letter) < 0x20 or 0x7F <= ord(letter) < 0xA0 for letter in name)
    if is_control or len(parts) > _MOST_DEPTH or any(part.strip() in ("", ".", "..") for part in parts):
        raise RefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, f"{name[:60]!r}: this is no name of a file")
    return Path(*(_short(part) for part in parts))


def _unknown(name: str, place: Path) -> SceneError | None:
    """The error of a single file whose ending is neither that of a scene nor that of an environment."""
    error = None if place.suffix.lower() in ENVIRONMENTS else unknown_kind(place)
    return error and SceneError("this cannot be opened", where=name[:60], rule=error.fix or error.rule)


def _short(name: str) -> str:
    """A name on disk, with its whole ending."""
    endings = "".join(Path(name).suffixes[-2:]) if name.lower().endswith(".nii.gz") else Path(name).suffix
    if len(endings) > _MOST_NAME // 4:
        endings = ""
    return disk_name(name.removesuffix(endings), _MOST_NAME) + disk_name(endings, _MOST_NAME)


def _refusal(error: Exception) -> Exception:
    """Answer to the page for an error while a drop was received."""
    if isinstance(error, ClientDisconnect):
        return ConnectionAbortedError()
    if isinstance(error, FileExistsError):
        return RefusedError(HTTPStatus.BAD_REQUEST, "two of the files have the same name")
    assert isinstance(error, OSError)
    said = "; ".join(filter(None, reason_and_fix(error)))
    return RefusedError(HTTPStatus.INSUFFICIENT_STORAGE, f"the file cannot be kept: {said}")
