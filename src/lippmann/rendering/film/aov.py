"""AOVs of the first surface: depth, normal, albedo, shape and position, as ground truth.

One ray through each pixel's centre, without averaging: the mean of two surfaces is neither. All layers are in the
display's frame (mm, +z toward the viewer).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide, to_numpy, transform_point, transform_vector
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.film.memory_model import LAYERS as BYTES
from lippmann.rendering.film.memory_model import Plan, Tile, cut_wavefronts
from lippmann.rendering.transport.first_surface import Surfaces, make_surfaces
from lippmann.rendering.transport.ray_source import RaySource
from lippmann.scene.matrices import normal_matrix

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.whitted.scene import BuiltClassic

FloatArray = NDArray[np.float32]

#: Layers and their channels.
LAYERS = {"depth": 1, "normal": 3, "albedo": 3, "shape": 1, "position": 3}


def plan_layers(source: RaySource, memory: int) -> Plan:
    """Tiles for the layers of a picture within ``memory`` bytes, those of the layers themselves included.

    Raises
    ------
    MemoryLimitError
        If that is too little for one row.
    """
    kept = source.width * source.height * BYTES
    return cut_wavefronts(source.width, source.height, 1, memory=memory, kept=kept)


def trace_layers(
    built: BuiltScene | BuiltClassic,
    source: RaySource,
    plan: Plan,
    display_from_world: NDArray[np.float64],
    progress: ProgressCallback = silent,
) -> dict[str, FloatArray]:
    """The first surface that the middle of each pixel sees.

    Parameters
    ----------
    built:
        The scene on the device.
    source:
        Rays of the pixels; of sub-pixels with rays of their own, those of the middle one.
    plan:
        Tiles from :func:`plan_layers`; the result is the same whatever they are.
    display_from_world:
        ``(4, 4)`` affine map to the display's frame.

    Returns
    -------
    float32 arrays by name, ``(H, W)`` or ``(H, W, 3)``:

    - ``depth``: z of the point seen in mm, positive in front of the lens plane, negative behind; minus infinity where
      nothing is seen.
    - ``position``: the point (x, y, z) in mm; not a number where nothing is seen.
    - ``normal``: unit normal that light is scattered by, normal map included, on the side that is seen; 0 where nothing
      is.
    - ``albedo``: linear RGB reflectance in [0, 1], see ``docs/reference/layers.md``; 0 where nothing is seen.
    - ``shape``: whole number of the shape, see ``docs/reference/layers.md``; -1 where nothing is seen.
    """
    surfaces = make_surfaces(built)
    layers = {
        name: np.zeros((plan.height, plan.width, channels)[: 2 if channels == 1 else 3], dtype=np.float32)
        for name, channels in LAYERS.items()
    }
    for tile in plan.tiles:
        rows = slice(tile.first_row, tile.first_row + tile.rows)
        for name, values in _trace_tile(surfaces, source, tile, plan.width, display_from_world).items():
            layers[name][rows] = values.reshape(layers[name][rows].shape)
        progress(Progress("layers", tile.first_row + tile.rows, plan.height))
    return layers


def _trace_tile(
    surfaces: Surfaces, source: RaySource, tile: Tile, width: int, display_from_world: NDArray[np.float64]
) -> dict[str, FloatArray]:
    lanes = tile.rows * width
    # Opaque, so that one kernel serves all tiles.
    row, column = divide(dr.arange(mi.UInt32, lanes), dr.opaque(mi.UInt32, width))
    row += dr.opaque(mi.UInt32, tile.first_row)
    ray = source.rays(column, row, mi.UInt32(1), mi.Point2f(0.5))  # the sub-pixel in the middle
    surface = surfaces.first_hit(ray)
    position = mi.Vector3f(transform_point(display_from_world, surface.p))
    position = dr.select(surface.hit, position, dr.nan)
    normal = mi.Vector3f(transform_vector(normal_matrix(display_from_world), surface.n))
    values = {
        "depth": dr.select(surface.hit, position.z, -dr.inf),
        "normal": dr.select(surface.hit, dr.normalize(normal), 0),
        "albedo": surface.albedo,
        "shape": dr.select(surface.hit, mi.Float(surface.shape), -1),
        "position": position,
    }
    dr.eval(values)
    return {name: to_numpy(value, lanes) for name, value in values.items()}
