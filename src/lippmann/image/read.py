"""Picture files read: recognized by their first bytes, checked against the display that they are for."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs import exr, png, tiff, zarr_array
from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.image.encoding import STORED, TEXT_KEY, FormatName, layers_of_channels, linear_values
from lippmann.image.integral_image import IntegralImage
from lippmann.image.metadata import Metadata, from_text
from lippmann.image.provenance import Provenance
from lippmann.image.stored_values import Stored, Values
from lippmann.runtime.cached_property import cached_property

#: More pixels than are read at once; a file that claims more is damaged, or meant to fill the memory.
MOST_PIXELS = 1 << 29
#: The same for formats that are read piece by piece: more than any panel or print has.
MOST_IN_PIECES = 1 << 32

#: Deflate, the tightest packing of all formats here, makes at most 1032 bytes of one: as many grey pixels of 8 bits.
_MOST_PIXELS_PER_BYTE = 1100


class Pieces(Protocol):
    """A picture that can be decoded piece by piece."""

    @property
    def chunk(self) -> tuple[int, int]:
        """Rows and columns of a piece; those at the right and lower edge are cut off."""
        ...

    def read_chunk(self, row: int, column: int) -> NDArray[Any]:
        """``(rows, columns, channels)`` values of the piece in that row and column of pieces, as stored."""
        ...


@dataclass(frozen=True, eq=False)
class PictureFile:
    """A picture file that is open: its header, read once, and its values, decoded when they are asked for.

    It stays open as long as this object lives.

    Attributes
    ----------
    path, format:
        Its name, and the format that its first bytes show.
    width, height:
        Pixels.
    stored:
        NumPy type name of the values; may be one that is not read.
    layers:
        Names of the further layers.
    text:
        The metadata that it carries; empty without.
    pieces:
        For decoding it piece by piece; None if its format has no pieces.
    """

    path: Path
    format: FormatName
    width: int
    height: int
    stored: str
    layers: tuple[str, ...]
    text: str
    pieces: Pieces | None
    _decode: Callable[[], dict[str, NDArray[Any]]]

    @cached_property
    def metadata(self) -> Metadata | None:
        """Display, placement and provenance; None if the file does not say for which display it is.

        Raises
        ------
        PictureError
            If the metadata makes no sense.
        """
        return from_text(self.text, str(self.path)) if self.text else None

    def metadata_for(self, display: Display | None) -> Metadata:
        """The metadata, for ``display`` if one is given.

        Raises
        ------
        PictureError
            If the metadata makes no sense, there is no display, or the size is not the display's.
        """
        metadata = self.metadata
        if metadata is None:
            if display is None:
                raise PictureError("has no display in it", where=str(self.path), fix="say display=...")
            metadata = Metadata(display, np.eye(4), Provenance())
        elif display is not None:
            metadata = replace(metadata, display=display)
        panel = metadata.display.panel
        if (self.width, self.height) != (panel.width, panel.height):
            raise PictureError(
                f"has {self.width} x {self.height} pixels",
                where=str(self.path),
                rule=f"the display {metadata.display.name} has {panel.width} x {panel.height}",
            )
        return metadata

    def decode(self) -> dict[str, NDArray[Any]]:
        """All layers, as stored; the RGB, ``(H, W, 3)``, under ``""``.

        Raises
        ------
        PictureError
            If the pixels are too many, cannot be decoded, or are no opaque colours of a known depth.
        """
        if self.width * self.height > MOST_PIXELS:
            raise PictureError(
                f"has {self.width} x {self.height} pixels",
                where=str(self.path),
                rule=f"at most {MOST_PIXELS} are read at once",
                fix="use what reads it piece by piece: info, replay, views, refocus, compare, view",
            )
        layers = self._decode()
        self.check_stored(layers[""].dtype.name)
        layers[""] = opaque_colors(layers[""], self.path)
        return layers

    def check_stored(self, stored: str) -> Stored:
        """``stored``, a NumPy type name; a :class:`PictureError` if the format's values of this type are not read."""
        if stored not in STORED[self.format].values():
            rule = f"{self.format} is read with {', '.join(STORED[self.format].values())}"
            raise PictureError(f"holds values of the type {stored}", where=str(self.path), rule=rule)
        return cast(Stored, stored)

    def picture(self, display: Display | None = None) -> IntegralImage:
        """The picture, whole in memory; parameters and errors as for :func:`read_picture`."""
        metadata = self.metadata_for(display)
        layers = self.decode()
        values = layers.pop("")
        made = metadata.provenance
        pixels, stored = linear_values(values, made.transfer), cast(Stored, values.dtype.name)
        try:
            return IntegralImage(pixels, metadata.display, metadata.world_from_display, made, layers, stored=stored)
        except PictureError as error:
            raise PictureError(error.what, where=str(self.path), rule=error.rule, fix=error.fix) from error


def read_picture(path: Path, *, display: Display | None = None) -> IntegralImage:
    """Read an integral image: PNG, OpenEXR, TIFF or Zarr.

    Parameters
    ----------
    path:
        The file.
    display:
        The display that the picture is for, instead of the one that it carries; needed for files of other programs.

    Raises
    ------
    PictureError
        If the file is missing, empty, foreign or damaged, has no display, or a size other than the display's.
    """
    return open_file(path).picture(display)


def read_metadata(path: Path, *, display: Display | None = None) -> Metadata:
    """Display, placement and provenance of a picture, without decoding its pixels; raises as :func:`read_picture`."""
    return open_file(path).metadata_for(display)


def open_file(path: Path) -> PictureFile:
    """Open a picture file and read its header: format, size, type of the values, names of the layers, metadata.

    Raises
    ------
    PictureError
        If the file is missing, empty, foreign, cut short, or claims a size that it cannot hold.
    """
    if zarr_array.is_zarr(path):
        array = zarr_array.ZarrPicture(path)
        found = PictureFile(
            path, "zarr", array.width, array.height, array.dtype, (), array.text, array, lambda: {"": array.read()}
        )
        return _plausible(found, None)  # chunks that hold nothing need no files
    file, start = _started(path)
    try:
        opened = _opened(path, file, start)
    except BaseException:
        file.close()
        raise
    # Pieces are read at any time, so the file is closed when nothing needs it any more.
    weakref.finalize(opened, file.close)
    return opened


def _started(path: Path) -> tuple[BinaryIO, bytes]:
    """The open file and its first bytes."""
    try:
        file = path.open("rb")
    except FileNotFoundError:
        raise PictureError("is not there", where=str(path)) from None
    except ValueError:
        raise PictureError("is no name of a file", where=repr(str(path))) from None
    except OSError as error:
        raise PictureError(f"cannot be read: {error.strerror}", where=str(path)) from error
    try:
        start = file.read(8)
    except OSError as error:
        file.close()
        raise PictureError(f"cannot be read: {error.strerror}", where=str(path)) from error
    file.seek(0)
    return file, start


def _opened(path: Path, file: BinaryIO, start: bytes) -> PictureFile:
    """The file with its header, in the format that its first bytes show."""
    if not start:
        raise PictureError("is empty", where=str(path), fix="make or fetch it anew")
    if start == png.SIGNATURE:
        header = png.png_header(file, path)

        def decode() -> dict[str, NDArray[Any]]:
            file.seek(0)
            return {"": png.decode_png(file.read(), path)}

        stored, text = f"uint{max(8, header.bits)}", header.text.get(TEXT_KEY, "")
        found = PictureFile(path, "png", header.width, header.height, stored, (), text, None, decode)
    elif start.startswith(exr.SIGNATURE):
        parts = exr.exr_header(file, path)
        stored, text = parts.channels.get("R", "none"), parts.text.get(TEXT_KEY, "")
        layers = tuple(sorted({layer for layer, dot, _ in (c.rpartition(".") for c in parts.channels) if dot}))
        found = PictureFile(
            path,
            "exr",
            parts.width,
            parts.height,
            stored,
            layers,
            text,
            None,
            lambda: layers_of_channels(exr.read_exr(path), path),
        )
    elif start.startswith(tiff.SIGNATURES):
        page = tiff.TiffPicture(file, path)
        found = PictureFile(
            path, "tiff", page.width, page.height, page.dtype, (), page.description, page, lambda: {"": page.read()}
        )
    else:
        rule = "PNG, OpenEXR, TIFF and Zarr are read"
        raise PictureError("is no picture that is known here", where=str(path), rule=rule)
    return _plausible(found, path.stat().st_size)


def _plausible(file: PictureFile, size: int | None) -> PictureFile:
    """The file, if its claimed size may be: fits its ``size`` in bytes (None if any does) and what is ever read."""
    pixels = file.width * file.height
    most = MOST_PIXELS if file.pieces is None else MOST_IN_PIECES
    if pixels > most:
        rule = f"at most {most} pixels are read"
        raise PictureError(f"claims {file.width} x {file.height} pixels", where=str(file.path), rule=rule)
    if size is not None and pixels > size * _MOST_PIXELS_PER_BYTE:
        what = f"claims {file.width} x {file.height} pixels but has only {size} bytes"
        raise PictureError(what, where=str(file.path), fix="make or fetch it anew")
    return file


def opaque_colors(values: NDArray[Any], path: Path) -> Values:
    """``(H, W, 3)`` values as stored, of grey, grey and alpha, RGB, or RGB and alpha, where alpha hides nothing."""
    if values.ndim == 2:
        values = values[..., None]
    channels = values.shape[2] if values.ndim == 3 else 0
    if not 1 <= channels <= 4:
        raise PictureError(f"holds an array of shape {values.shape}", where=str(path), rule="it must be grey or RGB")
    if channels in (2, 4):
        opaque = 1.0 if values.dtype.kind == "f" else np.iinfo(values.dtype).max
        if (values[..., -1] != opaque).any():
            raise PictureError("is partly transparent", where=str(path), rule="a panel is not", fix="flatten it")
        values = values[..., :-1]
    return np.repeat(values, 3, axis=2) if values.shape[2] == 1 else values
