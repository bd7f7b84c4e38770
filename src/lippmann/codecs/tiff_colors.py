"""Values of a TIFF page as grey or RGB, after its PhotometricInterpretation (TIFF 6.0; Adobe Photoshop TIFF technical
notes, 2002)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.icc import convert_cmyk
from lippmann.codecs.types import Pixels
from lippmann.color.primaries import rec709_from_xyz
from lippmann.color.transfer import encode_srgb

#: Values of PhotometricInterpretation.
_WHITE_IS_ZERO, _BLACK_IS_ZERO, _RGB, _PALETTE, _CMYK, _YCBCR, _CIELAB, _ICCLAB = 0, 1, 2, 3, 5, 6, 8, 9
#: The value of ExtraSamples for alpha that colours were multiplied by.
_ASSOCIATED = 1
#: JPEG and old JPEG, whose decoders give RGB for YCbCr.
_JPEG = (6, 7, 34892, 33007)
_PLAIN_JPEG = 7
#: XYZ of the white of L*a*b*, D50, and where its curve is a line.
_D50, _LINE = np.array([0.9642, 1.0, 0.8249]), 6.0 / 29.0


class UnreadColorsError(ValueError):
    """Colours of a kind that is not read; the text names it."""


def check_colors(page: Any) -> None:
    """Raise :class:`UnreadColorsError` if the page's colours are of a kind that is not read."""
    kind, bits = int(page.photometric), page.bitspersample
    read = kind in (_WHITE_IS_ZERO, _BLACK_IS_ZERO, _RGB, _PALETTE)
    read |= kind == _YCBCR and (int(page.compression) in _JPEG or _is_plain_ycbcr(page))
    read |= kind in (_CIELAB, _ICCLAB) and bits in (8, 16) and page.samplesperpixel >= 3
    read |= is_cmyk(page) and bits in (8, 16)
    read &= kind not in (_WHITE_IS_ZERO, _PALETTE) or page.dtype is None or np.dtype(page.dtype).kind != "f"
    if not read:
        name = getattr(page.photometric, "name", str(kind))
        names = {"SEPARATED": "CMYK", "MINISWHITE": "white-is-zero floats", "YCBCR": "subsampled YCbCr without JPEG"}
        name = names.get(name, name)
        raise UnreadColorsError(f"its colours are {name} of {bits} bits")


def is_cmyk(page: Any) -> bool:
    """Whether the page's colours are of four inks, which :func:`gray_or_rgb` makes sRGB."""
    keeps_inks = int(page.compression) not in _JPEG or int(page.compression) == _PLAIN_JPEG
    return int(page.photometric) == _CMYK and page.samplesperpixel >= 4 and keeps_inks


def stored_type(page: Any) -> str:
    """NumPy type name of what :func:`gray_or_rgb` gives."""
    dtype = np.dtype(page.dtype)
    if dtype.kind == "f":
        return "float32"
    if int(page.photometric) == _PALETTE or dtype.kind == "b" or is_cmyk(page):
        return "uint8"
    return str(dtype.name)


def is_stored_so(page: Any) -> bool:
    """Whether :func:`gray_or_rgb` gives the values as they are stored."""
    dtype = np.dtype(page.dtype)
    plain = int(page.photometric) in (_BLACK_IS_ZERO, _RGB) and page.bitspersample == dtype.itemsize * 8
    plain &= int(page.compression) not in _JPEG
    plain &= dtype.kind != "f" or dtype == np.float32
    together = page.planarconfig == 1 or page.samplesperpixel == 1
    return plain and together and not _unspecified(page) and not _is_associated(page)


def gray_or_rgb(page: Any, values: Pixels) -> Pixels:
    """``(H, W, 1 to 4)`` grey or RGB, with or without alpha: codes of 8 or 16 bits over their whole range, or floats.

    Parameters
    ----------
    page:
        The page, of tifffile.
    values:
        What it holds, ``(H, W)``, ``(H, W, samples)``, or ``(samples, H, W)`` of separate planes.
    """
    if values.ndim == 2:
        values = values[..., None]
    elif page.planarconfig == 2:
        values = np.moveaxis(values, 0, -1)
    kind = int(page.photometric)
    if unspecified := _unspecified(page):
        values = values[..., : values.shape[-1] - unspecified]
    if kind == _PALETTE:
        return _looked_up(values[..., 0], np.asarray(page.colormap))
    if kind == _YCBCR and int(page.compression) not in _JPEG:
        return np.concatenate([_rgb_of_ycbcr(page, values[..., :3]), values[..., 3:]], axis=-1)
    if is_cmyk(page):
        from PIL import Image

        codes = (values[..., :4] >> (page.bitspersample - 8)).astype(np.uint8)
        return convert_cmyk(Image.fromarray(codes, "CMYK"), page.iccprofile or b"")
    if kind in (_CIELAB, _ICCLAB):
        return _srgb_of_lab(values[..., :3], biased=kind == _ICCLAB)
    if values.dtype.kind == "f":
        return values.astype(np.float32, copy=False)
    if values.dtype.kind == "b":
        values = values.astype(np.uint8)
    bits, wide = page.bitspersample, values.dtype.itemsize * 8
    if bits < wide <= 16:
        top, most = 2**wide - 1, 2**bits - 1
        values = ((values.astype(np.uint32) * top + most // 2) // most).astype(values.dtype)
    if kind == _WHITE_IS_ZERO:
        values = np.concatenate([~values[..., :1], values[..., 1:]], axis=-1)
    return _unassociate(values) if _is_associated(page) else values


def _is_plain_ycbcr(page: Any) -> bool:
    """Whether every pixel has a brightness and two differences of 8 bits; by default four pixels share the latter."""
    return page.bitspersample == 8 and tuple(page.tags.valueof("YCbCrSubSampling", default=(2, 2))) == (1, 1)


def _rgb_of_ycbcr(page: Any, codes: Pixels) -> NDArray[np.uint8]:
    """RGB codes of Y, Cb and Cr (TIFF 6.0, section 21)."""
    red, green, blue = _fractions(page, "YCbCrCoefficients", (299, 1000, 587, 1000, 114, 1000))
    bounds = _fractions(page, "ReferenceBlackWhite", (0, 1, 255, 1, 128, 1, 255, 1, 128, 1, 255, 1))
    (y0, y1), (b0, b1), (r0, r1) = bounds[:2], bounds[2:4], bounds[4:6]
    y, cb, cr = (codes[..., channel].astype(np.float64) for channel in range(3))
    y = (y - y0) * (255.0 / (y1 - y0))
    r = y + (cr - r0) * (127.0 / (r1 - r0)) * (2.0 - 2.0 * red)
    b = y + (cb - b0) * (127.0 / (b1 - b0)) * (2.0 - 2.0 * blue)
    g = (y - red * r - blue * b) / green
    return np.rint(np.clip(np.nan_to_num(np.stack([r, g, b], axis=-1)), 0.0, 255.0)).astype(np.uint8)


def _fractions(page: Any, name: str, default: tuple[int, ...]) -> list[float]:
    """Numbers of a tag of fractions."""
    parts = page.tags.valueof(name, default=default)
    if len(parts) != len(default):
        raise ValueError(f"its {name} are {len(parts) // 2} numbers")
    return [top / bottom for top, bottom in zip(parts[::2], parts[1::2], strict=True)]


def _is_associated(page: Any) -> bool:
    return _ASSOCIATED in (page.extrasamples or ())[:1]


def _unassociate(values: Pixels) -> Pixels:
    """Codes whose colours were multiplied by alpha, without that."""
    top, alpha = np.iinfo(values.dtype).max, values[..., -1:].astype(np.float64)
    colors = np.minimum(values[..., :-1] * (top / np.maximum(alpha, 1.0)), top)
    return np.concatenate([np.rint(colors).astype(values.dtype), values[..., -1:]], axis=-1)


def _unspecified(page: Any) -> int:
    """Number of samples beyond the colours that say of themselves that they are no alpha."""
    kinds = [int(kind) for kind in page.extrasamples or ()]
    return len(kinds) if kinds and kinds[0] == 0 else max(0, len(kinds) - 1)


def _looked_up(indices: NDArray[np.integer[Any]], table: NDArray[np.integer[Any]]) -> NDArray[np.uint8]:
    """Colours of a palette ``(3, 2^bits)`` of 16 bits; some programs fill 8 of these."""
    colors = table if table.max() < 256 else table // 256
    return np.moveaxis(colors.astype(np.uint8)[:, indices.astype(np.intp)], 0, -1)


def _srgb_of_lab(lab: Pixels, *, biased: bool) -> Pixels:
    """sRGB codes of CIE L*a*b* codes, in the same number of bits.

    a* and b* are signed, or lie 128 higher (``biased``, ICC L*a*b*, whose L* of 16 bits ends at 0xff00).
    """
    wide = lab.dtype.itemsize == 2
    unit = 256.0 if wide else 1.0
    white = (0xFF00 if biased else 0xFFFF) if wide else 255
    lightness = lab[..., 0] * (100.0 / white)
    if biased:
        a, b = (lab[..., channel] / unit - 128.0 for channel in (1, 2))
    else:
        a, b = (lab[..., channel].astype(f"i{lab.dtype.itemsize}") / unit for channel in (1, 2))
    y = (lightness + 16.0) / 116.0
    f = np.stack([y + a / 500.0, y, y - b / 200.0], axis=-1)
    xyz = _D50 * np.where(f > _LINE, f**3, 3.0 * _LINE**2 * (f - 4.0 / 29.0))
    coded = encode_srgb(xyz @ rec709_from_xyz(_D50).T)
    return np.asarray(np.rint(coded * (65535 if wide else 255)), lab.dtype)
