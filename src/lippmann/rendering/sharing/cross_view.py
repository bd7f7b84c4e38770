"""Light that the views of a quilt share before their noise is taken out.

The cameras of a quilt stand so close together that neighbours see nearly the same: the same points of the scene, a few
pixels further left or right, by light that hardly depends on where it is seen from. So every pixel takes the mean of
its own noisy light and of that which the views beside have at the same point; what is nearer counts more. The light of
a pixel is its colour over its albedo, so that textures stay where they are. Height and normal must agree. What is seen
in mirrors and through glass counts as lying as far behind as light travels to it, which is exact for flat ones.

That is done before the denoiser: what it leaves of the noise, and what it blurs with it, it leaves and blurs in all
views alike, so that sharing its results gains less (docs/background/quilts.md). What is told of the error includes what
sharing itself falsifies, such as highlights, which move over a surface from view to view: each half of the samples is
shared for itself, and judged by the other, which is not.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.display.view_cone import cone_tangent
from lippmann.rendering.sharing.cross_view_kernel import share

if TYPE_CHECKING:
    from lippmann.rendering.film.feature_buffers import Guides
    from lippmann.rendering.transport.ray_source import QuiltRays

Floats = NDArray[np.float32]

#: How far light is fetched to either side, as a part of a radian between cameras; farther, highlights are smeared.
REACH = 0.07


def share_views(pixels: Floats, source: QuiltRays, guides: Guides) -> Floats:
    """The noisy pixels of a quilt with less noise, ``(H, W, 3)`` float32.

    Parameters
    ----------
    pixels:
        ``(H, W, 3)`` linear RGB >= 0, one for each of ``source``.
    guides:
        Albedo, normal and height of the same pixels.
    """
    assert guides.height is not None
    slopes = ((2 * np.arange(source.views) + 1) / source.views - 1) * cone_tangent(source.display)
    albedo = guides.reflected()
    light = pixels / albedo
    step = 2 * cone_tangent(source.display) / source.views
    display_width, _ = source.display.size_mm
    shared = share(
        light,
        guides.normal,
        guides.height,
        slopes,
        source.columns,
        1 / source.display.viewing_distance,
        source.view_size[0] / display_width,
        int(REACH / step),
    )
    return np.asarray(shared * albedo, dtype=np.float32)
