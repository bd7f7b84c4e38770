"""Folders of the 4D Light Field Benchmark (version 2): one PNG per view, ground truth, and the cameras' parameters.

``input_Cam000.png`` is the view from the top left, the others follow row by row. ``gt_depth_lowres.pfm`` (metres along
the axis) and ``gt_disp_lowres.pfm`` (pixels from view to view) belong to the view in the middle, or, of an even number,
to the one after the middle; ``..._highres`` to the same view, ``depth_map_scale`` times finer, here 1; and
``..._lowres_Cam000.pfm`` and so on to every view, as in the benchmark's own "all views". See
:mod:`lippmann.exchange.cameras` for what they mean.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.pfm import read_pfm, write_pfm
from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.exchange.cameras import Cameras
from lippmann.exchange.hci_parameters import NAME, Parameters, read_parameters, write_parameters
from lippmann.exchange.light_field import DEPTH, LightField, check_rectangular, check_shape
from lippmann.exchange.metadata_text import read_note_file, write_note_file
from lippmann.exchange.view_files import read_view_files, write_view
from lippmann.image import Provenance
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.runtime.atomic_write import replacing_folder

LAYOUT = "hci"

_VIEW = re.compile(r"input_Cam(\d{3,6})\.png")
_METRE = 1000.0


def write_hci(
    light_field: LightField,
    display: Display,
    folder: Path,
    *,
    distance: float | None = None,
    progress: ProgressCallback = silent,
) -> None:
    """Write a folder of the benchmark.

    Parameters
    ----------
    light_field:
        Codes of 8 or 16 bits; its map ``depth``, if it has one, becomes the ground truth.
    display:
        The display whose views these are.
    folder:
        The folder; appears whole or not at all.
    distance:
        Distance of the stand-in cameras of parallel views, see :meth:`Cameras.of_display`.

    Raises
    ------
    UsageError, PictureError, OutputError
        If the distance will not do, the display's views are not what a grid of cameras sees, a surface lies beyond what
        stand-in cameras see, or the folder cannot be written.
    """
    check_rectangular(display, "the benchmark's layout")
    cameras = Cameras.of_display(display, distance)
    truth = None
    if DEPTH in light_field.maps:
        truth = _Truth.of(cameras, _seen(light_field.maps[DEPTH], light_field.mask))
    down, across, height, width = light_field.shape
    with replacing_folder(folder) as temporary:
        for number in range(down * across):
            at = divmod(number, across)
            name = f"input_Cam{number:03}.png"
            write_view(temporary / name, "png", light_field.values[at], light_field.transfer)
            if truth is not None:
                truth.write(temporary, at, f"lowres_Cam{number:03}")
            progress(Progress("write", number + 1, down * across))
        disparities = None
        if truth is not None:
            middle = down // 2, across // 2
            for end in ("lowres", "highres"):
                truth.write(temporary, middle, end)
            disparities = truth.disparity[middle][np.isfinite(truth.depth[middle])]
        parameters = Parameters(across, down, width, height, cameras)
        write_parameters(temporary / NAME, parameters, _meta(light_field, display, cameras, disparities))
        write_note_file(temporary, light_field.metadata, LAYOUT)


def read_hci(folder: Path, *, progress: ProgressCallback = silent) -> LightField:
    """Read a folder of the benchmark.

    Every view has to be there, of the size that the parameters say. Ground truth of all views becomes the map
    ``depth``; that of the middle alone is checked and left, as the notes say then.

    Raises
    ------
    PictureError
        If a file is missing or damaged, or sizes and numbers disagree; names the file.
    """
    parameters = read_parameters(folder / NAME)
    shape = (parameters.down, parameters.across, parameters.height, parameters.width)
    check_shape((*shape, 3), str(folder / NAME))
    metadata = read_note_file(folder, LAYOUT)
    names = _view_names(folder, parameters)
    paths = [[folder / name for name in row] for row in names]
    values = read_view_files(paths, "srgb" if metadata is None else metadata.provenance.transfer, progress)
    if values.shape[2:4] != shape[2:]:
        rule = f"{NAME} says {parameters.width} x {parameters.height}"
        raise PictureError(f"has {values.shape[3]} x {values.shape[2]} pixels", where=str(paths[0][0]), rule=rule)
    cameras = parameters.cameras
    if metadata is not None and np.isinf(metadata.display.viewing_distance):
        cameras = Cameras(cameras.baseline, cameras.focus_distance, cameras.pixel_pitch, parallel=True)
    depth, notes = _read_truth(folder, parameters)
    maps = {}
    if depth is not None:
        with np.errstate(all="ignore"):  # what is too far for a number is infinitely far
            maps[DEPTH] = cameras.height(depth.astype(np.float64)).astype(np.float32)
    return LightField(values, metadata, maps, cameras, notes=notes)


# ---- Views ---------------------------------------------------------------------------------------------------------


def _view_names(folder: Path, parameters: Parameters) -> list[list[str]]:
    """The files of the views in rows; refuses views beyond those that the parameters speak of."""
    count = parameters.across * parameters.down
    numbers = [int(found[1]) for path in folder.iterdir() if (found := _VIEW.fullmatch(path.name))]
    if beyond := [number for number in numbers if number >= count]:
        rule = f"{NAME} says {parameters.across} x {parameters.down} views"
        raise PictureError("is one view too many", where=str(folder / f"input_Cam{min(beyond):03}.png"), rule=rule)
    names = [f"input_Cam{number:03}.png" for number in range(count)]
    return [names[row * parameters.across : (row + 1) * parameters.across] for row in range(parameters.down)]


# ---- Ground truth --------------------------------------------------------------------------------------------------


def _seen(depth: NDArray[Any], mask: NDArray[np.bool_] | None) -> NDArray[np.float64]:
    """The heights, minus infinity where no pixel stands behind a value."""
    return np.where(True if mask is None else mask, depth, -np.inf).astype(np.float64)


@dataclass(frozen=True, eq=False)
class _Truth:
    """Depth in metres along the axis and disparity in pixels of all views, ``(t, s, v, u)``."""

    depth: NDArray[np.float32]
    disparity: NDArray[np.float32]

    @staticmethod
    def of(cameras: Cameras, heights: NDArray[np.float64]) -> _Truth:
        depth = cameras.axial_depth(heights) / _METRE
        return _Truth(depth.astype(np.float32), cameras.disparity_of_height(heights).astype(np.float32))

    def write(self, folder: Path, view: tuple[int, int], end: str) -> None:
        write_pfm(folder / f"gt_depth_{end}.pfm", self.depth[view])
        write_pfm(folder / f"gt_disp_{end}.pfm", self.disparity[view])


def _read_truth(folder: Path, parameters: Parameters) -> tuple[NDArray[np.float64] | None, tuple[str, ...]]:
    """Distances along the axis in mm ``(t, s, v, u)``, if the folder has those of all views; notes on what it has."""
    count = parameters.across * parameters.down
    kinds = [kind for kind in ("depth", "disp") if any(folder.glob(f"gt_{kind}_lowres_Cam*.pfm"))]
    alone = [kind for kind in ("depth", "disp") if (folder / f"gt_{kind}_lowres.pfm").exists()]
    for kind in alone:
        _read_map(folder / f"gt_{kind}_lowres.pfm", parameters)
    if not kinds:
        note = "the ground truth is that of one view only and is not taken along"
        return None, (note,) if alone else ()
    views = [_read_map(folder / f"gt_{kinds[0]}_lowres_Cam{number:03}.pfm", parameters) for number in range(count)]
    truth = np.stack(views).reshape(parameters.down, parameters.across, *views[0].shape).astype(np.float64)
    return truth * _METRE if kinds[0] == "depth" else parameters.cameras.depth_of_disparity(truth), ()


def _read_map(path: Path, parameters: Parameters) -> NDArray[np.float32]:
    values = read_pfm(path)
    if values.shape != (parameters.height, parameters.width):
        rule = f"{NAME} says {parameters.width} x {parameters.height}"
        raise PictureError(f"has {values.shape[1]} x {values.shape[0]} values", where=str(path), rule=rule)
    if np.isnan(values).any():
        raise PictureError("holds values that are no numbers", where=str(path))
    return values


def _meta(
    light_field: LightField, display: Display, cameras: Cameras, disparities: NDArray[np.float32] | None
) -> dict[str, Any]:
    """The section that describes the scene. Its range of disparities is the truth's, the frustum's what is resolved."""
    near, far = (float(cameras.disparity_of_height(np.array(z))) for z in display.depth_budget)
    lowest, highest = far, near
    if disparities is not None and disparities.size:
        lowest, highest = float(disparities.min()), float(disparities.max())
    made = Provenance() if light_field.metadata is None else light_field.metadata.provenance
    return {
        "scene": made.scene,
        "category": "additional",
        "date": "",
        "version": made.version,
        "authors": "",
        "contact": "",
        "cycles_seed": made.seed or 0,
        "disp_min": lowest,
        "disp_max": highest,
        "frustum_disp_min": far,
        "frustum_disp_max": near,
        "depth_map_scale": 1.0,
    }
