"""Quilts: the views of a scene side by side in one picture, the exchange format of light-field displays.

View 0, that of the leftmost camera, is at the bottom left; views follow to the right, then row by row upwards. A
quilt's name ends in ``_qs8x6a0.75``: columns x rows, and the aspect ratio of the displayed picture, which the tiles
need not have. If the sides of the file are no multiples of columns and rows (4096 / 5), the rest is unused, on the
right and on top.

A stereo pair is a quilt of two views, the left eye's first. Its name ends in ``_2x1``, or in ``_half_2x1`` if the views
are to be shown at twice their width: by these endings players of eye-tracked monitors know it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from lippmann.display import Display
from lippmann.display.sheet_layout import trim_of
from lippmann.display.stereo import PairWidth, StereoPair
from lippmann.errors import OutputError, PictureError, UsageError
from lippmann.image.encoding import display_codes, linear_values
from lippmann.image.metadata import Provenance
from lippmann.image.stored_values import FloatArray, Stored, Values
from lippmann.options.option import checked

#: Least and largest side of a quilt in pixels, and the largest number of columns or rows.
LEAST_SIDE, MOST_SIDE, MOST_TILES = 256, 16384, 32

#: Width in pixels of a quilt in a notebook, at most.
_NOTEBOOK_WIDTH = 768

#: As players find it: anywhere in the name, the last of several, so that ``_qs8x6a0.75 (1)`` is known. Without an
#: aspect the name ends there.
QUILT_NAME = re.compile(
    r"\A.*qs(\d{1,4})x(\d{1,4})(?:a(\d{0,4}(?:[.,]\d{1,17})?)(?<=\d)(?![\d.,]*\d)|$)", re.IGNORECASE | re.DOTALL
)
_PAIR = re.compile(r"_(?:half_)?2x1$")
#: Columns and rows in a name without ``qs``: the size of anything.
_SIZE = re.compile(r"(?<!\d)(\d{1,2})(?:x|by)(\d{1,2})(?!\d)", re.IGNORECASE)
_CONVENTION = "a quilt's name ends in columns x rows and aspect ratio, such as _qs8x6a0.75.png"


class QuiltLayout(NamedTuple):
    """The layout in a quilt's name.

    Attributes
    ----------
    columns, rows:
        Views side by side, and one above the other, 1 to 32.
    aspect:
        Width over height of the displayed picture; None in names that older programs wrote.
    """

    columns: int
    rows: int
    aspect: float | None

    @property
    def views(self) -> int:
        """Number of views."""
        return self.columns * self.rows

    @property
    def ending(self) -> str:
        """The ending of the file's stem, such as ``_qs8x6a0.75``."""
        return f"_qs{self.columns}x{self.rows}" + ("" if self.aspect is None else f"a{self.aspect:.6g}")


class DeviceQuilt(NamedTuple):
    """The recommended quilt of a display.

    Attributes
    ----------
    display:
        Name of the display's preset.
    width, height:
        Size of the quilt in pixels.
    layout:
        Columns, rows and aspect ratio.
    serial:
        Prefix of the serial numbers of such devices; empty if unknown.
    pair:
        Ending of a stereo pair's name; empty for other quilts.
    """

    display: str
    width: int
    height: int
    layout: QuiltLayout
    serial: str = ""
    pair: str = ""

    @property
    def ending(self) -> str:
        """The ending of the file's stem, such as ``_qs8x6a0.75`` or ``_half_2x1``."""
        return self.pair or self.layout.ending


#: Prefix of the names of the devices' presets.
_FAMILY = "looking-glass-"


def _device(
    display: str, width: int, height: int, columns: int, rows: int, aspect: float, serial: str = ""
) -> DeviceQuilt:
    return DeviceQuilt(_FAMILY + display, width, height, QuiltLayout(columns, rows, aspect), serial)


#: Recommended quilts. The 16" landscape of the third generation has two: the published one and that of its devices.
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


@checked
@dataclass(frozen=True, eq=False)
class Quilt:
    """Views of one size in a grid.

    Parameters
    ----------
    values:
        ``(height, width, 3)`` RGB, row 0 on top: linear light as float32 or float16, or codes as uint8 or uint16 as
        files hold them, which saves memory.
    layout:
        Columns, rows and aspect ratio.
    stored:
        Type of the values in the file.
    provenance:
        How the quilt was made.
    display:
        The display that the views are for; None if unknown.
    notes:
        What of its files is not shown, each in one line.

    Examples
    --------
    >>> import numpy as np
    >>> from lippmann.quilts.quilt import Quilt, QuiltLayout
    >>> Quilt(np.zeros((20, 90, 3), np.float32), QuiltLayout(3, 1, 1.5)).view(2).shape
    (20, 30, 3)
    """

    values: Values
    layout: QuiltLayout
    stored: Stored = "float32"
    provenance: Provenance = field(default_factory=Provenance)
    display: Display | None = None
    notes: tuple[str, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.values.shape[1], self.values.shape[0]

    @property
    def pixels(self) -> FloatArray:
        """``(height, width, 3)`` float32 linear RGB, row 0 on top."""
        return linear_values(self.values, self.provenance.transfer)

    @checked
    def save(self, path: str | Path, bits: int | None = None) -> Path:
        """Write a PNG, OpenEXR or TIFF file, whose name says the layout: ``x.png`` becomes ``x_qs8x6a0.75.png``.

        Parameters
        ----------
        path:
            The file, with or without the layout in its name.
        bits:
            Bits per value: 8 or 16 for PNG, 16 or 32 for OpenEXR, 8, 16 or 32 for TIFF. None: as the quilt is stored.

        Returns
        -------
        The file that was written.

        Raises
        ------
        PictureError
            A value is not finite.
        OutputError
            The name says another layout, the format is unknown or has no such bits, or the file cannot be written.
        """
        from lippmann.quilts.files import write_quilt

        ending = self.layout.ending
        if self.display is not None and self.display.stereo is not None:
            ending = quilt_of_display(self.display, self.layout[:2], self.size).ending
        named = named_with_layout(Path(path), ending)
        write_quilt(self, named, bits=bits)
        return named

    def srgb(self, bits: int = 8) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """Display codes ``(height, width, 3)``: uint8, or uint16 for 16 ``bits``; errors as of an integral image."""
        return display_codes(self.pixels, bits, self.provenance.transfer)

    def __repr__(self) -> str:
        (width, height), layout = self.size, self.layout
        aspect = "" if layout.aspect is None else f", aspect {layout.aspect:g}"
        return f"<Quilt {width} x {height} pixels, {layout.columns} x {layout.rows} views{aspect}>"

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """:attr:`pixels`, for ``np.asarray`` and NumPy's functions."""
        return np.array(self.pixels, dtype=dtype, copy=copy)

    def _repr_png_(self) -> bytes:
        """A PNG of all views for notebooks, at most 768 pixels wide."""
        from lippmann.codecs.png import encode_png

        step = -(-self.size[0] // _NOTEBOOK_WIDTH)
        codes = np.ascontiguousarray(self.srgb()[::step, ::step])
        return encode_png(codes, text={}, srgb=self.provenance.transfer == "srgb")

    @property
    def view_size(self) -> tuple[int, int]:
        """Width and height of a view in pixels."""
        return self.size[0] // self.layout.columns, self.size[1] // self.layout.rows

    def corner(self, number: int) -> tuple[int, int]:
        """Column and row of the top left pixel of view ``number``."""
        width, height = self.view_size
        right, up = number % self.layout.columns, number // self.layout.columns
        return right * width, self.size[1] - (up + 1) * height

    @checked
    def view(self, number: int) -> FloatArray:
        """``(height, width, 3)`` linear RGB of a view, 0 that of the leftmost camera.

        Raises
        ------
        UsageError
            There is no such view.
        """
        if not 0 <= number < self.layout.views:
            raise UsageError(f"{number}", parameter="number", rule=f"views are 0 to {self.layout.views - 1}")
        return linear_values(self.view_values(number), self.provenance.transfer)

    def view_values(self, number: int) -> Values:
        """``(height, width, 3)`` values of a view as they are held; shares the quilt's memory."""
        width, height = self.view_size
        column, row = self.corner(number)
        return self.values[row : row + height, column : column + width]

    def view_rows(self, first: int, last: int, left: int = 0, right: int | None = None) -> FloatArray:
        """``(views, last - first, right - left, 3)`` linear RGB of rows of all views, by default in full width."""
        right = self.view_size[0] if right is None else right
        rows = np.empty((self.layout.views, last - first, right - left, 3), dtype=np.float32)
        for number in range(self.layout.views):
            values = self.view_values(number)[first:last, left:right]
            rows[number] = linear_values(values, self.provenance.transfer)
        return rows


def quilt_of_display(
    display: Display, grid: tuple[int, int] | None = None, size: tuple[int, int] | None = None
) -> DeviceQuilt:
    """The quilt for a display.

    Parameters
    ----------
    display:
        The display; a device is recognized by its preset's name or by its serial number.
    grid:
        Columns and rows of views, 1 to 32 each. None: as recommended for the device.
    size:
        Width and height of the quilt in pixels, 256 to 16384 each. None: as recommended for the device. Of a stereo
        pair the shape says whether its views have the panel's shape or half of its width.

    Returns
    -------
    The quilt's size and layout, with the aspect ratio of the display's panel, of a print that of its trim.

    Raises
    ------
    UsageError
        If the grid is out of range, or no recommendation is known for what is None; an eye-tracked monitor is given
        other views than two side by side.
    PictureError
        If the size is out of range, or does not divide into views.
    """
    if grid is not None and not (1 <= grid[0] <= MOST_TILES and 1 <= grid[1] <= MOST_TILES):
        rule = f"there are 1 to {MOST_TILES} columns and rows"
        raise UsageError(f"{grid[0]}x{grid[1]} is out of range", parameter="views", rule=rule)
    if display.stereo is not None:
        return _pair_of_display(display, display.stereo, grid, size)
    layout = grid
    known = [
        device
        for device in DEVICE_QUILTS
        if device.display == display.name or (device.serial and display.name.startswith(device.serial))
    ]
    matching = [device for device in known if layout is None or device.layout[:2] == layout]
    if size is None and not matching:
        what = "no quilt is known" if layout is None else f"no quilt of {layout[0]}x{layout[1]} views is known"
        own = ", ".join(f"{device.layout[0]}x{device.layout[1]}" for device in known)
        rule = f"its own have {own}" if known else "'lippmann quilt sizes' lists those of devices"
        fix = "say views=... and size=..." if layout is None else "say size=..., too"
        raise UsageError(what, where=display.name, rule=rule, fix=fix)
    if layout is None:
        if not known:
            raise UsageError("the number of views is not known", where=display.name, fix="say views=..., too")
        layout = known[0].layout[:2]
    width, height = size or matching[0][1:3]
    trim = trim_of(display)
    aspect = float(f"{trim.width / trim.height:.6g}")
    quilt = DeviceQuilt(display.name, width, height, QuiltLayout(*layout, aspect))
    check_size(width, height, quilt.layout, "quilt")
    return quilt


def _pair_of_display(
    display: Display, stereo: StereoPair, grid: tuple[int, int] | None, size: tuple[int, int] | None
) -> DeviceQuilt:
    """The side-by-side picture of an eye-tracked monitor; parameters and errors as of :func:`quilt_of_display`."""
    if grid is not None and grid != (2, 1):
        rule = f"{display.name} shows one view to either eye"
        raise UsageError(f"{grid[0]}x{grid[1]}", parameter="views", rule=rule, fix="leave it out")
    panel = display.panel
    whole: dict[PairWidth, tuple[int, int]] = {
        "full": (2 * panel.width, panel.height),
        "half": (panel.width, panel.height),
    }
    width, height = size or whole[stereo.width]
    # To a pixel of either side, so that any whole size of that shape is one.
    fitting = [name for name, (w, h) in whole.items() if abs(width * h - height * w) <= max(w, h)]
    if not fitting:
        shapes = " or ".join(f"{w}x{h} ({name} width)" for name, (w, h) in whole.items())
        raise PictureError(
            f"it is {width} x {height} pixels", rule=f"pairs for {display.name} have the shape of {shapes}"
        )
    layout = QuiltLayout(2, 1, float(f"{panel.width / panel.height:.6g}"))
    check_size(width, height, layout, "pair")
    ending = replace(stereo, width=fitting[0]).ending
    return DeviceQuilt(display.name, width, height, layout, pair=ending)


def names_layout(path: Path) -> bool:
    """Whether a file's name says a quilt's layout."""
    return QUILT_NAME.search(path.stem) is not None or _PAIR.search(path.stem) is not None


def names_half_pair(path: Path) -> bool:
    """Whether a file's name says a stereo pair of half width, whose layout has the shape of the whole picture."""
    return path.stem.endswith("_half_2x1")


def ending_of_name(path: Path) -> str:
    """The ending of a file's stem that says its layout, as :attr:`DeviceQuilt.ending`; empty without one.

    Raises
    ------
    PictureError
        As :func:`layout_of_name`.
    """
    pair = _PAIR.search(path.stem)
    return pair[0] if pair else layout_of_name(path).ending if names_layout(path) else ""


def named_with_layout(path: Path, ending: str) -> Path:
    """The path with the ending of a quilt's layout in its name; as it is, to be refused, without a format's ending.

    Raises
    ------
    OutputError
        The name says another layout.
    """
    named = ending_of_name(path)
    if not named:
        return path.with_name(f"{path.stem}{ending}{path.suffix}") if path.suffix else path
    if named != ending:
        rule = f"the quilt's ends in {ending}{path.suffix}"
        raise OutputError("the name says another quilt", where=str(path), rule=rule, fix="leave the layout out")
    return path


def layout_of_name(path: Path, *, to_write: bool = False) -> QuiltLayout:
    """Columns, rows and aspect ratio from the file name of a quilt that is read, or is ``to_write``.

    Raises
    ------
    PictureError
        If the name has no layout, or its numbers are out of range.
    """
    if _PAIR.search(path.stem):
        return QuiltLayout(2, 1, None)
    match = QUILT_NAME.search(path.stem)
    if match is None:
        size = _SIZE.search(path.stem)
        layout = f'layout="{"x".join(size.groups())}"' if size else 'layout="8x6", or layout="2x1" of a pair'
        fix = f"say the columns and rows of views: {layout}"
        if to_write:
            fix = f"of 8 columns and 6 rows: {path.stem.partition('_qs')[0]}_qs8x6a0.75{path.suffix}"
        raise PictureError("the name does not say how many views there are", where=str(path), rule=_CONVENTION, fix=fix)
    aspect = None if match[3] is None else float(match[3].replace(",", "."))  # some languages' mark of decimals
    return checked_layout(int(match[1]), int(match[2]), aspect, where=str(path))


def checked_layout(columns: int, rows: int, aspect: float | None, *, where: str) -> QuiltLayout:
    """A layout as people write it in a file's name or on the command line, which ``where`` names.

    Raises
    ------
    PictureError
        If a number is out of range.
    """
    if not (1 <= columns <= MOST_TILES and 1 <= rows <= MOST_TILES):
        rule = f"there are 1 to {MOST_TILES} of both"
        raise PictureError(f"it says {columns} columns and {rows} rows", where=where, rule=rule)
    if aspect is not None and not 0.05 <= aspect <= 20:
        raise PictureError(f"the aspect is {aspect:g}", where=where, rule="it is width over height, 0.05 to 20")
    return QuiltLayout(columns, rows, aspect)


def check_size(width: int, height: int, layout: QuiltLayout, where: str) -> None:
    """Raise :class:`PictureError` unless a quilt of this layout can have this size in pixels.

    Its sides are multiples of columns and rows, or powers of two with an unused rest, as for the first devices.
    ``where`` names the file in messages.
    """
    for side, count, what in ((width, layout.columns, "wide"), (height, layout.rows, "high")):
        if not LEAST_SIDE <= side <= MOST_SIDE:
            rule = f"a quilt's sides are {LEAST_SIDE} to {MOST_SIDE} pixels"
            raise PictureError(f"it is {side} pixels {what}", where=where, rule=rule)
        if side % count and side & (side - 1):
            rule = f"it has {layout.columns}x{layout.rows} views, and {side} is no multiple of {count}"
            raise PictureError(f"it is {side} pixels {what}", where=where, rule=rule)
