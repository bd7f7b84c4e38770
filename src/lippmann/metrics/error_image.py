"""Error maps: the errors of a picture's pixels in false colour."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.display.micro_image_layout import lens_indices
from lippmann.image import IntegralImage, Provenance
from lippmann.metrics.comparison import Comparison
from lippmann.metrics.silhouettes import find_silhouettes

#: The root-mean-square error of a pixel (coded values, 0 to 1) that gets the brightest colour.
BRIGHTEST = 0.25

#: Display codes of the scale at equal steps from no error to :data:`BRIGHTEST` and above; their lightness rises evenly.
SCALE = np.array(
    [
        (0.0, 0.0, 0.02),
        (0.24, 0.05, 0.42),
        (0.58, 0.15, 0.40),
        (0.87, 0.32, 0.23),
        (0.98, 0.60, 0.04),
        (0.99, 1.0, 0.65),
    ]
)

#: PSNR in dB that the layer ``micro_image_psnr`` holds for micro-images without any error.
NO_ERROR_PSNR = 999.0


def error_map(comparison: Comparison) -> IntegralImage:
    """The error of every pixel in the colours of :data:`SCALE`, as an integral image of the same display.

    Its layers, which OpenEXR files carry: ``error``, the root-mean-square difference of a pixel's coded channels;
    ``micro_image_psnr``, that of the pixel's lens in dB (:data:`NO_ERROR_PSNR` without error); ``silhouettes``, 1 on
    silhouettes and 0 off them. All are ``(H, W)`` float32.
    """
    errors = np.sqrt(comparison.errors)
    layers = {
        "error": errors.astype(np.float32),
        "micro_image_psnr": _psnr_of_pixels(comparison),
        "silhouettes": find_silhouettes(comparison.reference).mask.astype(np.float32),
    }
    provenance = Provenance(
        method="error map",
        scene=comparison.reference.provenance.scene,
        transfer="linear",
        notes=(f"coded root-mean-square errors from 0 (dark) to {BRIGHTEST} and above (bright)",),
    )
    return IntegralImage(
        in_false_color(errors / BRIGHTEST),
        comparison.reference.display,
        comparison.reference.world_from_display,
        provenance,
        layers,
    )


def in_false_color(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Display codes ``(H, W, 3)`` in [0, 1] of ``(H, W)`` values; those outside [0, 1] get the end of the scale."""
    steps = np.linspace(0, 1, len(SCALE))
    colors: NDArray[np.float32] = np.stack(
        [np.interp(values, steps, SCALE[:, channel]) for channel in range(3)], axis=-1, dtype=np.float32
    )
    return colors


def _psnr_of_pixels(comparison: Comparison) -> NDArray[np.float32]:
    with np.errstate(divide="ignore"):
        values = np.minimum(-10 * np.log10(comparison.micro_image_errors), NO_ERROR_PSNR)
    spread: NDArray[np.float32] = values.astype(np.float32).ravel()[lens_indices(comparison.reference.display)]
    return spread
