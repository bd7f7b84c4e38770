"""Files that a scene file names: where they may lie, and how their pictures become texels."""

from __future__ import annotations

import codecs
import io
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.orientation import as_stored, of_picture
from lippmann.codecs.pillow_formats import RULE, codes_of, is_allowed, open_picture, with_plain_blocks
from lippmann.errors import MemoryLimitError, PictureError, SceneError
from lippmann.runtime.machine import check_input
from lippmann.runtime.regular_file import check_kind, near_miss, unreadable
from lippmann.scene.values.description import Image

if TYPE_CHECKING:
    from PIL import Image as Pillow


#: Endings of files that name other files.
_NAMING_FILES = frozenset(
    {
        *(".blend", ".dat", ".fbx", ".glb", ".gltf", ".mhd", ".mtl", ".nff", ".nhdr", ".obj", ".ply", ".stl"),
        *(".usd", ".usda", ".usdc", ".usdz", ".xml"),
    }
)


class MissingFileError(SceneError):
    """A file that a scene file names and that is not found, or a picture in a variety that is not decoded."""

    def note(self, consequence: str) -> str:
        """The line that says what is missing, where it is named, and what is shown instead."""
        return f"{self.where}: {self.what}{f' ({self.fix})' if self.fix else ''}: {consequence}"


def read_bytes(path: Path, most: int = -1) -> bytes:
    """A scene file, or its first ``most`` bytes.

    Raises
    ------
    SceneError
        The file is missing, a folder, a pipe or device, unreadable or empty.
    MemoryLimitError
        It is larger than the memory that is left.
    """
    where = path.name
    try:
        if path.is_dir():
            raise SceneError(
                "is a folder, not a scene file",
                where=str(path),
                fix="name the file inside it; views are for 'lippmann weave'",
            )
        check_kind(path, SceneError)
        check_input(path.stat().st_size if most < 0 else most, "the file", where=where)
        with path.open("rb") as file:
            data = file.read(most)
    except OSError as error:
        raise unreadable(path, error, SceneError) from None
    if not data:
        raise SceneError("the file is empty", where=where)
    return data


def decode_text(data: bytes, where: str) -> str:
    """The text of an OBJ, MTL or similar file: UTF-16 with a byte order mark, UTF-8, else Latin-1 of old exporters.

    Lines that end as on the old Mac OS, by a carriage return alone, end by a line feed.

    Raises
    ------
    SceneError
        The bytes are not text.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        try:
            return _with_line_feeds(data.decode("utf-16"))
        except UnicodeDecodeError:
            raise SceneError("is no text in UTF-16, as which it begins", where=where) from None
    if data.endswith((b"\n\0\n", b"\n\0\r\n")):  # as ZBrush ends files
        data = data.rstrip(b"\0\r\n")
    if b"\0" in data[:4096]:
        raise SceneError("is not a text file", where=where, rule="this format is plain text")
    try:
        return _with_line_feeds(data.decode("utf-8-sig"))
    except UnicodeDecodeError:
        return _with_line_feeds(data.decode("latin-1"))


def _with_line_feeds(text: str) -> str:
    return text if "\n" in text else text.replace("\r", "\n")


@dataclass(frozen=True)
class NamedFiles:
    """The files that a scene file may name: those of its folder and below, links followed.

    Exporters on Windows write backslashes, absolute paths and names in another case, and files are sorted into folders
    afterwards: a path that leads nowhere, or out of the folder, means the one file of that name in the folder or in the
    folders directly below. Errors tell nothing of what lies outside.

    Attributes
    ----------
    folder:
        The scene file's folder.
    anywhere:
        Whether the scene file is trusted to name any file of the machine.
    """

    folder: Path
    anywhere: bool = False

    @classmethod
    def of(cls, path: Path, files: NamedFiles | None) -> NamedFiles:
        """``files``; without, those that a scene file of this path may name by itself."""
        return files or cls(path.parent)

    def find(self, name: str, *, where: str, what: str, folders: Sequence[Path] = ()) -> Path:
        """The file that ``name`` means, seen from the first of ``folders`` that has it; by default the scene's own.

        Parameters
        ----------
        where:
            File and line that speak of ``name``, for the error.
        what:
            The kind of file, such as "texture".

        Raises
        ------
        MissingFileError
            No such file.
        SceneError
            It may not be named.
        """
        plain = name.replace("\\", "/")
        absolute = _is_absolute(name)
        folders = folders or (self.folder,)
        candidates = [Path(plain)] if absolute else [folder / plain for folder in folders]
        inside = [candidate for candidate in candidates if _lies_in(candidate, self.folder)]
        allowed = candidates if self.anywhere else inside
        for candidate in allowed:
            if is_file(candidate):
                return candidate
        for folder in folders:
            meant = None if absolute else _in_any_case(folder, PurePosixPath(plain).parts)
            meant = meant or _by_name(folder, PurePosixPath(plain).name)
            if meant is not None and self.admits(meant):
                return meant
        if not allowed and any(_lies_in(candidate, self.folder) is False for candidate in candidates):
            raise _outside(name, where, what)
        raise MissingFileError(f"{what} '{name}' not found", where=where, fix=_similar(allowed[0]) if allowed else "")

    def find_on_line(self, body: str, *, where: str) -> Path:
        """The texture that the rest of a line names: all of it, spaces and all, or what stands before a comment; quotes
        around a name, as some exporters write them, are none of it."""
        names = names_on_line(body)
        name = next((name for name in names if is_file(self.folder / name)), names[-1])
        return self.find(name, where=where, what="texture")

    def find_folder(self, name: str, *, where: str, folders: Sequence[Path]) -> Path:
        """The search path that ``name`` means, in the first of ``folders`` that has it; errors as of :meth:`find`."""
        plain = name.replace("\\", "/")
        candidates = [Path(plain)] if _is_absolute(name) else [folder / plain for folder in folders]
        allowed = [candidate for candidate in candidates if self.admits(candidate)]
        if not allowed:
            raise _outside(name, where, "search path")
        for candidate in allowed:
            if is_folder(candidate):
                return candidate
        raise SceneError(f"search path '{name}' not found", where=where, rule="it must be a folder")

    def admits(self, path: Path) -> bool:
        """Whether the scene file may name a file, wherever links lead."""
        return self.anywhere or bool(_lies_in(path, self.folder))


def names_on_line(body: str) -> tuple[str, str, str]:
    """Names that the rest of a line may be: all of it, what stands before a comment, and that without quotes and the
    backslashes before its spaces."""
    plain = strip_comment(body)
    return body, plain, plain.strip('"').replace("\\ ", " ")


def strip_comment(body: str) -> str:
    """The rest of a line without the comment at its end: ``#`` begins one only after a space."""
    return re.split(r"\s#", body, maxsplit=1)[0].rstrip()


def _outside(name: str, where: str, what: str) -> SceneError:
    return SceneError(
        f"{what} '{name}' lies outside the scene's folder",
        where=where,
        rule="a scene file may name only files in its own folder and below",
        fix="move it there, or trust the scene file with allow_outside=True",
    )


def _is_absolute(name: str) -> bool:
    return PurePosixPath(name.replace("\\", "/")).is_absolute() or PureWindowsPath(name).is_absolute()


#: Limit on characters of a path: what systems allow.
_LONGEST_PATH = 4096


def _lies_in(path: Path, folder: Path) -> bool | None:
    """Whether a file lies in ``folder`` or deeper, wherever links lead; None of a name that no file can have."""
    if len(os.fspath(path)) > _LONGEST_PATH:  # each part of it would be looked up
        return None
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # a NUL, a name too long, links that run in a circle
        return None


def is_file(path: Path) -> bool:
    """Whether there is such a file; of a name that no file can have, there is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name too long, or with a NUL
        return False


def is_folder(path: Path) -> bool:
    """Whether there is such a folder; of a name that no folder can have, there is none."""
    try:
        return path.is_dir()
    except (OSError, ValueError):  # as above
        return False


def _in_any_case(folder: Path, parts: Sequence[str]) -> Path | None:
    """The one file at a path below ``folder``, in letters of any case; None where there are several, or none."""
    for part in parts:
        matches = [folder / part] if part in (".", "..") else _entries(folder, part)
        if len(matches) != 1:
            return None
        folder = matches[0]
    return folder if is_file(folder) else None


def _by_name(folder: Path, name: str) -> Path | None:
    """The file of a name in ``folder``; else, in letters of any case, the one in it or in a folder of it."""
    if is_file(folder / name):
        return folder / name
    places = [folder, *(entry for entry in _entries(folder) if is_folder(entry))]
    matches = [entry for place in places for entry in _entries(place, name) if is_file(entry)]
    return matches[0] if len(matches) == 1 else None


def _entries(folder: Path, name: str | None = None) -> list[Path]:
    """What a folder holds, or what of it has a name in letters of any case."""
    try:
        return [entry for entry in folder.iterdir() if name is None or entry.name.casefold() == name.casefold()]
    except (OSError, ValueError):
        return []


def _similar(path: Path) -> str:
    """A hint at the file that a scene file meant: none that names files itself, unless its ending is the same."""
    return near_miss(path, _NAMING_FILES - {path.suffix.lower()}, path.parent.name)


def read_image(path: Path, *, where: str) -> Image:
    """Decode a picture file; see :func:`decode_image`."""
    return decode_image(read_bytes(path), path.name, where=where)


def decode_image(data: bytes, name: str, *, where: str) -> Image:
    """Texels ``(h, w, 1 | 3 | 4)`` of an encoded picture: uint8, or float32 in [0, 1] where the file holds 16 bits.

    They lie as they are stored, whatever the picture's EXIF orientation.

    Raises
    ------
    SceneError
        The bytes are no picture of a format of :data:`lippmann.codecs.pillow_formats.FORMATS`, or are cut short.
    MissingFileError
        They are a DDS picture of a variety that Pillow does not decode.
    MemoryLimitError
        They take more than the memory that is left.
    """
    with decoding(f"texture '{name}'", where), open_picture(io.BytesIO(with_plain_blocks(data))) as picture:
        turn = of_picture(picture) if picture.format == "TIFF" else 1  # those alone Pillow turns by itself
        pixels = as_stored(texels_of(picture), turn)
    return Image(name, pixels)


@contextmanager
def decoding(what: str, where: str) -> Iterator[None]:
    """Errors of decoding ``what`` as those of the scene file ``where``."""
    from PIL import UnidentifiedImageError

    try:
        yield
    except MemoryLimitError as error:
        raise MemoryLimitError(f"{what}: {error.what}", where=where, rule=error.rule, fix=error.fix) from None
    except PictureError as error:
        raise SceneError(f"{what}: {error.what}", where=where, rule=error.rule, fix=error.fix) from None
    except UnidentifiedImageError:
        raise SceneError(f"{what} is not a picture that can be read", where=where, rule=RULE) from None
    except SceneError:
        raise
    except NotImplementedError as error:  # of DDS
        raise MissingFileError(f"{what} is not decoded ({error})", where=where, fix="convert it to PNG") from None
    except Exception as error:  # Pillow's decoders pass on whatever their libraries throw at damaged data
        raise SceneError(f"{what} cannot be decoded ({error})", where=where) from error


def texels_of(picture: Pillow.Image) -> NDArray[np.generic]:
    """Texels ``(h, w, 1 | 3 | 4)`` of a Pillow image, as :func:`decode_image` gives them.

    Raises
    ------
    SceneError
        The image was opened from a file of another format than those of :data:`lippmann.codecs.pillow_formats.FORMATS`.
    """
    if not is_allowed(picture):
        raise SceneError(f"a texture is a {picture.format} picture", rule=RULE, fix="convert it")
    return texels_of_codes(codes_of(picture))


def texels_of_codes(codes: NDArray[np.generic]) -> NDArray[np.generic]:
    """Codes with those of 16 bits as float32 in [0, 1]."""
    return codes.astype(np.float32) / np.float32(65535.0) if codes.dtype == np.uint16 else codes
