"""How high over a plane splats and volumes begin to hide what lies behind them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from lippmann.device.pbr import BuiltScene
from lippmann.scene.matrices import transform_points
from lippmann.scene.values.description import Matrix

Reals = NDArray[np.float64]
Floats = NDArray[np.float32]
Integers = NDArray[np.intp]

#: Share of light ``(n,)`` that is left of rays with these origins, unit directions and lengths.
Transmittance = Callable[[Floats, Floats, Floats], Floats]

#: Halvings of the range of heights: to a thousandth of it.
_HALVINGS = 10


def half_stopped_by(
    built: BuiltScene, world_from_frame: Matrix, origins: Reals, directions: Reals, least: float, threads: int
) -> Iterator[Reals]:
    """Heights ``(n,)`` (z of the frame) at which rays have lost half of their light, to splats, and to a volume.

    Parameters
    ----------
    origins, directions:
        ``(..., 3)`` in the frame, which broadcast to n rays; all begin at one height, and directions have z = -1.
    least:
        Heights below are minus infinity.
    threads:
        CPU threads.
    """
    start, step = (values.reshape(-1, 3) for values in np.broadcast_arrays(origins, directions))
    world_start, world_step = transform_points(world_from_frame, start), step @ world_from_frame[:3, :3].T
    per_height = np.linalg.norm(world_step, axis=1)
    highest = start[:, 2]
    for transmittance in _media(built, threads):

        def is_stopped(which: Integers, heights: Reals, through: Transmittance = transmittance) -> NDArray[np.bool_]:
            lengths = (highest[which] - heights) * per_height[which]
            rays = world_start[which], world_step[which] / per_height[which, None], lengths
            return through(*(np.ascontiguousarray(values, np.float32) for values in rays)) < np.float32(0.5)

        every = np.arange(len(start))
        which = every[is_stopped(every, np.full(len(start), least))]
        low, high = np.full(len(which), least), highest[which]
        for _ in range(_HALVINGS if len(which) else 0):
            middle = (low + high) / 2.0
            is_above = is_stopped(which, middle)
            low, high = np.where(is_above, middle, low), np.where(is_above, high, middle)
        heights = np.full(len(start), -np.inf)
        heights[which] = low
        yield heights


def _media(built: BuiltScene, threads: int) -> Iterator[Transmittance]:
    if (splats := built.splats) is not None:
        from lippmann.device.splats import compositing

        yield lambda o, d, ends: compositing.composite(splats, o, d, ends, threads)[1]
    if (volume := built.volume) is not None:
        from lippmann.device.volumes import ray_march

        toward_light = np.array((0.0, 0.0, 1.0))  # colours are not looked at
        yield lambda o, d, ends: ray_march.composite(volume, o, d, ends, toward_light, threads)[1]
