"""Makes the description of a scene from the grid of a volume."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.volume import Numbers, TransferFunction, Volume
from lippmann.scene.volumes.grid import check_values, storable
from lippmann.scene.volumes.presets import Kind, automatic, sample

#: From the axes of medical files, millimetres toward a patient's right, front and head, to the world: who looks along
#: -z with +y up faces the patient, head up.
WORLD_FROM_RAS = np.array([[-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
#: The same from left, back and head.
WORLD_FROM_LPS = WORLD_FROM_RAS @ np.diag([-1.0, -1.0, 1.0, 1.0])


def describe_volume(
    name: str,
    grid: NDArray[np.generic],
    world_from_voxel: Numbers,
    *,
    slope: float = 1.0,
    intercept: float = 0.0,
    kind: Kind | None = None,
    notes: Sequence[str] = (),
) -> SceneDescription:
    """A scene of one volume, shown by the transfer function that suits it; a note says which.

    ``grid`` ``(nz, ny, nx)`` may hold numbers of any kind. A negative ``slope`` turns them round.

    Raises
    ------
    SceneError
        The grid holds no voxel.
    """
    if grid.ndim != 3 or not grid.size:
        raise SceneError(f"its grid is {grid.shape}", where=name, rule="1 voxel or more along each of three axes")
    if slope < 0.0:
        grid, slope = -np.asarray(grid, np.float32), -slope
    stored, remark = storable(grid)
    check_values(stored, slope, intercept, name)
    transfer = automatic(sample(stored, slope, intercept), kind)
    depth, height, width = stored.shape
    volume = Volume(stored, np.asarray(world_from_voxel, np.float64), transfer, slope, intercept)
    size = f"{width} x {height} x {depth} voxels of {' x '.join(f'{side:.3g}' for side in volume.spacing)}"
    return SceneDescription(
        name, notes=[size, *notes, *([remark] if remark else []), transfer_note(transfer)], volume=volume
    )


def transfer_note(transfer: TransferFunction) -> str:
    """Note on the transfer function that shows a volume."""
    name, (first, last) = f" '{transfer.name}'" if transfer.name else "", transfer.values[[0, -1]]
    return f"shown by the transfer function{name}, values {first:.5g} to {last:.5g} (transfer_function)"
