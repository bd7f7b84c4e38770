"""Diagnostic maps of a picture: origin of pixels, estimated error, samples per pixel; as codes, PNG files, data
URIs."""

from __future__ import annotations

import base64
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.png import encode_png
from lippmann.color.transfer import quantize
from lippmann.image import IntegralImage
from lippmann.metrics import Comparison
from lippmann.metrics.error_image import BRIGHTEST, in_false_color
from lippmann.rendering.estimate.psnr import ERROR_LAYER
from lippmann.rendering.reprojection.point_image import INTERPOLATED, REPROJECTED, STATUS_LAYER, TRACED
from lippmann.runtime.atomic_write import replacing_folder
from lippmann.viewing.replay import default_size, replay

Codes = NDArray[np.uint8]
Flags = NDArray[np.bool_]

#: Codes of the map of pixel origins: reprojected pixels dark, missed ones by how they were filled.
REPROJECTED_CODE = (28, 32, 40)
TRACED_CODE = (240, 240, 236)
INTERPOLATED_CODE = (224, 140, 48)

#: Codes of the pixels that a partial picture leaves out: violet, which is unlike black.
EMPTY_CODE = (96, 60, 112)

#: Limit on the width of a replayed picture, in pixels.
REPLAY_WIDTH = 512


def display_codes(image: IntegralImage) -> Codes:
    """``(H, W, 3)`` uint8 codes of the native picture."""
    return _codes(image.pixels, image)


def replayed_codes(image: IntegralImage) -> Codes:
    """``(h, w, 3)`` uint8 codes of the picture that a central eye sees, at most :data:`REPLAY_WIDTH` pixels wide."""
    return _codes(replay(image, size=default_size(image.display, REPLAY_WIDTH)), image)


def missed_codes(image: IntegralImage) -> Codes | None:
    """``(H, W, 3)`` uint8 map of pixel origins: reprojected, traced or interpolated; None if the picture has none."""
    status = pixel_status(image)
    if status is None:
        return None
    codes = np.empty((*status.shape, 3), dtype=np.uint8)
    codes[:] = REPROJECTED_CODE
    codes[status == TRACED] = TRACED_CODE
    codes[status == INTERPOLATED] = INTERPOLATED_CODE
    return codes


def part_codes(image: IntegralImage, mask: Flags) -> Codes:
    """``(H, W, 3)`` uint8 codes of the pixels where ``mask`` ``(H, W)`` is True; the others are violet."""
    codes = display_codes(image)
    codes[~mask] = EMPTY_CODE
    return codes


def reprojected_codes(image: IntegralImage) -> Codes | None:
    """Codes of the reprojected pixels alone; None if the picture has no pixel origins."""
    status = pixel_status(image)
    return None if status is None else part_codes(image, status == REPROJECTED)


def traced_codes(image: IntegralImage) -> Codes | None:
    """Codes of the traced pixels alone; None if the picture has no pixel origins."""
    status = pixel_status(image)
    return None if status is None else part_codes(image, status == TRACED)


def error_codes(comparison: Comparison) -> Codes:
    """``(H, W, 3)`` uint8: root of the squared error of each pixel, in false colours."""
    return _error_codes(comparison.errors)


def pixel_status(image: IntegralImage) -> NDArray[np.int8] | None:
    """``(H, W)`` origin of pixels: ``TRACED``, ``REPROJECTED`` or ``INTERPOLATED``; None if the picture has none."""
    layer = image.maps.get(STATUS_LAYER)
    return None if layer is None else layer.astype(np.int8)


def data_uri(codes: Codes) -> str:
    """A ``data:`` URI with the PNG of ``(H, W, 3)`` uint8 codes."""
    return "data:image/png;base64," + base64.b64encode(encode_png(codes, text={})).decode("ascii")


def write_maps(image: IntegralImage, folder: Path) -> None:
    """Write the diagnostic maps of a picture as PNG files.

    - ``samples.png``: samples of each pixel, from none (dark) to the largest number (bright).
    - ``error.png``, for methods that estimate their noise: estimated error of each pixel in false colours, on the scale
      of ``lippmann compare --map``.
    - For methods that reproject: ``missed.png``, the origin of each pixel (dark: reprojected, light: missed and traced,
      orange: missed and interpolated), and ``reprojected.png``, ``traced.png`` and ``interpolated.png``, the pixels of
      one origin with the others violet. The last is written only if there are such pixels.

    Parameters
    ----------
    image:
        A rendered picture.
    folder:
        The folder; appears whole or not at all.

    Raises
    ------
    OutputError
        If the folder cannot be written.
    """
    from lippmann.rendering.methods import SAMPLES_LAYER  # loads the engine

    maps = _origin_maps(image)
    if ERROR_LAYER in image.maps:
        maps["error"] = _error_codes(np.asarray(image.maps[ERROR_LAYER], dtype=np.float32))
    samples = np.asarray(image.maps[SAMPLES_LAYER], dtype=np.float64)
    maps["samples"] = _false_color_codes(samples / max(1, int(samples.max())))
    with replacing_folder(folder) as temporary:
        for name, codes in maps.items():
            png = encode_png(codes, text={}, pixel_pitch=image.display.panel.pixel_pitch)
            (temporary / f"{name}.png").write_bytes(png)


def _origin_maps(image: IntegralImage) -> dict[str, Codes]:
    status, missed = pixel_status(image), missed_codes(image)
    if status is None or missed is None:
        return {}
    maps = {"missed": missed}
    for name, value in (("reprojected", REPROJECTED), ("traced", TRACED), ("interpolated", INTERPOLATED)):
        if name != "interpolated" or (status == value).any():
            maps[name] = part_codes(image, status == value)
    return maps


def _error_codes(squared_error: NDArray[np.floating]) -> Codes:
    return _false_color_codes(np.sqrt(squared_error) / BRIGHTEST)


def _false_color_codes(values: NDArray[np.floating]) -> Codes:
    return quantize(in_false_color(values.astype(np.float64)), 8, "linear").astype(np.uint8)


def _codes(linear: NDArray[np.float32], image: IntegralImage) -> Codes:
    return quantize(linear, 8, image.provenance.transfer).astype(np.uint8)
