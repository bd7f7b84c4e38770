"""SOG, PlayCanvas's splats in lossless pictures: meta.json and WebP files, versions 1 and 2, in a zip or a folder.

Each splat is a pixel of each picture. Places are logarithms in 16 bits, split over two pictures; standard deviations
and colours are entries of a codebook (version 2) or lie between bounds (version 1); coefficients of higher degree
belong to a palette. See developer.playcanvas.com, "The SOG format".
"""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lippmann.codecs.pillow_formats import open_picture
from lippmann.errors import LippmannError, SceneError
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import NamedFiles, read_bytes
from lippmann.scene.readers.splats.activation import MOST_SMALL, Bytes, activate, ask_memory, largest_left_out, sigmoid
from lippmann.scene.readers.splats.sog_folder import META, holds_sog
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.splats import COEFFICIENTS, FloatArray

_LARGEST_META = 1 << 20
#: Splats of a palette lie so many to a row.
_PALETTE_COLUMNS = 64
_FIRST_TURN = 252
#: The highest degree of harmonics that the format has.
_MOST_BANDS = 3


def read_sog(path: Path, *, files: NamedFiles | None = None) -> SceneDescription:
    """Read a SOG file, or its unbundled form: a folder, or the meta.json in it.

    Parameters
    ----------
    files:
        Those that it may name; by default those of its folder and below.

    Raises
    ------
    SceneError, MemoryLimitError
        The file is missing, foreign, damaged, of another version, or takes more memory than is left.
    """
    where = path.name or str(path)
    if holds_sog(path):
        folder = path if path.is_dir() else path.parent
        return _read(_Folder(where, NamedFiles(folder, NamedFiles.of(path, files).anywhere)), folder.resolve().name)
    try:
        with zipfile.ZipFile(io.BytesIO(read_bytes(path))) as archive:
            return _read(_Bundle(where, archive), path.stem)
    except LippmannError:
        raise
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, OSError, ValueError) as error:
        raise SceneError(
            f"is no SOG file ({error})", where=where, rule="one is a zip of meta.json and pictures"
        ) from None


@dataclass(frozen=True)
class _Files:
    """The files that a SOG is made of."""

    where: str

    def error(self, what: str, rule: str = "") -> SceneError:
        return SceneError(what, where=self.where, rule=rule)

    def read(self, name: str, most: int | None = None) -> bytes:
        """A file, whose size unpacked is asked for before it is taken."""
        raise NotImplementedError

    def _check_size(self, name: str, size: int, most: int | None) -> None:
        if most is not None and size > most:
            raise self.error(f"'{name}' has {size} bytes", f"at most {most}")
        check_input(size, f"'{name[:60]}'", where=self.where)

    def meta(self) -> _Meta:
        """The object in meta.json."""
        try:
            values = json.loads(self.read(META, _LARGEST_META))
        except (ValueError, RecursionError) as error:
            raise self.error(f"meta.json: {error}", "it holds JSON") from None
        return _Meta(self, values, META)

    def pixels(self, name: str, count: int) -> Bytes:
        """The first ``count`` pixels of a picture, ``(count, 4)``."""
        return self.picture(name).reshape(-1, 4)[:count]

    def picture(self, name: str) -> Bytes:
        """``(height, width, 4)`` of a picture."""
        try:
            with open_picture(io.BytesIO(self.read(name)), ("WEBP", "PNG")) as picture:
                return np.array(picture.convert("RGBA"))
        except LippmannError:
            raise
        except Exception as error:  # Pillow's decoders pass on whatever their libraries throw at damaged data
            raise self.error(f"'{name[:60]}' cannot be decoded ({error})", "it is a WebP picture") from error


@dataclass(frozen=True)
class _Bundle(_Files):
    archive: zipfile.ZipFile

    def read(self, name: str, most: int | None = None) -> bytes:
        try:
            entry = self.archive.getinfo(name)
        except KeyError:
            raise self.error(f"holds no '{name[:60]}'") from None
        self._check_size(name, entry.file_size, most)
        with self.archive.open(entry) as file:
            return file.read(entry.file_size)


@dataclass(frozen=True)
class _Folder(_Files):
    named: NamedFiles

    def read(self, name: str, most: int | None = None) -> bytes:
        path = self.named.find(name, where=self.where, what="picture")
        self._check_size(name, path.stat().st_size, most)
        return read_bytes(path)


@dataclass(frozen=True)
class _Meta:
    """A JSON object of meta.json, whose members are checked as they are read."""

    bundle: _Files
    values: object
    place: str

    def error(self, key: str, rule: str) -> SceneError:
        return self.bundle.error(f"{self.place}: '{key}' is missing or wrong", rule)

    def get(self, key: str) -> object:
        """A member; None where absent."""
        if not isinstance(self.values, dict):
            raise self.bundle.error(f"{self.place} is no object", "it holds a JSON object")
        return self.values.get(key)

    def child(self, key: str) -> _Meta:
        """An object that must be there."""
        value = self.get(key)
        if not isinstance(value, dict):
            raise self.error(key, "an object belongs there")
        return _Meta(self.bundle, value, f"{self.place}.{key}")

    def whole(self, key: str, most: int) -> int:
        """A whole number from 1 to ``most``."""
        value = self.get(key)
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
            raise self.error(key, f"a whole number from 1 to {most} belongs there")
        return value

    def numbers(self, key: str, count: int | None = None) -> FloatArray:
        """Finite numbers, as many as ``count`` says; one alone is a list of one."""
        value = self.get(key)
        values: Sequence[object] = value if isinstance(value, list) else [value]
        fits = len(values) <= 256 if count is None else len(values) == count
        if not fits or not all(isinstance(each, int | float) and abs(each) < 1e12 for each in values):
            raise self.error(key, f"{'up to 256' if count is None else count} numbers belong there")
        return np.array(values, np.float32)

    def files(self, count: int) -> list[str]:
        """The names of so many files."""
        value = self.get("files")
        if not isinstance(value, list) or len(value) < count or not all(isinstance(name, str) for name in value):
            raise self.error("files", f"{count} names belong there")
        return [str(name) for name in value[:count]]


def _read(bundle: _Files, name: str) -> SceneDescription:
    meta = bundle.meta()
    version = meta.get("version")
    if version not in (None, 1, 2):
        raise bundle.error(f"is SOG of version {str(version)[:20]}", "versions 1 and 2 are read")
    by_codebook = version == 2
    count = meta.whole("count", 2**32) if by_codebook else _count_of_version_1(meta)
    shared = meta.child("shN") if meta.get("shN") is not None else None
    palette = None if shared is None else _palette(bundle, shared, by_codebook)
    coefficients = 1 if palette is None else palette.shape[1] + 1
    ask_memory(count, coefficients, where=bundle.where)

    def pixels(part: _Meta, number: int, files: int) -> Bytes:
        texels = bundle.pixels(part.files(files)[number], count)
        if len(texels) < count:
            raise bundle.error(f"{part.place}: {len(texels)} pixels for {count} splats", "each splat has one")
        return texels

    means, scales, quats, sh0 = (meta.child(key) for key in ("means", "scales", "quats", "sh0"))
    steps = pixels(means, 1, 2)[:, :3].astype(np.float32) * 256.0 + pixels(means, 0, 2)[:, :3]
    logs = _dequantize(means, 3, steps, 65535.0)
    with np.errstate(over="ignore", invalid="ignore"):
        centers = np.sign(logs) * np.expm1(np.abs(logs))
    sizes, colors, turns = pixels(scales, 0, 1), pixels(sh0, 0, 1), pixels(quats, 0, 1)
    if by_codebook:
        log_scales, dc = _entries(scales, sizes[:, :3]), _entries(sh0, colors[:, :3])
        opacities = colors[:, 3].astype(np.float32) / np.float32(255.0)
    else:
        log_scales = _dequantize(scales, 3, sizes[:, :3])
        both = _dequantize(sh0, 4, colors)
        dc, opacities = both[:, :3], sigmoid(both[:, 3])
    w_first = largest_left_out(
        (turns[:, :3].astype(np.float32) / np.float32(127.5) - 1.0) * MOST_SMALL,
        np.maximum(turns[:, 3].astype(np.int64) - _FIRST_TURN, 0),
    )
    harmonics = np.zeros((count, coefficients, 3), np.float32)
    harmonics[:, 0] = dc
    if palette is not None and shared is not None:
        labels = pixels(shared, 1, 2)
        number = labels[:, 0].astype(np.int64) + 256 * labels[:, 1].astype(np.int64)
        if number.max() >= len(palette):
            raise bundle.error(f"shN names entry {number.max()} of {len(palette)}")
        harmonics[:, 1:] = palette[number]
    splats, notes = activate(
        centers, log_scales, np.roll(w_first, -1, axis=1), opacities, harmonics, where=bundle.where
    )
    return SceneDescription(name, splats=splats, notes=notes)


def _count_of_version_1(meta: _Meta) -> int:
    shape = meta.child("means").get("shape")
    first = shape[0] if isinstance(shape, list) and shape else None
    return _Meta(meta.bundle, {"shape": first}, f"{meta.place}.means").whole("shape", 2**32)


def _dequantize(part: _Meta, count: int, codes: Bytes | FloatArray, most: float = 255.0) -> FloatArray:
    """Values between the bounds of a part: of codes ``(n, count)``, 0 is the lower bound and ``most`` the upper."""
    low, high = part.numbers("mins", count), part.numbers("maxs", count)
    return np.asarray(low + codes / np.float32(most) * (high - low), np.float32)


def _entries(part: _Meta, codes: Bytes) -> FloatArray:
    """Entries of a part's codebook."""
    book = part.numbers("codebook")
    if codes.size and codes.max() >= len(book):
        raise part.error("codebook", f"a file names entry {codes.max()}")
    return book[codes]


def _palette(bundle: _Files, shared: _Meta, by_codebook: bool) -> FloatArray:
    """Coefficients of degrees 1 and up of the palette's entries, ``(m, k - 1, 3)``."""
    picture = bundle.picture(shared.files(2)[0])
    height, width = picture.shape[:2]
    own = COEFFICIENTS[shared.whole("bands", _MOST_BANDS)] - 1 if by_codebook else width // _PALETTE_COLUMNS
    if own + 1 not in COEFFICIENTS[1 : _MOST_BANDS + 1] or width != _PALETTE_COLUMNS * own:
        raise bundle.error(f"shN: a palette {width} pixels wide", "64 entries a row, of 3, 8 or 15 pixels each")
    codes = picture[..., :3].reshape(height * _PALETTE_COLUMNS, own, 3)
    check_input(4 * codes.size, "the palette of harmonics", where=bundle.where)
    return _entries(shared, codes) if by_codebook else _dequantize(shared, 1, codes)
