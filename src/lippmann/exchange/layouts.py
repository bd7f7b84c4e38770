"""Layouts by name: their list, the recognition of a file's layout, import and export.

Axes, names and units of a layout are defined in that layout's own module.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast

from lippmann.display import Display
from lippmann.errors import OutputError, PictureError, UsageError
from lippmann.exchange.hci_parameters import NAME as HCI_PARAMETERS
from lippmann.exchange.light_field import DEPTH, LightField, light_field_of
from lippmann.exchange.registry import EXPORTS, LAYOUTS, Export, Layout
from lippmann.exchange.view_folder import is_composable
from lippmann.image import IntegralImage, compose
from lippmann.image.stored_values import Stored
from lippmann.image.views import view_shape
from lippmann.options.option import checked
from lippmann.progress import ProgressCallback, silent
from lippmann.runtime.plugins import Plugin, function_of
from lippmann.runtime.regular_file import unreadable

#: Raw files of Lytro's cameras: micro-images before demosaicing and calibration.
_LYTRO = (".lfp", ".lfr", ".lfx")
#: Such files are as their makers like, those of the 4D Light Field Benchmark's predecessor (2013) among them.
_HDF5 = (".h5", ".hdf5")


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


def stored_in(layout: str, image_stored: Stored, bits: int | None) -> Stored:
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
    known = _layout(layout).bits
    if bits is not None:
        if bits not in known:
            rule = f"{layout} has {', '.join(map(str, known))}"
            raise OutputError(f"{bits} bits per channel are not possible", parameter="bits", rule=rule)
        return known[bits]
    if image_stored in known.values() or (layout == "zarr" and image_stored == "float16"):
        return image_stored
    return "float32" if 32 in known else "uint8"


def ending_of(layout: str) -> str:
    """The ending of the layout's files; none if they are folders."""
    return _layout(layout).ending


def with_ending(layout: str, path: Path) -> Path:
    """``path`` with the ending that the layout's files have, where it has none."""
    return path if path.suffix else path.with_suffix(ending_of(layout))


def check_target(layout: str, path: Path) -> None:
    """Check that a path has an ending that fits the layout.

    Raises
    ------
    UsageError
        If the layout is unknown.
    OutputError
        If the path has another ending than the layout's files.
    """
    ending = _layout(layout).ending
    if ending and path.suffix.lower() != ending:
        raise OutputError(f"the ending is '{path.suffix}'", where=str(path), rule=f"{layout} files end in {ending}")


def is_folder(layout: str) -> bool:
    """Whether the layout is a folder; otherwise it is one file."""
    return not _layout(layout).ending


@checked
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
        ``hci`` (4D Light Field Benchmark), ``lftoolbox`` (MATLAB file), ``eslf`` (PNG of micro-images), ``zarr``,
        ``views`` (folder of pictures), or one of another package.
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

    Examples
    --------
    >>> from pathlib import Path
    >>> from lippmann.exchange.layouts import export_image
    >>> image = lippmann.render("teapot", "mla-square", integrator="normal", spp=1)
    >>> exported = export_image(image, Path("views"), "views", bits=8)
    >>> len(list(Path("views").glob("*.png"))) > 1
    True
    """
    check_target(layout, path)
    plugin, target = _plugin(layout), _layout(layout)
    if distance is not None and "distance" not in target.write_options:
        raise UsageError(f"does not apply to {layout}", parameter="distance", fix="leave it out")
    light_field = light_field_of(image, stored_in(layout, image.stored, bits))
    values = {"distance": distance, "progress": progress}
    chosen = {name: value for name, value in values.items() if name in target.write_options}
    with plugin.guard(OutputError, str(path)):
        function_of(target.write)(light_field, image.display, path, **chosen)
    return Exported(light_field.stored, light_field.shape, tuple(_notes(image, layout)))


@checked
def import_image(
    path: Path, layout: str | None = None, *, display: Display | None = None, progress: ProgressCallback = silent
) -> tuple[IntegralImage, tuple[str, ...]]:
    """Read a light field of another tool as an integral image.

    Parameters
    ----------
    path:
        The file or folder.
    layout:
        ``hci``, ``lftoolbox``, ``eslf``, ``zarr``, ``views``, or one of another package. None: recognized by the
        ending, or by the files of the folder.
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

    Examples
    --------
    >>> from pathlib import Path
    >>> from lippmann.exchange.layouts import export_image, import_image
    >>> image = lippmann.render("teapot", "mla-square", integrator="normal", spp=1)
    >>> exported = export_image(image, Path("views"), "views", bits=8)
    >>> picture, notes = import_image(Path("views"))
    >>> picture.pixels.shape == image.pixels.shape
    True
    """
    name = recognize(path) if layout is None else layout
    if name == "views" and is_composable(path):
        if display is not None:
            raise PictureError("names its own display", where=str(path), fix="leave display=... out")
        return compose(path, progress=progress), ()
    light_field = _read(path, name, display, progress)
    notes = light_field.notes
    if layout is None and name == "eslf" and light_field.metadata is None:
        notes += (
            "taken for ESLF, micro-images side by side; whole views side by side are for 'lippmann weave --layout'",
        )
    return light_field.image(display, where=str(path), layout=name), notes


def recognize(path: Path) -> str:
    """The layout of a file, by its ending, or of a folder, by the files in it.

    Raises
    ------
    PictureError
        If there is nothing at ``path``, or the layout is not recognized.
    """
    if path.is_dir():
        if any((path / name).exists() for name in (".zgroup", ".zattrs", "zarr.json")):
            return "zarr"
        if (path / HCI_PARAMETERS).exists():
            return "hci"
        return "views"
    if not path.exists():
        raise unreadable(path, FileNotFoundError(), PictureError)
    ending = path.suffix.lower() or None  # of folders none
    own = [name for name in LAYOUTS if _layout(name).ending == ending]
    if matches := own or [name for name in _names() if _layout(name).ending == ending]:
        return matches[0]
    if ending in _LYTRO:
        fix = "decode them with the Light Field Toolbox or PlenoptiCam, and import the .mat file or the folder of views"
        raise PictureError("raw light fields are not read", where=str(path), fix=fix)
    if ending in _HDF5:
        fix = "save its views as pictures named by row and column, and import their folder"
        raise PictureError("HDF5 files are not read", where=str(path), fix=fix)
    raise PictureError("the layout is not recognized", where=str(path), fix="say layout=...")


def _plugin(name: str) -> Plugin[Export]:
    matches = EXPORTS.find(name)
    if matches is None or not isinstance(matches.value, Layout):
        raise UsageError.unknown("layout", name, _names(), parameter="layout", fix=EXPORTS.problems)
    return matches


def _names() -> list[str]:
    """All layouts, those of plugins too."""
    return [each for each in EXPORTS.claims() if not each.startswith(".")]


def _layout(name: str) -> Layout:
    """A layout by its name.

    Raises
    ------
    UsageError
        If it is unknown.
    """
    return cast("Layout", _plugin(name).value)


def _read(path: Path, name: str, display: Display | None, progress: ProgressCallback) -> LightField:
    plugin, layout = _plugin(name), _layout(name)
    if layout.read is None:
        raise PictureError(f"files of {name} are not read", where=str(path), rule=f"the plugin {plugin} writes them")
    shape = None if display is None else view_shape(display)
    values = {"grid": None if shape is None else (shape[1], shape[0]), "progress": progress}
    chosen = {option: value for option, value in values.items() if option in layout.read_options}
    with plugin.guard(PictureError, str(path)):
        result = function_of(layout.read)(path, **chosen)
    if not isinstance(result, LightField):
        what = f"the plugin {plugin} made a {type(result).__name__} of it"
        raise PictureError(what, where=str(path), rule="a layout is read as a LightField")
    return result


def _notes(image: IntegralImage, name: str) -> list[str]:
    notes = []
    if name == "hci" and DEPTH not in image.maps:
        notes.append("no ground truth is written: the picture has no layer depth")
    held = _layout(name).maps
    omitted = [] if held is None else sorted(set(image.maps) - {*held})
    if omitted:
        notes.append(f"{name} cannot hold the layers {', '.join(omitted)}")
    return notes
