"""Layouts by name: which there are, which one a file has, reading and writing them.

Each layout's axes, names and units are known to its own module alone.
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

#: Type of the values by bits, and layouts that are one file (with their ending) instead of a folder.
_BITS: Mapping[LayoutName, Mapping[int, Stored]] = {
    "hci": _CODES,
    "lftoolbox": {**_CODES, 32: "float32"},
    "eslf": _CODES,
    "zarr": {**_CODES, 32: "float32"},
    "views": {**_CODES, 32: "float32"},
}
_ENDING: Mapping[LayoutName, str] = {"lftoolbox": ".mat", "eslf": ".png"}

#: Layers that a layout keeps; Zarr keeps all.
_KEPT: Mapping[LayoutName, tuple[str, ...]] = {"hci": (DEPTH,), "lftoolbox": (WEIGHT,), "eslf": (WEIGHT,), "views": ()}


@dataclass(frozen=True)
class Exported:
    """What was written: type of the values, ``(t, s, v, u)``, and what did not go along, as sentences."""

    stored: Stored
    shape: tuple[int, int, int, int]
    notes: tuple[str, ...]


def stored_in(layout: LayoutName, image_stored: Stored, bits: int | None) -> Stored:
    """The type that a picture's values get: that of ``bits``, else their own where the layout has it.

    Raises
    ------
    OutputError
        If the layout has no such bits.
    """
    known = _BITS[layout]
    if bits is not None:
        if bits not in known:
            rule = f"{layout} has {', '.join(map(str, known))}"
            raise OutputError(f"{bits} bits per channel are not possible", where="--bits", rule=rule)
        return known[bits]
    if image_stored in known.values() or (layout == "zarr" and image_stored == "float16"):
        return image_stored
    return "float32" if 32 in known else "uint8"


def check_target(layout: str, path: Path) -> LayoutName:
    """The layout of that name; refuses unknown ones, and names that a layout's files cannot have.

    Raises
    ------
    UsageError, OutputError
        If the layout is unknown or the path has the wrong ending.
    """
    if layout not in LAYOUTS:
        rule = f"known are {', '.join(LAYOUTS)}"
        raise UsageError(f"the layout {layout!r} is unknown", where="--as", rule=rule)
    ending = _ENDING.get(layout)
    if ending is not None and path.suffix.lower() != ending:
        raise OutputError(f"the ending is '{path.suffix}'", where=str(path), rule=f"{layout} files end in {ending}")
    return layout


def is_folder(layout: LayoutName) -> bool:
    """Whether a layout is a folder instead of one file."""
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
        The picture; its map ``depth`` becomes ground truth in ``hci``, all its maps go into ``zarr``.
    path:
        The file or folder; appears whole or not at all.
    layout:
        ``hci``, ``lftoolbox``, ``eslf``, ``zarr`` or ``views``.
    bits:
        Per value, 8 or 16 for codes, 32 for floats where the layout has them; by default as the picture is stored.
    distance:
        For ``hci`` with parallel views: distance of the cameras that stand for them, in mm.

    Raises
    ------
    UsageError, PictureError, OutputError
        If the layout or the bits are unknown, the layout cannot hold such a display's views, or the place cannot be
        written.
    """
    name = check_target(layout, path)
    if distance is not None and name != "hci":
        raise UsageError(f"has no meaning for {name}", where="--distance", fix="leave it out")
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
        Its layout; by default as it looks.
    display:
        The display that shows it, instead of the one that it names or describes. Its views must be as many and of the
        same size.

    Returns
    -------
    The picture, and what was not taken along, as sentences.

    Raises
    ------
    UsageError, PictureError
        If the layout is unknown, something is missing, damaged or disagrees, or there is no display.
    """
    name = recognized(path) if layout is None else layout
    if name not in LAYOUTS:
        raise UsageError(f"the layout {name!r} is unknown", where="--as", rule=f"known are {', '.join(LAYOUTS)}")
    if name == "views" and is_composable(path):
        if display is not None:
            raise PictureError("names its own display", where=str(path), fix="leave --display out")
        return compose(path, progress=progress), ()
    light_field = _read(path, name, display, progress)
    return light_field.image(display, where=str(path), layout=name), light_field.notes


def recognized(path: Path) -> LayoutName:
    """The layout that a file or folder seems to have.

    Raises
    ------
    PictureError
        If it is missing, or there is no telling.
    """
    if path.is_dir():
        if any((path / name).exists() for name in (".zgroup", ".zattrs", "zarr.json")):
            return "zarr"
        if (path / HCI_PARAMETERS).exists() or any(path.glob("input_Cam*.png")):
            return "hci"
        return "views"
    if not path.exists():
        raise PictureError("is not there", where=str(path))
    for name, ending in _ENDING.items():
        if path.suffix.lower() == ending:
            return name
    raise PictureError("there is no telling which layout this is", where=str(path), fix="say --as")


def _read(path: Path, name: str, display: Display | None, progress: ProgressCallback) -> LightField:
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
        notes.append("there is no ground truth in it: render with --layers for one")
    left = sorted(set(image.maps) - set(_KEPT.get(name, image.maps)))
    if left:
        notes.append(f"{name} does not keep the layers {', '.join(left)}")
    return notes
