"""Files that a stage names: beside it, or in a USDZ package, which is a ZIP archive without compression."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.exr import SIGNATURE
from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.runtime.atomic_write import scratch_folder
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import MissingFileError, NamedFiles, decode_image, read_bytes
from lippmann.scene.parsing.texture_maps import unit
from lippmann.scene.parsing.udim import is_tiled, read_tiles
from lippmann.scene.readers.environment_map import (
    LINEAR_SUFFIXES,
    panorama,
    possible_light,
    read_environment,
    read_linear,
)
from lippmann.scene.readers.usd.records import Record
from lippmann.scene.values.description import Image

#: Files that a package may hold.
_MOST_ENTRIES = 65_536
#: Packages within packages.
_DEEPEST = 4

_WHITE_SKY = np.ones((2, 4, 3), np.float32)


def check_package(path: Path) -> None:
    """Look at a USDZ package before it is opened.

    Raises
    ------
    SceneError
        It is no ZIP archive, is compressed or encrypted, or holds more than it is long.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
        raise SceneError(f"is no USDZ package ({error})", where=path.name, fix="is it whole?") from None
    if len(entries) > _MOST_ENTRIES:
        raise SceneError(f"holds {len(entries)} files", where=path.name, rule=f"up to {_MOST_ENTRIES} are read")
    for entry in entries:
        if entry.compress_type != zipfile.ZIP_STORED or entry.flag_bits & 1:
            raise SceneError(
                f"'{entry.filename}' is compressed or encrypted",
                where=path.name,
                rule="files in a USDZ package are stored as they are",
                fix="pack it with usdzip",
            )
    if sum(entry.file_size for entry in entries) > path.stat().st_size:
        raise SceneError("its files are said to be longer than the package", where=path.name, fix="is it whole?")


@dataclass(frozen=True, eq=False)
class Assets:
    """The pictures of a stage, each decoded once."""

    stage: Path
    named: NamedFiles
    notes: dict[str, None] = field(default_factory=dict)
    _images: dict[str, Image | None] = field(default_factory=dict)

    def image(self, asset: Record) -> Image | None:
        """A texture; None, with a note, of one that is not found.

        Pictures of light (OpenEXR, Radiance) are linear float32, finite and not negative.

        Raises
        ------
        SceneError
            It lies outside the stage's folder, or cannot be decoded.
        """
        key = asset["found"] or f"{asset['folder']}\0{asset['name']}"
        if key not in self._images:
            try:
                self._images[key] = self._load(asset)
            except MissingFileError as error:
                self.notes[error.note("shown without it")] = None
                self._images[key] = None
        return self._images[key]

    def _load(self, asset: Record) -> Image:
        name = asset["name"]
        if is_tiled(name):
            return read_tiles(
                name, lambda tile: self._load({**asset, "name": tile(name), "found": tile(asset["found"])})
            )
        if self._is_linear(asset):
            with self._file(asset) as path:
                pixels, notes = read_linear(path)
            self.notes.update(dict.fromkeys(notes))
            return Image(path.name, possible_light(pixels))
        return decode_image(self._bytes(asset), Path(name).name, where=self.stage.name)

    def environment(self, asset: Record) -> NDArray[np.float32]:
        """The pixels ``(h, w, 3)`` of a picture of the surroundings, linear; an ordinary one is sRGB-coded.

        White, with a note, where it is not found.

        Raises
        ------
        SceneError
            As :meth:`image`, and as :func:`lippmann.scene.readers.environment_map.read_environment`.
        """
        if self._is_linear(asset):
            try:
                with self._file(asset) as path:
                    sky = read_environment(path)
            except MissingFileError as error:
                self.notes[error.note("white light in its place")] = None
                return _WHITE_SKY
            self.notes.update(dict.fromkeys(sky.notes))
            return sky.pixels
        image = self.image(asset)
        if image is None:
            return _WHITE_SKY
        values = unit(image)[..., :3]
        return panorama(np.asarray(decode_srgb(np.broadcast_to(values, (*values.shape[:2], 3))), np.float32))

    def _is_linear(self, asset: Record) -> bool:
        """Whether a picture is OpenEXR or Radiance; those that ``maketx`` has made (``.tx``) are TIFF or OpenEXR."""
        name = asset["name"].lower()
        return name.endswith(LINEAR_SUFFIXES) or (name.endswith(".tx") and self._bytes(asset).startswith(SIGNATURE))

    @contextmanager
    def _file(self, asset: Record) -> Iterator[Path]:
        """The file of a picture, while it is needed: a copy of one within a package."""
        path = self._path(asset)
        if path is not None:
            yield path
            return
        with scratch_folder("lippmann-usd-") as folder:
            path = Path(folder) / Path(asset["name"]).name
            path.write_bytes(self._bytes(asset))
            yield path

    def _path(self, asset: Record) -> Path | None:
        """The file; None of one within a package."""
        if "[" in asset["found"]:
            return None
        folders = [Path(asset["folder"] or self.stage.parent), self.stage.parent]
        return self.named.find(asset["name"], where=self.stage.name, what="texture", folders=folders)

    def _bytes(self, asset: Record) -> bytes:
        path = self._path(asset)
        if path is not None:
            return read_bytes(path)
        outer, *inner = asset["found"].rstrip("]").split("[")
        if not self.named.admits(Path(outer)):
            raise SceneError(f"texture '{asset['name']}' lies outside the scene's folder", where=self.stage.name)
        return self._read_packed(Path(outer), inner[:_DEEPEST])

    def _read_packed(self, package: Path, names: list[str]) -> bytes:
        source: Path | io.BytesIO = package
        data = b""
        for name in names:
            try:
                with zipfile.ZipFile(source) as archive:
                    entry = archive.getinfo(name)
                    if entry.compress_type != zipfile.ZIP_STORED:
                        raise SceneError(f"'{name}' is compressed in its package", where=self.stage.name)
                    check_input(entry.file_size, f"texture '{name}'", where=self.stage.name)
                    data = archive.read(entry)
            except (KeyError, zipfile.BadZipFile, OSError, ValueError, RuntimeError, NotImplementedError, EOFError):
                raise MissingFileError(f"texture '{name}' is not in the package", where=self.stage.name) from None
            source = io.BytesIO(data)
        return data
