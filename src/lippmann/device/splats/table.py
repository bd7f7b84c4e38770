"""Gaussian splats prepared for rays: what their alpha is computed from, and the hierarchy of their boxes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.device.splats.bvh import Floats, SplatBvh, make_bvh
from lippmann.errors import MemoryLimitError
from lippmann.runtime.machine import amount_in_words
from lippmann.scene.values.splats import Splats, rotation_matrices

#: Alpha below which a Gaussian does not count, as in the rasterizer of Kerbl et al. 2023.
LEAST_ALPHA = 1.0 / 255.0
#: Highest alpha (ibid.).
MOST_ALPHA = 0.99
#: A Gaussian flatter than this, in its largest standard deviation, is taken to be this flat: what single precision
#: tells apart.
_FLATTEST = 1e-6
#: Bytes of a Gaussian beside its harmonics: its row, its box, its share of the hierarchy, and what making them takes.
_BYTES = 420
_AT_A_TIME = 1 << 18


@dataclass(frozen=True, eq=False)
class SplatTable:
    """Gaussians that can be seen.

    Attributes
    ----------
    rows:
        ``(n, 13)`` float32: centre, the 3x3 matrix that takes offsets from it to standard deviations along its axes
        (row by row), and the opacity.
    harmonics:
        ``(n, 3, k)`` float32, a colour channel after the other.
    bvh:
        Over the boxes around where alpha reaches :data:`LEAST_ALPHA`.
    linear:
        As of :class:`~lippmann.scene.values.splats.Splats`.
    """

    rows: Floats
    harmonics: Floats
    bvh: SplatBvh
    linear: bool

    @property
    def bounds(self) -> NDArray[np.float64]:
        """``(2, 3)``: the box around all of them."""
        bounds: NDArray[np.float64] = self.bvh.boxes[0].astype(np.float64)
        return bounds


def make_table(splats: Splats, memory: int, *, name: str = "") -> SplatTable | None:
    """The table of those splats whose alpha reaches :data:`LEAST_ALPHA` anywhere; None if there are none.

    Parameters
    ----------
    memory:
        Bytes that it may take.
    name:
        Name of the scene, for the error.

    Raises
    ------
    MemoryLimitError
        It takes more.
    """
    need = splats.count * (_BYTES + 4 * splats.harmonics.shape[1] * 3)
    if need > memory:
        raise MemoryLimitError(
            f"{splats.count} Gaussian splats take {amount_in_words(need)} of memory",
            where=name,
            rule=f"{amount_in_words(memory)} are left",
            fix="allow more with memory=..., or leave faint ones out with min_opacity=...",
        )
    visible = np.flatnonzero(splats.opacities > LEAST_ALPHA)
    if not len(visible):
        return None
    rows, boxes = np.empty((len(visible), 13), np.float32), np.empty((len(visible), 2, 3), np.float32)
    for start in range(0, len(visible), _AT_A_TIME):
        part = visible[start : start + _AT_A_TIME]
        scales = splats.scales[part].astype(np.float64)
        scales = np.maximum(scales, np.maximum(_FLATTEST * scales.max(axis=1, keepdims=True), 1e-30))
        turns = rotation_matrices(splats.rotations[part])
        opacities = splats.opacities[part].astype(np.float64)
        centers = splats.centers[part].astype(np.float64)
        reach = np.sqrt(2.0 * np.log(opacities / LEAST_ALPHA))
        # The box about an ellipsoid: the length of each row of its axes.
        half = reach[:, None] * np.sqrt((np.square(turns) * np.square(scales)[:, None, :]).sum(axis=2))
        half = half * (1.0 + 1e-6) + 1e-6 * np.abs(centers)
        own = slice(start, start + len(part))
        rows[own, :3], rows[own, 12] = centers, opacities
        rows[own, 3:12] = (turns.transpose(0, 2, 1) / scales[:, :, None]).reshape(-1, 9)
        boxes[own, 0], boxes[own, 1] = centers - half, centers + half
    harmonics = np.ascontiguousarray(splats.harmonics[visible].transpose(0, 2, 1))
    return SplatTable(rows, harmonics, make_bvh(boxes), splats.linear)
