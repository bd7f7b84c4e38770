"""The headers of KTX 2.0 files (Khronos, "KTX File Format Specification", version 2.0, sections 3 and 4)."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.machine import check_input

Bytes = NDArray[np.uint8]

IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"

#: Texels that a picture may have: as many as Pillow allows.
MOST_TEXELS = 178_956_970

# Color models of data format descriptors (Khronos Data Format Specification 1.3, table 5.5).
_ETC1S, _UASTC = 163, 166
_SCHEMES = {0: "none", 1: "BasisLZ", 2: "Zstandard", 3: "ZLIB"}
# Channel of the second slice of an ETC1S picture that is green; alpha otherwise. Channels of UASTC with alpha.
_GREEN = 4
_UASTC_WITH_ALPHA = 3


class Ktx2Error(Exception):
    """A file that is damaged, or holds what glTF does not allow."""


@dataclass(frozen=True)
class _Header:
    width: int
    height: int
    images: int
    scheme: str
    model: int
    channels: tuple[int, ...]
    level: bytes
    uncompressed: int
    global_data: bytes

    @property
    def blocks(self) -> tuple[int, int]:
        """Blocks of 4x4 texels across and down."""
        return -(-self.width // 4), -(-self.height // 4)


def decode_ktx2(data: bytes) -> Bytes:
    """Texels ``(height, width, 3 or 4)`` uint8 of the largest picture of a file, the top row first.

    Raises
    ------
    Ktx2Error
        The file is damaged, too large, or holds texels of another kind than ETC1S or UASTC.
    """
    header = _read_header(data)
    across, down = header.blocks
    check_input(8 * header.width * header.height, f"a picture of {header.width} x {header.height} pixels", where="")
    if header.model == _ETC1S:
        if header.scheme != "BasisLZ":
            raise Ktx2Error("its ETC1S texels are not compressed by BasisLZ")
        texels = _decode_etc1s(header)
    elif header.model == _UASTC:
        from lippmann.codecs.ktx2.uastc import decode_uastc

        decoded = decode_uastc(_uncompress(header), across, down)
        if decoded is None:
            raise Ktx2Error("a block is of no known mode")
        texels = decoded
        if header.channels[:1] != (_UASTC_WITH_ALPHA,):
            texels = texels[..., :3]
    else:
        raise Ktx2Error(f"its texels are of color model {header.model}; ETC1S and UASTC are understood")
    return np.ascontiguousarray(texels[: header.height, : header.width])


def _read_header(data: bytes) -> _Header:
    if not data.startswith(IDENTIFIER):
        raise Ktx2Error("it does not begin as a KTX 2.0 file")
    if len(data) < 104:
        raise Ktx2Error("it is cut short")
    _, _, width, height, depth, layers, faces, levels, scheme = struct.unpack_from("<9I", data, 12)
    descriptor_at, descriptor_size, _, _, global_at, global_size = struct.unpack_from("<4I2Q", data, 48)
    level_at, level_size, uncompressed = struct.unpack_from("<3Q", data, 80)
    if not width or not height or depth or layers > 1 or faces != 1:
        raise Ktx2Error("it is not one picture of two dimensions")
    if width * height > MOST_TEXELS:
        raise Ktx2Error(f"{width}x{height} texels are more than {MOST_TEXELS}")
    if levels > 32 or scheme not in _SCHEMES:
        raise Ktx2Error(f"{levels} levels in compression {scheme} are none")
    model, channels = _read_descriptor(_part(data, descriptor_at, descriptor_size))
    return _Header(
        width,
        height,
        max(1, levels),
        _SCHEMES[scheme],
        model,
        channels,
        _part(data, level_at, level_size),
        uncompressed,
        _part(data, global_at, global_size),
    )


def _part(data: bytes, offset: int, size: int) -> bytes:
    if offset + size > len(data):
        raise Ktx2Error("it is cut short")
    return data[offset : offset + size]


def _read_descriptor(descriptor: bytes) -> tuple[int, tuple[int, ...]]:
    """Color model, and the channel of each sample, of a data format descriptor."""
    if len(descriptor) < 44:
        raise Ktx2Error("it does not describe its texels")
    samples = (struct.unpack_from("<H", descriptor, 10)[0] - 24) // 16
    known = descriptor[28 : 28 + 16 * max(0, min(samples, 4))]
    return descriptor[12], tuple(byte & 15 for byte in known[3::16])


def _uncompress(header: _Header) -> bytes:
    """The blocks of the largest picture, of 16 bytes each."""
    across, down = header.blocks
    size = 16 * across * down
    if header.scheme == "none":
        blocks = header.level
    elif header.uncompressed != size:
        raise Ktx2Error("its blocks are not as many as its size has")
    elif header.scheme == "Zstandard":
        from imagecodecs import ZstdError, zstd_decode

        try:
            blocks = bytes(zstd_decode(header.level, out=size))
        except (ZstdError, ValueError) as error:
            raise Ktx2Error("its blocks cannot be decompressed") from error
    elif header.scheme == "ZLIB":
        try:
            blocks = zlib.decompressobj().decompress(header.level, size)
        except zlib.error as error:
            raise Ktx2Error("its blocks cannot be decompressed") from error
    else:
        raise Ktx2Error(f"UASTC texels in {header.scheme} are none")
    if len(blocks) != size:
        raise Ktx2Error("its blocks are not as many as its size has")
    return blocks


def _decode_etc1s(header: _Header) -> Bytes:
    """RGB or RGBA of all blocks: colours from the first slice, alpha or green from the second."""
    from lippmann.codecs.ktx2.etc1s import Codebooks, DamagedError, decode_slice

    data = header.global_data
    if len(data) < 20 + 20 * header.images:
        raise Ktx2Error("it is cut short")
    endpoints, selectors, *sizes, extended = struct.unpack_from("<2H4I", data)
    flags, color_at, color_size, second_at, second_size = struct.unpack_from("<5I", data, 20)
    if flags & 2:
        raise Ktx2Error("it is a frame of a video")
    parts = []
    position = 20 + 20 * header.images
    for size in sizes:
        parts.append(_part(data, position, size))
        position += size
    del extended
    across, down = header.blocks
    try:
        codebooks = Codebooks.read(endpoints, selectors, *parts)
        texels = decode_slice(codebooks, _part(header.level, color_at, color_size), across, down)
        if not second_size:
            return texels
        second = decode_slice(codebooks, _part(header.level, second_at, second_size), across, down)[..., :1]
    except DamagedError as error:
        raise Ktx2Error(str(error)) from None
    if header.channels[1:2] == (_GREEN,):
        return np.concatenate([texels[..., :1], second, np.zeros_like(second)], axis=-1)
    return np.concatenate([texels, second], axis=-1)
