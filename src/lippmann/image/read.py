"""Picture files read: recognized by their first bytes, opened once, checked against the display that they are for."""

from __future__ import annotations

import contextlib
import weakref
from collections.abc import Callable
from dataclasses import dataclass, replace
from io import BufferedReader
from os import PathLike
from pathlib import Path
from typing import cast

import numpy as np

from lippmann.codecs import exr, png, tiff, zarr_array
from lippmann.codecs.claims import check_claim
from lippmann.codecs.icc import convert_codes
from lippmann.display import Display, load_display
from lippmann.errors import PictureError
from lippmann.image.encoding import STORED, TEXT_KEY, FormatName, layers_of_channels, linear_values, mirrored_in_file
from lippmann.image.integral_image import IntegralImage
from lippmann.image.metadata import Metadata, Provenance, from_text, is_quilt_text
from lippmann.image.stored_values import Layer, Stored, Values
from lippmann.options.option import checked
from lippmann.runtime.engine_lock import cached_property
from lippmann.runtime.machine import check_input
from lippmann.runtime.regular_file import check_kind, unreadable

#: Largest number of pixels decoded at once; a file that claims more is damaged, or meant to fill the memory.
MOST_PIXELS = 1 << 29
#: Largest number of pixels in formats that are decoded piece by piece: more than any panel or print has.
MOST_IN_PIECES = 1 << 32


@dataclass(frozen=True, eq=False)
class PictureFile:
    """An open picture file: its header, read once, and its values, upright, decoded on demand.

    The file is closed with this object.

    Attributes
    ----------
    path, format:
        Name of the file; format that its first bytes show.
    width, height:
        Size in pixels, upright.
    stored:
        NumPy type name of the values; may be a type that is not read.
    layers:
        Names of the layers beside the RGB.
    text:
        JSON of the metadata; empty without.
    icc:
        ICC profile of the codes, embedded or made of what the file says of its colours; empty: sRGB.
    pieces:
        Decoder of single tiles, strips or chunks; None for PNG, OpenEXR, and TIFF whose values are not stored as shown.
    notes:
        What of the file is not shown, each in one line.
    """

    path: Path
    format: FormatName
    width: int
    height: int
    stored: str
    layers: tuple[str, ...]
    text: str
    icc: bytes
    pieces: tiff.TiffPicture | zarr_array.ZarrPicture | None
    _decode: Callable[[], dict[str, Layer]]
    notes: tuple[str, ...] = ()
    _pixel_bits: int = 8

    @cached_property
    def metadata(self) -> Metadata | None:
        """Display, placement and provenance; None in files of other programs.

        Raises
        ------
        PictureError
            If a value makes no sense, or the metadata is of a later version.
        """
        return from_text(self.text, str(self.path)) if self.text else None

    def metadata_for(self, display: Display | str | PathLike[str] | None) -> Metadata:
        """:attr:`metadata` with its display replaced by ``display``, or the one of that name, if one is given.

        Raises
        ------
        PictureError
            If the metadata makes no sense, there is no display, or the display has another size.
        """
        display = load_display(display) if isinstance(display, (str, PathLike)) else display
        metadata = self.metadata
        if metadata is None:
            if is_quilt_text(self.text):
                raise PictureError("is a quilt", where=str(self.path), fix="weave it for a display")
            if display is None:
                raise PictureError("has no display in it", where=str(self.path), fix="say display=...")
            metadata = Metadata(display, np.eye(4), Provenance())
        elif display is not None:
            metadata = replace(metadata, display=display)
        panel = metadata.display.panel
        if (self.width, self.height) != (panel.width, panel.height):
            rule = f"the display {metadata.display.name} has {panel.width} x {panel.height}"
            fix = "" if self.metadata else "of a quilt, say its columns and rows: layout=... of weave, replay or view"
            raise PictureError(f"has {self.width} x {self.height} pixels", where=str(self.path), rule=rule, fix=fix)
        return metadata

    def decode(self, *, as_srgb: bool = False) -> tuple[Values, dict[str, Layer]]:
        """RGB of the whole picture, ``(H, W, 3)`` as stored, and the other layers by name.

        Parameters
        ----------
        as_srgb:
            Whether codes are converted to sRGB and transparent parts lie on black, as for a picture to be looked at.
            Codes of a display are not, and are opaque.

        Raises
        ------
        PictureError
            If there are more than :data:`MOST_PIXELS` pixels, the file is damaged, or it holds no opaque colours of a
            known depth.
        """
        if self.width * self.height > MOST_PIXELS:
            raise PictureError(
                f"has {self.width} x {self.height} pixels",
                where=str(self.path),
                rule=f"at most {MOST_PIXELS} are read at once",
                fix="use what reads it piece by piece: info, replay, views, refocus, compare, view",
            )
        layers = self._decode()
        values = layers.pop("")
        self.check_stored(values.dtype.name)
        return opaque_colors(values, self.path, self.icc if as_srgb else b"", on_black=as_srgb), layers

    def check_stored(self, stored: str) -> Stored:
        """``stored``, a NumPy type name; a :class:`PictureError` if this format is not read with such values."""
        known = STORED[self.format].values()
        if stored not in known:
            rule = f"{self.format} is read with {', '.join(known)}"
            raise PictureError(f"holds values of the type {stored}", where=str(self.path), rule=rule)
        return cast("Stored", stored)

    def picture(self, display: Display | str | PathLike[str] | None = None) -> IntegralImage:
        """The whole picture in memory; ``display`` and errors as in :func:`read_picture`."""
        metadata = self.metadata_for(display)
        values, layers = self.decode()
        pixels = mirrored_in_file(linear_values(values, metadata.provenance.transfer), metadata.display)
        layers = {name: mirrored_in_file(layer, metadata.display) for name, layer in layers.items()}
        try:
            return IntegralImage(
                pixels,
                metadata.display,
                metadata.world_from_display,
                metadata.provenance,
                layers,
                stored=self.check_stored(values.dtype.name),
            )
        except PictureError as error:
            raise PictureError(error.what, where=str(self.path), rule=error.rule, fix=error.fix) from error


def read_picture(path: str | Path, *, display: Display | str | PathLike[str] | None = None) -> IntegralImage:
    """Read a whole integral image from a PNG, OpenEXR, TIFF or Zarr file.

    Parameters
    ----------
    path:
        The file.
    display:
        Display of the picture, or what :func:`lippmann.display.load_display` takes, instead of the one in the file;
        required for files of other programs.

    Returns
    -------
    IntegralImage
        With ``.pixels`` ``(H, W, 3)`` float32 linear RGB, row 0 on top, and the file's layers in ``.maps``.

    Raises
    ------
    PictureError
        If the file is missing, empty, foreign or damaged, has no display, or a size other than the display's.

    Examples
    --------
    >>> import numpy as np
    >>> black = np.zeros((510, 510, 3), dtype=np.float32)
    >>> lippmann.IntegralImage(black, lippmann.load_display("mla-square")).save("black.png")
    >>> lippmann.read_picture("black.png").display.name
    'mla-square'
    """
    return open_file(path).picture(display)


def read_metadata(path: str | Path, *, display: Display | str | PathLike[str] | None = None) -> Metadata:
    """Display, placement and provenance of a picture file, without its pixels.

    Parameters and errors are those of :func:`read_picture`; damage to the pixels goes unnoticed.
    """
    return open_file(path).metadata_for(display)


@checked
def open_file(path: str | Path) -> PictureFile:
    """Open a picture file and read its header: format, size, type of the values, layers and metadata.

    Raises
    ------
    PictureError
        If the file is missing, empty, foreign, cut short, or claims a size that it cannot hold.
    """
    path = Path(path)
    if zarr_array.is_zarr(path):
        array = zarr_array.ZarrPicture(path)
        size, text = (array.width, array.height), array.text
        opened = PictureFile(path, "zarr", *size, array.dtype, (), text, b"", array, lambda: {"": array.read()})
        return _plausible(opened, None)  # the size of a folder shows nothing: chunks without values need no files
    check_kind(path, PictureError)
    try:
        file = path.open("rb")
        start = file.peek(8)[:8]
    except ValueError:
        raise PictureError("is no name of a file", where=repr(str(path))) from None
    except OSError as error:
        raise unreadable(path, error, PictureError) from error
    with contextlib.ExitStack() as stack:
        stack.callback(file.close)
        opened = _plausible(_open(path, file, start), path.stat().st_size)
        weakref.finalize(opened, stack.pop_all().close)  # pieces are decoded as long as the object lives
        return opened


def _open(path: Path, file: BufferedReader, start: bytes) -> PictureFile:
    """The file with its header, in the format that its first bytes show."""
    if start == png.SIGNATURE:
        header = png.png_header(file, path)
        stored, text = f"uint{max(8, header.bits)}", header.text.get(TEXT_KEY, "")
        size, pixel = (header.width, header.height), header.bits * header.channels

        def codes() -> dict[str, Layer]:
            check_input(header.size, "its picture", where=str(path))
            return {"": png.decode_png(file, header, path)}

        return PictureFile(path, "png", *size, stored, (), text, header.icc, None, codes, header.notes, pixel)
    if start.startswith(exr.SIGNATURE):
        parts = exr.exr_header(file, path)
        layers = tuple(sorted({name.rpartition(".")[0] for name in parts.channels} - {""}))
        stored, text = parts.channels.get("R", "none"), parts.text.get(TEXT_KEY, "")
        size = parts.width, parts.height

        def linear() -> dict[str, Layer]:
            layers = layers_of_channels(exr.read_exr(path, parts), path)
            colors = cast("Values", layers[""])
            if colors.shape[2] >= 3:
                layers[""] = np.concatenate(
                    [parts.rec709(colors[..., :3]), colors[..., 3:]], axis=2, dtype=colors.dtype
                )
            return layers

        return PictureFile(path, "exr", *size, stored, layers, text, b"", None, linear, parts.notes)
    if start.startswith(tiff.SIGNATURES):
        page = tiff.TiffPicture(file, path)
        size, text, pieces = (page.width, page.height), page.description, page if page.in_pieces else None
        return PictureFile(
            path,
            "tiff",
            *size,
            page.dtype,
            (),
            text,
            page.icc,
            pieces,
            lambda: {"": page.read()},
            page.notes,
            page.bits,
        )
    if not start:
        raise PictureError("is empty", where=str(path), fix="make or fetch it anew")
    raise PictureError(
        "is no picture that is known here",
        where=str(path),
        rule="PNG, OpenEXR, TIFF and Zarr are read",
        fix="scenes are described by 'lippmann plan', light fields read by 'lippmann import'",
    )


def _plausible(file: PictureFile, size: int | None) -> PictureFile:
    """``file``, if its ``size`` in bytes can hold the pixels that it claims; checked before memory is allocated."""
    pixels = file.width * file.height
    most = MOST_PIXELS if file.pieces is None else MOST_IN_PIECES
    if pixels > most:
        rule = f"at most {most} pixels are read"
        raise PictureError(f"claims {file.width} x {file.height} pixels", where=str(file.path), rule=rule)
    if size is not None:
        check_claim((file.width, file.height), file._pixel_bits, size, file.path)
    return file


def opaque_colors(values: Layer, path: Path, icc: bytes = b"", *, on_black: bool = False) -> Values:
    """``(H, W, 3)`` values of ``(H, W)`` or ``(H, W, 1 to 4)`` grey or RGB values, with or without an opaque alpha.

    Codes of the profile ``icc`` become those of sRGB. ``on_black``: transparent parts lie on black, the colours of
    floats, as OpenEXR has them, multiplied by their alpha already.

    Raises
    ------
    PictureError
        If the shape is another, alpha hides anything without ``on_black``, or the profile is damaged; names ``path``.
    """
    if values.ndim == 2:
        values = values[..., None]
    channels = values.shape[2] if values.ndim == 3 else 0
    if not 1 <= channels <= 4:
        raise PictureError(f"holds an array of shape {values.shape}", where=str(path), rule="it must be grey or RGB")
    if channels in (2, 4):
        opaque = 1 if values.dtype.kind == "f" else np.iinfo(values.dtype.name).max
        alpha, values = values[..., -1:], values[..., :-1]
        if (alpha != opaque).any():
            if not on_black:
                raise PictureError("is partly transparent", where=str(path), rule="a panel is not", fix="flatten it")
            if values.dtype.kind == "u":
                values = (values.astype(np.uint32) * alpha.astype(np.uint32) // opaque).astype(values.dtype)
    if icc and values.dtype.kind == "u":
        try:
            values = convert_codes(values, icc)
        except PictureError as error:
            raise PictureError(error.what, where=str(path), fix=error.fix) from None
    return cast("Values", np.repeat(values, 3, axis=2) if values.shape[2] == 1 else values)
