"""How much of a picture shows anything of the scene, for a warning where it is next to nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.film.wavefront import RayTotals
from lippmann.scene.values.description import Color

#: Pictures that show less than this share of anything carry a warning.
LEAST_SHARE = 0.01


def seen_share(pixels: NDArray[np.float32] | None, background: Color | None, rays: RayTotals, samples: int) -> float:
    """Share of a picture's pixels that may show something of the scene, at most 1.

    Parameters
    ----------
    pixels:
        ``(height, width, 3)`` linear radiance; None where the picture is not at hand.
    background:
        What rays see that meet nothing; None where that differs from ray to ray.
    rays:
        Rays traced for the picture.
    samples:
        Samples of the whole picture, all channels.

    Returns
    -------
    float
        The share of pixels unlike the background. Where that is not known, the rays that go on from surfaces over the
        samples: an upper bound, as every sample that meets a surface sends at least one, black surfaces apart.
    """
    if pixels is not None and background is not None:
        step = max(1, len(pixels) // 1024)  # some rows of large pictures tell as much
        unlike = np.abs(pixels[::step] - np.asarray(background, dtype=np.float32)) > 1e-3
        return float(unlike.any(axis=-1).mean())
    return min(1.0, (rays.shadow + rays.secondary) / samples)


def warn_of_emptiness(share: float) -> tuple[str, ...]:
    """The warning, or nothing."""
    if share >= LEAST_SHARE:
        return ()
    shown = "nothing" if share == 0 else f"{share:.1%} of it shows anything"
    return (f"the picture is nearly empty ({shown}): place the scene by camera, turn, scale or shift",)
