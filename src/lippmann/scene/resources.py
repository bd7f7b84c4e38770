"""Files that a scene file names: where they may lie, and how their pictures become texels."""

from __future__ import annotations

import difflib
import io
import warnings
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.description import Image

if TYPE_CHECKING:
    from PIL import Image as Pillow


def read_bytes(path: Path, most: int = -1) -> bytes:
    """A scene file, or its first ``most`` bytes.

    Raises
    ------
    SceneError
        The file is missing, a folder, unreadable or empty.
    """
    where = path.name
    try:
        if path.is_dir():
            raise SceneError("is a folder, not a scene file", where=str(path), fix="name the file inside it")
        with path.open("rb") as file:
            data = file.read(most)
    except FileNotFoundError:
        raise SceneError("no such file", where=str(path), fix=_near_miss(path)) from None
    except OSError as error:
        raise SceneError(f"cannot be read ({error.strerror or error})", where=str(path)) from None
    if not data:
        raise SceneError("the file is empty", where=where)
    return data


def decode_text(data: bytes, where: str) -> str:
    """The text of an OBJ, MTL or similar file: UTF-8, else Latin-1, which old exporters wrote.

    Raises
    ------
    SceneError
        The bytes are not text.
    """
    if b"\0" in data[:4096]:
        raise SceneError("is not a text file", where=where, rule="this format is plain text")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def resolve(folder: Path, name: str, *, where: str, what: str, allow_outside: bool) -> Path:
    """The file that ``name`` means, seen from ``folder``.

    Exporters on Windows write backslashes and absolute paths; a path that leads out of ``folder`` is taken to mean
    the file of that name inside it, unless ``allow_outside`` trusts the scene file to name any file of the machine.

    Parameters
    ----------
    where:
        File and line that speak of ``name``, for the error.
    what:
        The kind of file, such as "texture".

    Raises
    ------
    SceneError
        No such file, or it lies outside ``folder`` and ``allow_outside`` is false.
    """
    plain = name.replace("\\", "/")
    absolute = PurePosixPath(plain).is_absolute() or PureWindowsPath(name).is_absolute()
    candidate = Path(plain) if absolute else folder / plain
    outside = absolute or not _is_below(candidate, folder)
    if (allow_outside or not outside) and is_file(candidate):
        return candidate
    beside = folder / PurePosixPath(plain).name
    if outside and is_file(beside) and (allow_outside or _is_below(beside, folder)):
        return beside
    if outside and not allow_outside and is_file(candidate):
        raise SceneError(
            f"{what} '{name}' lies outside the scene's folder",
            where=where,
            rule="a scene file may name only files in its own folder and below",
            fix="move it there, or trust the scene file with --allow-outside",
        )
    raise SceneError(f"{what} '{name}' is not there", where=where, fix=_near_miss(candidate))


def _is_below(path: Path, folder: Path) -> bool:
    """Whether a file lies in ``folder`` or deeper, wherever links lead."""
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # a NUL, a name too long, links that run in a circle
        return False


def is_file(path: Path) -> bool:
    """Whether there is such a file; of a name that no file can have, there is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name too long, or with a NUL
        return False


def _near_miss(path: Path) -> str:
    """A hint at the file that was meant: other case, or a slip of the pen."""
    try:
        names = sorted(entry.name for entry in path.parent.iterdir() if entry.is_file())
    except OSError:
        return f"there is no folder '{path.parent}'"
    folded = {name.casefold(): name for name in names}
    close = difflib.get_close_matches(path.name.casefold(), folded, n=1, cutoff=0.75)
    return f"is '{folded[close[0]]}' meant?" if close else ""


def read_image(path: Path, *, where: str) -> Image:
    """Decode a picture file; see :func:`decode_image`."""
    return decode_image(read_bytes(path), path.name, where=where)


def decode_image(data: bytes, name: str, *, where: str) -> Image:
    """Texels ``(h, w, 1 | 3 | 4)`` of an encoded picture: uint8, or float32 in [0, 1] where the file holds 16 bits.

    Raises
    ------
    SceneError
        The bytes are no picture, are cut short, or decode to more pixels than Pillow's safety limit.
    """
    from PIL import Image as Pillow
    from PIL import UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Pillow.DecompressionBombWarning)
            with Pillow.open(io.BytesIO(data)) as picture:
                pixels = texels_of(picture)
    except UnidentifiedImageError:
        raise SceneError(f"texture '{name}' is not a picture that can be read", where=where) from None
    except Exception as error:  # Pillow's decoders pass on whatever their libraries throw at damaged data
        raise SceneError(f"texture '{name}' cannot be decoded ({error})", where=where) from error
    return Image(name, pixels)


def texels_of(picture: Pillow.Image) -> NDArray[np.generic]:
    """Texels ``(h, w, 1 | 3 | 4)`` of a Pillow image, as :func:`decode_image` gives them."""
    if picture.mode.startswith("I;16") or picture.mode in ("I", "F"):
        wide = np.asarray(picture).astype(np.float32)
        return np.asarray(wide[..., None] if picture.mode == "F" else wide[..., None] / np.float32(65535.0))
    if picture.mode in ("1", "L"):
        return np.array(picture.convert("L"))[..., None]
    has_alpha = "A" in picture.getbands() or "transparency" in picture.info
    return np.array(picture.convert("RGBA" if has_alpha else "RGB"))


def linear_from_srgb(coded: NDArray[np.floating]) -> NDArray[np.float32]:
    """Linear light of sRGB-coded values in [0, 1] (IEC 61966-2-1)."""
    value = np.asarray(coded, np.float64)
    linear = np.where(value <= 0.04045, value / 12.92, ((np.maximum(value, 0.0) + 0.055) / 1.055) ** 2.4)
    return linear.astype(np.float32)
