"""``--maps``: how the pixels of a picture came about and how good they are, as a folder of PNGs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lippmann.runtime.atomic_write import replacing_folder

if TYPE_CHECKING:
    from lippmann.image import IntegralImage


def write_maps(image: IntegralImage, folder: Path) -> None:
    """Write what the picture knows of itself.

    - Of methods that reuse points: ``missed.png`` (dark pixels were reprojected, light ones missed and traced, orange
      ones missed and interpolated), and ``reprojected.png``, ``traced.png`` and, where any were, ``interpolated.png``:
      the pixels of one origin alone, the rest in violet.
    - Of methods that know their noise: ``error.png``, the estimated error of each pixel, in the false colours of
      ``lippmann compare --map``.
    - Of all methods: ``samples.png``, the samples of each pixel from none (dark) to the most of any pixel (bright).

    Raises
    ------
    OutputError
        If the folder cannot be written.
    """
    from lippmann.codecs.png import encode_png

    pictures = {**_origins(image), **_errors(image), **_samples(image)}
    with replacing_folder(folder) as temporary:
        for name, codes in pictures.items():
            png = encode_png(codes, text={}, pixel_pitch=image.display.panel.pixel_pitch)
            (temporary / f"{name}.png").write_bytes(png)


def _origins(image: IntegralImage) -> dict[str, Any]:
    from lippmann.rendering.reprojection.common.point_image import INTERPOLATED, REPROJECTED, TRACED
    from lippmann.viewing.diagnostic_maps import missed_codes, part_codes, pixel_status

    status, missed = pixel_status(image), missed_codes(image)
    if status is None or missed is None:
        return {}
    pictures = {"missed": missed}
    for name, value in (("reprojected", REPROJECTED), ("traced", TRACED), ("interpolated", INTERPOLATED)):
        if name != "interpolated" or (status == value).any():
            pictures[name] = part_codes(image, status == value)
    return pictures


def _errors(image: IntegralImage) -> dict[str, Any]:
    from lippmann.metrics.error_image import BRIGHTEST
    from lippmann.rendering.estimate.psnr import ERROR_LAYER

    if ERROR_LAYER not in image.maps:
        return {}
    return {"error": _in_false_color(np.sqrt(image.maps[ERROR_LAYER]) / BRIGHTEST)}


def _samples(image: IntegralImage) -> dict[str, Any]:
    from lippmann.rendering.methods import SAMPLES_LAYER

    samples = image.maps[SAMPLES_LAYER]
    return {"samples": _in_false_color(samples / max(1, int(samples.max())))}


def _in_false_color(values: Any) -> Any:
    from lippmann.color.transfer import quantize
    from lippmann.metrics.error_image import in_false_color

    return quantize(in_false_color(values), 8, "linear").astype(np.uint8)
