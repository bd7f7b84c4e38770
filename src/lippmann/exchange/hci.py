"""Folders of the 4D Light Field Benchmark (version 2): one PNG per view, ground truth, and the cameras' parameters.

``input_Cam000.png`` is the top left view; the others follow row by row. Ground truth is depth along the axis in metres
(``gt_depth_...pfm``) and disparity in pixels per view (``gt_disp_...pfm``), defined in
:mod:`lippmann.exchange.cameras`. Where a ray meets nothing, depth is infinite and disparity NaN.

- ``..._lowres`` and ``..._highres``: the middle view (with an even number of views the one after the middle). The
  second has ``depth_map_scale`` times the resolution of the first, here 1.
- ``..._lowres_Cam000`` and so on: every view, as in the benchmark's set "all views".

``depth_in_mm.png`` shows the middle view's heights to eyes, with a legend; it is not part of the layout and never read.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.pfm import read_pfm, write_pfm
from lippmann.color.transfer import quantize
from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.exchange.cameras import Cameras
from lippmann.exchange.hci_parameters import NAME, Parameters, read_parameters, write_parameters
from lippmann.exchange.light_field import DEPTH, LightField, check_rectangular, check_shape
from lippmann.exchange.metadata_text import read_note_file, write_note_file
from lippmann.exchange.view_folder import read_view_files, write_view
from lippmann.image import Provenance
from lippmann.image.height_shades import height_legend, height_shades
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.runtime.atomic_write import replacing_folder

LAYOUT = "hci"
HEIGHTS = "depth_in_mm.png"

#: A legend can be read from so many rows on.
_LEGEND_ROWS = 128
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
    """Write a folder in the layout of the benchmark.

    Parameters
    ----------
    light_field:
        Codes of 8 or 16 bits. A map ``depth`` becomes the ground truth.
    display:
        The display whose views these are.
    folder:
        The folder; appears whole or not at all.
    distance:
        For parallel views only: distance of the stand-in cameras from the lens plane, in mm. None: 100 times the depth
        range that the display resolves.
    progress:
        Called after every view.

    Raises
    ------
    UsageError
        If ``distance`` is not positive, or the views are not parallel.
    PictureError
        If the display's views are not those of a rectangular grid of cameras, or a surface lies so far behind the lens
        plane that stand-in cameras cannot show it.
    OutputError
        If the folder cannot be written.
    """
    check_rectangular(display, "the benchmark's layout")
    cameras = Cameras.of_display(display, distance)
    truth = None
    if DEPTH in light_field.maps:
        truth = _Truth.of(cameras, _heights(light_field.maps[DEPTH], light_field.mask))
    down, across, height, width = light_field.shape
    with replacing_folder(folder) as temporary:
        for number in range(down * across):
            view = divmod(number, across)
            name = f"input_Cam{number:03}.png"
            write_view(temporary / name, "png", light_field.values[view], light_field.transfer)
            if truth is not None:
                truth.write(temporary, view, f"lowres_Cam{number:03}")
            progress(Progress("write", number + 1, down * across))
        disparities = None
        if truth is not None:
            middle = down // 2, across // 2
            _show_heights(temporary / HEIGHTS, _heights(light_field.maps[DEPTH], light_field.mask)[middle])
            for end in ("lowres", "highres"):
                truth.write(temporary, middle, end)
            disparities = truth.disparity[np.isfinite(truth.disparity)]
        parameters = Parameters(across, down, width, height, cameras)
        write_parameters(temporary / NAME, parameters, _meta(light_field, display, cameras, disparities))
        write_note_file(temporary, light_field.metadata, LAYOUT)


def read_hci(folder: Path, *, progress: ProgressCallback = silent) -> LightField:
    """Read a folder in the layout of the benchmark.

    Ground truth of all views becomes the map ``depth``. Ground truth of the middle view alone is checked but not
    returned; a note says so.

    Raises
    ------
    PictureError
        If a file is missing or damaged, or views differ from the parameters in number or size.
    """
    parameters = read_parameters(folder / NAME)
    shape = (parameters.down, parameters.across, parameters.height, parameters.width)
    check_shape((*shape, 3), str(folder / NAME))
    metadata = read_note_file(folder, LAYOUT)
    names = _view_names(folder, parameters)
    paths = [[folder / name for name in row] for row in names]
    values, notes = read_view_files(paths, progress)
    if values.shape[2:4] != shape[2:]:
        rule = f"{NAME} says {parameters.width} x {parameters.height}"
        raise PictureError(f"has {values.shape[3]} x {values.shape[2]} pixels", where=str(paths[0][0]), rule=rule)
    cameras = parameters.cameras
    if metadata is not None and np.isinf(metadata.display.viewing_distance):
        cameras = Cameras(cameras.baseline, cameras.focus_distance, cameras.pixel_pitch, parallel=True)
    depth, left_out = _read_truth(folder, parameters)
    maps = {}
    if depth is not None:
        with np.errstate(all="ignore"):  # an overflow is infinitely far
            maps[DEPTH] = cameras.height(depth.astype(np.float64)).astype(np.float32)
    return LightField(values, metadata, maps, cameras, notes=notes + left_out)


# ---- Views ---------------------------------------------------------------------------------------------------------


def _view_names(folder: Path, parameters: Parameters) -> list[list[str]]:
    """File names of the views in rows; a file beyond them raises :class:`PictureError`."""
    count = parameters.across * parameters.down
    numbers = [int(match[1]) for path in folder.iterdir() if (match := _VIEW.fullmatch(path.name))]
    if beyond := [number for number in numbers if number >= count]:
        rule = f"{NAME} says {parameters.across} x {parameters.down} views"
        raise PictureError("is one view too many", where=str(folder / f"input_Cam{min(beyond):03}.png"), rule=rule)
    names = [f"input_Cam{number:03}.png" for number in range(count)]
    return [names[row * parameters.across : (row + 1) * parameters.across] for row in range(parameters.down)]


# ---- Ground truth --------------------------------------------------------------------------------------------------


def _show_heights(path: Path, heights: NDArray[np.float64]) -> None:
    """Heights ``(v, u)`` as shades beside a legend; views of few pixels are enlarged to the legend's height."""
    shades, ends = height_shades(heights, np.isfinite(heights))
    times = -(-_LEGEND_ROWS // len(shades))
    enlarged = np.repeat(np.repeat(shades, times, axis=0), times, axis=1)[..., None].repeat(3, axis=2)
    codes = np.concatenate([enlarged, height_legend(len(enlarged), ends)], axis=1)
    write_view(path, "png", quantize(codes, 8, "linear"), "srgb")


def _heights(depth: NDArray[Any], mask: NDArray[np.bool_] | None) -> NDArray[np.float64]:
    """Heights over the lens plane in mm; minus infinity where no pixel belongs to a value."""
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
    """Distances along the axis in mm ``(t, s, v, u)``, None unless the folder has those of all views; and notes."""
    count = parameters.across * parameters.down
    kinds = [kind for kind in ("depth", "disp") if any(folder.glob(f"gt_{kind}_lowres_Cam*.pfm"))]
    alone = [kind for kind in ("depth", "disp") if (folder / f"gt_{kind}_lowres.pfm").exists()]
    for kind in alone:
        _read_map(folder, kind, "lowres", parameters)
    if not kinds:
        note = "ground truth of a single view is left out"
        return None, (note,) if alone else ()
    views = [_read_map(folder, kinds[0], f"lowres_Cam{number:03}", parameters) for number in range(count)]
    truth = np.stack(views).reshape(parameters.down, parameters.across, *views[0].shape).astype(np.float64)
    return truth * _METRE if kinds[0] == "depth" else parameters.cameras.depth_of_disparity(truth), ()


def _read_map(folder: Path, kind: str, end: str, parameters: Parameters) -> NDArray[np.float32]:
    path = folder / f"gt_{kind}_{end}.pfm"
    values = read_pfm(path)
    if values.shape != (parameters.height, parameters.width):
        rule = f"{NAME} says {parameters.width} x {parameters.height}"
        raise PictureError(f"has {values.shape[1]} x {values.shape[0]} values", where=str(path), rule=rule)
    if kind == "depth" and np.isnan(values).any():
        raise PictureError("holds NaN", where=str(path))
    return values


def _meta(
    light_field: LightField, display: Display, cameras: Cameras, disparities: NDArray[np.float32] | None
) -> dict[str, str | float]:
    """The section ``meta``. Disparities range over the ground truth, else over the depth that the display resolves."""
    near, far = (float(cameras.disparity_of_height(np.array(z))) for z in display.depth_budget)
    lowest, highest = far, near
    if disparities is not None and disparities.size:
        lowest, highest = float(disparities.min()), float(disparities.max())
    provenance = Provenance() if light_field.metadata is None else light_field.metadata.provenance
    return {
        "scene": provenance.scene,
        "category": "additional",
        "date": "",
        "version": provenance.version,
        "authors": "",
        "contact": "",
        "cycles_seed": provenance.seed or 0,
        "disp_min": lowest,
        "disp_max": highest,
        "frustum_disp_min": far,
        "frustum_disp_max": near,
        "depth_map_scale": 1.0,
    }
