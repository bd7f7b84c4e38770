"""JPEG pixels of DICOM files decoded by ``imagecodecs``, as a plugin of ``pydicom``.

Pillow, which pydicom uses, reads neither lossless JPEG, as which most archives of clinics keep slices, nor JPEG of 12
bits, nor JPEG-LS. The names of the plugin's parts are pydicom's ("Decoding plugins", pydicom 3).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pydicom import uid
from pydicom.pixels import get_decoder

_JPEG = (uid.JPEGExtended12Bit, uid.JPEGLossless, uid.JPEGLosslessSV1)
_JPEG_LS = (uid.JPEGLSLossless, uid.JPEGLSNearLossless)

DECODER_DEPENDENCIES = dict.fromkeys((*_JPEG, *_JPEG_LS), ("imagecodecs",))


def add_decoders() -> None:
    """Let pydicom decode by this module what its other plugins do not."""
    for syntax in DECODER_DEPENDENCIES:
        get_decoder(syntax).add_plugin("imagecodecs", (__name__, "decode_frame"))


def is_available(syntax: str) -> bool:
    """Whether frames of a transfer syntax are decoded here."""
    return syntax in DECODER_DEPENDENCIES


def decode_frame(source: bytes, runner: Any) -> bytearray:
    """Pixels of a frame, row by row; those of signed numbers with their sign, which JPEG does not know."""
    import imagecodecs

    decode = imagecodecs.jpegls_decode if runner.transfer_syntax in _JPEG_LS else imagecodecs.jpeg8_decode
    pixels = np.asarray(decode(source))
    bits = 8 * pixels.itemsize
    runner.set_option("bits_allocated", bits)
    if runner.pixel_representation == 1:
        unused = bits - runner.bits_stored
        pixels = (pixels << unused).view(f"i{pixels.itemsize}") >> unused
    return bytearray(pixels.tobytes())
