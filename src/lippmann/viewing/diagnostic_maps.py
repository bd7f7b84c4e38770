"""Pictures for the page: maps of where pixels came from, parts of frames, what an eye sees; as data URIs."""

from __future__ import annotations

import base64

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.png import encode_png
from lippmann.color.transfer import quantize
from lippmann.image import IntegralImage
from lippmann.metrics import Comparison
from lippmann.metrics.error_image import BRIGHTEST, in_false_color
from lippmann.rendering.reprojection.common.point_image import INTERPOLATED, REPROJECTED, STATUS_LAYER, TRACED
from lippmann.viewing.replay import default_size, replay

Codes = NDArray[np.uint8]
Flags = NDArray[np.bool_]

#: Codes of the map of missed pixels: reprojected ones are dark, missed ones light by how they were filled.
REPROJECTED_CODE = (28, 32, 40)
TRACED_CODE = (240, 240, 236)
INTERPOLATED_CODE = (224, 140, 48)

#: What lies beside the chosen pixels of a frame; a colour that scenes do not have, so that black can be told from it.
EMPTY_CODE = (96, 60, 112)

#: Widest replayed picture, in pixels.
REPLAY_WIDTH = 512


def display_codes(image: IntegralImage) -> Codes:
    """``(H, W, 3)`` uint8: what the panel shows."""
    return _codes(image.pixels, image)


def replayed_codes(image: IntegralImage) -> Codes:
    """What an eye in the middle sees, at most :data:`REPLAY_WIDTH` pixels wide."""
    return _codes(replay(image, size=default_size(image.display, REPLAY_WIDTH)), image)


def missed_codes(image: IntegralImage) -> Codes | None:
    """A map of how each pixel came about, None if the picture does not tell."""
    status = pixel_status(image)
    if status is None:
        return None
    codes = np.empty((*status.shape, 3), dtype=np.uint8)
    codes[:] = REPROJECTED_CODE
    codes[status == TRACED] = TRACED_CODE
    codes[status == INTERPOLATED] = INTERPOLATED_CODE
    return codes


def part_codes(image: IntegralImage, chosen: Flags) -> Codes:
    """The chosen ``(H, W)`` pixels of a picture, the others in one colour."""
    codes = display_codes(image)
    codes[~chosen] = EMPTY_CODE
    return codes


def reprojected_codes(image: IntegralImage) -> Codes | None:
    """The pixels that reprojection filled, alone."""
    status = pixel_status(image)
    return None if status is None else part_codes(image, status == REPROJECTED)


def traced_codes(image: IntegralImage) -> Codes | None:
    """The pixels that were traced, alone."""
    status = pixel_status(image)
    return None if status is None else part_codes(image, status == TRACED)


def error_codes(comparison: Comparison) -> Codes:
    """The errors of a picture in false colour."""
    shown = in_false_color(np.sqrt(comparison.errors) / BRIGHTEST)
    return quantize(shown, 8, "linear").astype(np.uint8)


def pixel_status(image: IntegralImage) -> NDArray[np.int8] | None:
    """``(H, W)``: :data:`TRACED`, :data:`REPROJECTED` or :data:`INTERPOLATED`; None if the picture does not tell."""
    layer = image.maps.get(STATUS_LAYER)
    return None if layer is None else layer.astype(np.int8)


def data_uri(codes: Codes) -> str:
    """A PNG of ``(H, W, 3)`` codes inside a ``data:`` URI."""
    return "data:image/png;base64," + base64.b64encode(encode_png(codes, text={})).decode("ascii")


def _codes(linear: NDArray[np.float32], image: IntegralImage) -> Codes:
    return quantize(linear, 8, image.provenance.transfer).astype(np.uint8)
