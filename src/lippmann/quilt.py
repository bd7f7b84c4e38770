"""Quilts: the views of a scene side by side in one picture, as light-field displays and their programs exchange them.

View 0, the leftmost camera's, is at the bottom left; views follow to the right, then row by row upwards. A quilt's
name ends in ``_qs8x6a0.75``: columns x rows, and the aspect of the picture shown, which the tiles need not have. Where
the sides of the file are no multiples of columns and rows (4096 / 5) the rest lies unused on the right and on top.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.atomic import replacing_folder
from lippmann.display import Display, load_display
from lippmann.errors import OutputError, PictureError, UsageError
from lippmann.image.codec import FORMATS, STORED, FormatName, decode_file, encode_file, read_header
from lippmann.image.color import dequantize
from lippmann.image.folders import MANIFEST
from lippmann.image.formats import format_for, write_plain_picture
from lippmann.image.integral_image import FloatArray, Stored
from lippmann.image.provenance import Provenance
from lippmann.progress import Progress, ProgressCallback, silent

#: Pixels of a quilt's sides, and its columns and rows, within which displays take them.
LEAST_SIDE, MOST_SIDE, MOST_TILES = 256, 16384, 32

#: Endings of the pictures that are read; JPEG is never written.
_JPEG = (".jpg", ".jpeg")
_READ = (*FORMATS, *_JPEG)

_NAME = re.compile(r"_qs(\d{1,4})x(\d{1,4})(?:a(\d{1,4}(?:\.\d{1,12})?))?$")
_CONVENTION = "a quilt's name ends in columns x rows and the picture's aspect, such as _qs8x6a0.75.png"


class QuiltLayout(NamedTuple):
    """What a quilt's name says; ``aspect`` (width / height of the picture shown) is None in names of older programs."""

    columns: int
    rows: int
    aspect: float | None

    @property
    def views(self) -> int:
        """Number of views."""
        return self.columns * self.rows

    @property
    def ending(self) -> str:
        """The end of the name, such as ``_qs8x6a0.75``."""
        return f"_qs{self.columns}x{self.rows}" + ("" if self.aspect is None else f"a{self.aspect:.6g}")


class DeviceQuilt(NamedTuple):
    """The quilt that a display is given: its preset's name, width and height in pixels, and layout.

    ``serial`` is how the serial numbers of such devices begin; empty where that is not known.
    """

    display: str
    width: int
    height: int
    layout: QuiltLayout
    serial: str = ""


#: What the names of the devices' presets begin with.
_FAMILY = "looking-glass-"


def _device(
    display: str, width: int, height: int, columns: int, rows: int, aspect: float, serial: str = ""
) -> DeviceQuilt:
    return DeviceQuilt(_FAMILY + display, width, height, QuiltLayout(columns, rows, aspect), serial)


#: Recommended quilts, by device. The 16" landscape of the third generation has two: published, and as devices report.
DEVICE_QUILTS: tuple[DeviceQuilt, ...] = (
    _device("8.9-gen1", 4096, 4096, 5, 9, 1.6, "LKG-2K"),
    _device("15.6-gen1", 4096, 4096, 5, 9, 1.77778, "LKG-4K"),
    _device("8k-gen1", 8192, 8192, 5, 9, 1.77778, "LKG-8K"),
    _device("portrait", 3360, 3360, 8, 6, 0.75, "LKG-P"),
    _device("go", 4092, 4092, 11, 6, 0.5625, "LKG-E"),
    _device("16-gen2", 4096, 4096, 5, 9, 1.77778, "LKG-A"),
    _device("32-gen2", 8192, 8192, 5, 9, 1.77778, "LKG-B"),
    _device("65", 8192, 8192, 8, 9, 1.77778, "LKG-D"),
    _device("16-gen3-portrait", 5995, 6000, 11, 6, 0.5625, "LKG-H"),
    _device("16-gen3-landscape", 5999, 5999, 7, 7, 1.77778, "LKG-J"),
    _device("16-gen3-landscape", 7680, 4320, 8, 6, 1.77778, "LKG-J"),
    _device("27-landscape", 7680, 4320, 8, 6, 1.77778),
    _device("27-portrait", 7680, 4320, 12, 4, 0.5625),
    _device("32-gen3-portrait", 8184, 8184, 11, 6, 0.5625, "LKG-K"),
    _device("32-gen3-landscape", 8190, 8190, 7, 7, 1.77778, "LKG-L"),
)


@dataclass(frozen=True, eq=False)
class Quilt:
    """Views of one size in a grid.

    Parameters
    ----------
    pixels:
        ``(height, width, 3)`` float32 linear RGB, row 0 on top.
    layout:
        Columns, rows and the aspect of the picture shown.
    stored:
        How the values were stored in the file that they came from.
    provenance:
        How it was made, as far as that is known: files do not say it.
    """

    pixels: FloatArray
    layout: QuiltLayout
    stored: Stored = "float32"
    provenance: Provenance = field(default_factory=Provenance)

    @property
    def view_size(self) -> tuple[int, int]:
        """Width and height of a view in pixels."""
        return self.pixels.shape[1] // self.layout.columns, self.pixels.shape[0] // self.layout.rows

    def corner(self, number: NDArray[np.intp] | int) -> tuple[Any, Any]:
        """Column and row of the top left pixel of view ``number``, an int or an array."""
        width, height = self.view_size
        right, up = number % self.layout.columns, number // self.layout.columns
        return right * width, self.pixels.shape[0] - (up + 1) * height

    def view(self, number: int) -> FloatArray:
        """``(height, width, 3)`` pixels of a view, 0 the leftmost camera's; shares the quilt's memory."""
        width, height = self.view_size
        column, row = self.corner(number)
        view: FloatArray = self.pixels[row : row + height, column : column + width]
        return view


def load_device(name: str) -> Display:
    """The display of a device by the last part of its preset's name, such as ``portrait``; or any other display.

    Raises
    ------
    DisplayError
        As :func:`~lippmann.display.load_display`.
    """
    known = {device.display for device in DEVICE_QUILTS}
    return load_display(_FAMILY + name if _FAMILY + name in known else name)


def quilt_of_display(
    display: Display, grid: tuple[int, int] | None = None, size: tuple[int, int] | None = None
) -> DeviceQuilt:
    """The quilt that a display is given, known by its preset's name or the beginning of its serial.

    ``grid`` (columns, rows) and ``size`` (width, height in pixels) say otherwise; for displays of no known kind both
    are needed. The aspect is that of the display's panel.

    Raises
    ------
    UsageError, PictureError
        If there is no such quilt.
    """
    layout = None if grid is None else _checked_grid(grid)
    known = [
        device
        for device in DEVICE_QUILTS
        if device.display == display.name or (device.serial and display.name.startswith(device.serial))
    ]
    fitting = [device for device in known if layout is None or device.layout[:2] == layout]
    if size is None and not fitting:
        what = "no quilt of it is known" if layout is None else f"no quilt of {layout[0]}x{layout[1]} views is known"
        rule = f"known are those of {', '.join(sorted({device.display for device in DEVICE_QUILTS}))}"
        fix = "say --views and --size" if layout is None else "say --size, too"
        raise UsageError(what, where=display.name, rule=rule, fix=fix)
    if layout is None:
        if not known:
            raise UsageError("how many views it takes is not known", where=display.name, fix="say --views, too")
        layout = known[0].layout[:2]
    width, height = size or fitting[0][1:3]
    aspect = float(f"{display.panel.width / display.panel.height:.6g}")
    quilt = DeviceQuilt(display.name, width, height, QuiltLayout(*layout, aspect))
    check_size(width, height, quilt.layout, "quilt")
    return quilt


def _checked_grid(grid: tuple[int, int]) -> tuple[int, int]:
    if not (1 <= grid[0] <= MOST_TILES and 1 <= grid[1] <= MOST_TILES):
        rule = f"there are 1 to {MOST_TILES} columns and rows"
        raise UsageError(f"{grid[0]}x{grid[1]} views will not do", where="--views", rule=rule)
    return grid


def layout_of_name(path: Path) -> QuiltLayout:
    """Columns, rows and aspect from a quilt's name.

    Raises
    ------
    PictureError
        If the name does not say them, or they are impossible.
    """
    found = _NAME.search(path.stem)
    if found is None:
        raise PictureError("the name does not say how many views there are", where=str(path), rule=_CONVENTION)
    columns, rows = int(found[1]), int(found[2])
    if not (1 <= columns <= MOST_TILES and 1 <= rows <= MOST_TILES):
        rule = f"there are 1 to {MOST_TILES} of both"
        raise PictureError(f"the name says {columns} columns and {rows} rows", where=str(path), rule=rule)
    aspect = None if found[3] is None else float(found[3])
    if aspect is not None and not 0.05 <= aspect <= 20:
        raise PictureError(f"the name says the aspect {found[3]}", where=str(path), rule=_CONVENTION)
    return QuiltLayout(columns, rows, aspect)


def check_size(width: int, height: int, layout: QuiltLayout, where: str) -> None:
    """Raise :class:`PictureError` if a quilt of this layout cannot have this size.

    Its sides are multiples of columns and rows, or powers of two, as the first devices' are, with a rest unused.
    """
    for side, count, what in ((width, layout.columns, "wide"), (height, layout.rows, "high")):
        if not LEAST_SIDE <= side <= MOST_SIDE:
            rule = f"a quilt's sides are {LEAST_SIDE} to {MOST_SIDE} pixels"
            raise PictureError(f"it is {side} pixels {what}", where=where, rule=rule)
        if side % count and side & (side - 1):
            rule = f"its name says {layout.columns}x{layout.rows} views, and {side} is no multiple of {count}"
            raise PictureError(f"it is {side} pixels {what}", where=where, rule=rule)


def read_quilt(path: Path) -> Quilt:
    """Read a quilt: PNG, OpenEXR, TIFF or JPEG.

    Raises
    ------
    PictureError
        If the file is missing or damaged, or its name and its size disagree.
    """
    layout = layout_of_name(path)
    _check_ending(path)
    pixels, stored = _read(path)
    check_size(pixels.shape[1], pixels.shape[0], layout, str(path))
    return Quilt(pixels, layout, stored)


def read_views(folder: Path, layout: QuiltLayout | None = None, *, progress: ProgressCallback = silent) -> Quilt:
    """The quilt of a folder with one picture per view.

    Views are numbered by the last number in their files' names, from 0 or 1, the leftmost camera first. ``layout`` says
    how many there have to be; without it they stand in one row.

    Raises
    ------
    PictureError
        If a view is absent, damaged or of another size than the first.
    """
    paths = _numbered(folder)
    if layout is None:
        layout = QuiltLayout(len(paths), 1, None)
    if len(paths) != layout.views:
        rule = f"{layout.columns}x{layout.rows} are {layout.views}"
        raise PictureError(f"it holds {len(paths)} views", where=str(folder), rule=rule)
    quilt: Quilt | None = None
    depths = set()
    for number, path in enumerate(paths):
        pixels, stored = _read(path)
        height, width = pixels.shape[:2]
        if quilt is None:
            whole = np.empty((height * layout.rows, width * layout.columns, 3), dtype=np.float32)
            quilt = Quilt(whole, layout)
        if quilt.view_size != (width, height):
            wide, high = quilt.view_size
            rule = f"the first view, {paths[0].name}, has {wide} x {high}"
            raise PictureError(f"has {width} x {height} pixels", where=str(path), rule=rule)
        quilt.view(number)[...] = pixels
        depths.add(stored)
        progress(Progress("read", number + 1, layout.views))
    assert quilt is not None
    return Quilt(quilt.pixels, layout, depths.pop() if len(depths) == 1 else "float32")


def write_quilt(quilt: Quilt, path: Path, *, bits: int | None = None) -> None:
    """Write a quilt, with as many bits as it was stored with unless told otherwise.

    Raises
    ------
    PictureError, OutputError
        If the name does not say the quilt's layout or the size is impossible, or the file cannot be written.
    """
    named = layout_of_name(path)
    if named[:2] != quilt.layout[:2]:
        rule = f"the quilt has {quilt.layout.columns}x{quilt.layout.rows} views"
        raise PictureError(f"the name says {named.columns}x{named.rows}", where=str(path), rule=rule)
    check_size(quilt.pixels.shape[1], quilt.pixels.shape[0], named, str(path))
    name, stored = format_for(path, bits, source=quilt.stored)
    depth = next(depth for depth, kind in STORED[name].items() if kind == stored)
    write_plain_picture(quilt.pixels, path, bits=depth, transfer=quilt.provenance.transfer)


def write_views(
    quilt: Quilt,
    folder: Path,
    *,
    format: FormatName | None = None,
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> None:
    """Write one picture per view, ``view_00`` the leftmost camera's.

    ``format`` is ``png``, ``exr`` or ``tiff``, by default what holds the quilt's values exactly.

    Raises
    ------
    OutputError
        If the format is unknown or has no such bits, or the folder cannot be written.
    """
    if format is None:
        format = "png" if quilt.stored in STORED["png"].values() else "exr"
    if format not in STORED:
        raise OutputError(f"the format {format!r} is unknown", where=str(folder), rule=f"known are {', '.join(STORED)}")
    ending = next(ending for ending, name in FORMATS.items() if name == format)
    _, stored = format_for(folder / f"view{ending}", bits, source=quilt.stored)
    digits = len(str(quilt.layout.views - 1))
    with replacing_folder(folder) as temporary:
        for number in range(quilt.layout.views):
            path = temporary / f"view_{number:0{digits}}{ending}"
            encode_file(path, format, {"": quilt.view(number)}, stored=stored, transfer="srgb")
            progress(Progress("write", number + 1, quilt.layout.views))


def _numbered(folder: Path) -> Sequence[Path]:
    """The views of a folder in order; refuses gaps, doubles and names without a number."""
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in _READ and path.name[0] != ".")
    except OSError as error:
        raise PictureError(f"cannot be read: {error.strerror}", where=str(folder)) from None
    if (folder / MANIFEST).exists():
        rule = "its pictures have one pixel for every lens"
        raise PictureError("this is a folder of 'lippmann views'", where=str(folder), rule=rule, fix="compose it")
    if not paths:
        raise PictureError("there are no views", where=str(folder), rule=f"they end in {', '.join(_READ)}")
    by_number: dict[int, Path] = {}
    for path in paths:
        digits = re.findall(r"[0-9]+", path.stem)
        if not digits:
            raise PictureError("the name has no number", where=str(path), rule="views are numbered from the left")
        if (number := int(digits[-1])) in by_number:
            raise PictureError(f"is view {number}, as {by_number[number].name} is", where=str(path))
        by_number[number] = path
    first = min(by_number)
    if first > 1:
        raise PictureError(f"the first view is {first}", where=str(folder), rule="views are numbered from 0 or 1")
    if absent := _first_absent(by_number, first):
        raise PictureError(f"view {absent} is absent", where=str(folder), rule=f"views run to {max(by_number)}")
    return [by_number[number] for number in sorted(by_number)]


def _first_absent(numbers: Iterable[int], first: int) -> int | None:
    for expected, number in enumerate(sorted(numbers), start=first):
        if number != expected:
            return expected
    return None


def _check_ending(path: Path) -> None:
    if path.suffix.lower() not in _READ:
        raise PictureError(f"the ending '{path.suffix}' is unknown", where=str(path), rule=f"known: {', '.join(_READ)}")


def _read(path: Path) -> tuple[FloatArray, Stored]:
    if path.suffix.lower() in _JPEG:
        return _read_jpeg(path), "uint8"
    layers, stored = decode_file(path, read_header(path).format, "srgb")
    return layers[""], stored


def _read_jpeg(path: Path) -> FloatArray:
    from PIL import Image

    try:
        # Pillow warns of pictures from 90 million pixels on; quilts may have 268.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            picture = Image.open(path, formats=("JPEG",))
        with picture:
            if max(picture.size) > MOST_SIDE:
                raise PictureError(f"it has {picture.width} x {picture.height} pixels", where=str(path))
            codes = np.asarray(picture.convert("RGB"))
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise PictureError(f"cannot be read: {error}", where=str(path)) from None
    return dequantize(codes, "srgb")
