"""Layouts by name: their list, the recognition of a file's layout, import and export.

Axes, names and units of a layout are defined in that layout's own module.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from lippmann.display import Display
from lippmann.errors import OutputError, PictureError, UsageError
from lippmann.exchange.eslf import read_eslf, write_eslf
from lippmann.exchange.hci import read_hci, write_hci
from lippmann.exchange.hci_parameters import NAME as HCI_PARAMETERS
from lippmann.exchange.lftoolbox_mat import read_matlab, write_matlab
from lippmann.exchange.light_field import DEPTH, WEIGHT, LightField, light_field_of, view_shape
from lippmann.exchange.view_folder import is_composable, read_view_folder, write_view_folder
from lippmann.exchange.zarr_store import read_zarr, write_zarr
from lippmann.image import IntegralImage, compose
from lippmann.image.stored_values import Stored
from lippmann.progress import ProgressCallback, silent

LayoutName = Literal["hci", "lftoolbox", "eslf", "zarr", "views"]
LAYOUTS: tuple[LayoutName, ...] = get_args(LayoutName)

_CODES: Mapping[int, Stored] = {8: "uint8", 16: "uint16"}

#: Type of the values by layout and bits.
_BITS: Mapping[LayoutName, Mapping[int, Stored]] = {
    "hci": _CODES,
    "lftoolbox": {**_CODES, 32: "float32"},
    "eslf": _CODES,
    "zarr": {**_CODES, 32: "float32"},
    "views": {**_CODES, 32: "float32"},
}
#: Endings of the layouts that are one file instead of a folder.
_ENDING: Mapping[LayoutName, str] = {"lftoolbox": ".mat", "eslf": ".png"}

#: Maps that a layout holds; Zarr holds all.
_MAPS: Mapping[LayoutName, tuple[str, ...]] = {"hci": (DEPTH,), "lftoolbox": (WEIGHT,), "eslf": (WEIGHT,), "views": ()}


@dataclass(frozen=True)
class Exported:
    """The result of an export.

    Attributes
    ----------
    stored:
        Type of the values in the file: ``uint8``, ``uint16``, ``float16`` or ``float32``.
    shape:
        ``(t, s, v, u)``: views down and across, rows and columns of a view.
    notes:
        One sentence for each part of the picture that the layout cannot hold.
    """

    stored: Stored
    shape: tuple[int, int, int, int]
    notes: tuple[str, ...]


def stored_in(layout: LayoutName, image_stored: Stored, bits: int | None) -> Stored:
    """Type in which a layout stores a picture's values.

    Parameters
    ----------
    layout:
        The layout.
    image_stored:
        Type of the picture's values: taken if ``bits`` is None and the layout has it. Otherwise floats are taken if the
        layout has them, else codes of 8 bits.
    bits:
        Bits per value, or None.

    Raises
    ------
    OutputError
        If the layout has no values of ``bits`` bits.
    """
    known = _BITS[layout]
    if bits is not None:
        if bits not in known:
            rule = f"{layout} has {', '.join(map(str, known))}"
            raise OutputError(f"{bits} bits per channel are not possible", parameter="bits", rule=rule)
        return known[bits]
    if image_stored in known.values() or (layout == "zarr" and image_stored == "float16"):
        return image_stored
    return "float32" if 32 in known else "uint8"


def with_ending(layout: str, path: Path) -> Path:
    """``path`` with the ending that the layout's files have, where it has none."""
    return path if path.suffix else path.with_suffix(_ENDING.get(_layout_name(layout), ""))


def check_target(layout: str, path: Path) -> LayoutName:
    """``layout`` as a :data:`LayoutName`, once ``path`` is known to have an ending that fits it.

    Raises
    ------
    UsageError
        If the layout is unknown.
    OutputError
        If the path has another ending than the layout's files.
    """
    name = _layout_name(layout)
    ending = _ENDING.get(name)
    if ending is not None and path.suffix.lower() != ending:
        raise OutputError(f"the ending is '{path.suffix}'", where=str(path), rule=f"{name} files end in {ending}")
    return name


def is_folder(layout: LayoutName) -> bool:
    """Whether the layout is a folder; otherwise it is one file."""
    return layout not in _ENDING


def export_image(
    image: IntegralImage,
    path: Path,
    layout: str,
    *,
    bits: int | None = None,
    distance: float | None = None,
    progress: ProgressCallback = silent,
) -> Exported:
    """Write an integral image in another tool's layout.

    Parameters
    ----------
    image:
        The picture. Its map ``depth`` becomes the ground truth of ``hci``; ``zarr`` holds all its maps.
    path:
        The file or folder; appears whole or not at all.
    layout:
        ``hci`` (4D Light Field Benchmark), ``lftoolbox`` (MATLAB file), ``eslf`` (PNG of micro-images), ``zarr`` or
        ``views`` (folder of pictures).
    bits:
        Bits per value: 8 or 16 for codes, 32 for floats in ``lftoolbox``, ``zarr`` and ``views``. None: as the picture
        is stored.
    distance:
        For ``hci`` and a display of parallel views: distance of the stand-in cameras in mm. None: 100 times the depth
        that the display resolves.
    progress:
        Called after every view or array.

    Raises
    ------
    UsageError
        If the layout is unknown, ``distance`` does not apply, or a library of the extra ``exchange`` is not installed.
    PictureError
        If the layout cannot hold the views of the picture's display.
    OutputError
        If the layout has no such ``bits``, or ``path`` cannot be written or has the wrong ending.
    """
    name = check_target(layout, path)
    if distance is not None and name != "hci":
        raise UsageError(f"does not apply to {name}", parameter="distance", fix="leave it out")
    light_field = light_field_of(image, stored_in(name, image.stored, bits))
    display = image.display
    if name == "hci":
        write_hci(light_field, display, path, distance=distance, progress=progress)
    elif name == "lftoolbox":
        write_matlab(light_field, display, path)
    elif name == "eslf":
        write_eslf(light_field, display, path)
    elif name == "zarr":
        write_zarr(light_field, path, progress=progress)
    else:
        write_view_folder(light_field, display, path, progress=progress)
    return Exported(light_field.stored, light_field.shape, tuple(_notes(image, name)))


def import_image(
    path: Path, layout: str | None = None, *, display: Display | None = None, progress: ProgressCallback = silent
) -> tuple[IntegralImage, tuple[str, ...]]:
    """Read a light field of another tool as an integral image.

    Parameters
    ----------
    path:
        The file or folder.
    layout:
        ``hci``, ``lftoolbox``, ``eslf``, ``zarr`` or ``views``. None: recognized by the ending, or by the files of the
        folder.
    display:
        The display of the picture; its views must match the file's in number and size. None: the display that the file
        names or describes.
    progress:
        Called after every view or array.

    Returns
    -------
    The picture, and one sentence for each part of the file that is left out.

    Raises
    ------
    UsageError
        If the layout is unknown, or a library of the extra ``exchange`` is not installed.
    PictureError
        If a file is missing or damaged, the views do not match the display, or there is no display.
    """
    name = recognize(path) if layout is None else _layout_name(layout)
    if name == "views" and is_composable(path):
        if display is not None:
            raise PictureError("names its own display", where=str(path), fix="leave display=... out")
        return compose(path, progress=progress), ()
    light_field = _read(path, name, display, progress)
    return light_field.image(display, where=str(path), layout=name), light_field.notes


def recognize(path: Path) -> LayoutName:
    """The layout of a file, by its ending, or of a folder, by the files in it.

    Raises
    ------
    PictureError
        If there is nothing at ``path``, or the layout is not recognized.
    """
    if path.is_dir():
        if any((path / name).exists() for name in (".zgroup", ".zattrs", "zarr.json")):
            return "zarr"
        if (path / HCI_PARAMETERS).exists() or any(path.glob("input_Cam*.png")):
            return "hci"
        return "views"
    if not path.exists():
        raise PictureError("not found", where=str(path))
    for name, ending in _ENDING.items():
        if path.suffix.lower() == ending:
            return name
    raise PictureError("the layout is not recognized", where=str(path), fix="say layout=...")


def _layout_name(text: str) -> LayoutName:
    if text not in LAYOUTS:
        raise UsageError.unknown("layout", text, LAYOUTS, parameter="layout")
    return text


def _read(path: Path, name: LayoutName, display: Display | None, progress: ProgressCallback) -> LightField:
    shape = None if display is None else view_shape(display)
    across_and_down = None if shape is None else (shape[1], shape[0])
    if name == "hci":
        return read_hci(path, progress=progress)
    if name == "lftoolbox":
        return read_matlab(path)
    if name == "eslf":
        return read_eslf(path, lens=across_and_down)
    if name == "zarr":
        return read_zarr(path, progress=progress)
    return read_view_folder(path, grid=across_and_down, progress=progress)


def _notes(image: IntegralImage, name: LayoutName) -> list[str]:
    notes = []
    if name == "hci" and DEPTH not in image.maps:
        notes.append("no ground truth is written: the picture has no layer depth")
    omitted = sorted(set(image.maps) - set(_MAPS.get(name, image.maps)))
    if omitted:
        notes.append(f"{name} cannot hold the layers {', '.join(omitted)}")
    return notes
