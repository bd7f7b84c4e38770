"""Depth maps: files of distances, pictures of nearness, and those within JPEG files."""

from __future__ import annotations

import base64
import binascii
import io
import re
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import UnidentifiedImageError
from scipy import ndimage

from lippmann.codecs import png, tiff
from lippmann.codecs.exr import read_exr, read_exr_header
from lippmann.codecs.orientation import of_picture, upright
from lippmann.codecs.pfm import read_pfm
from lippmann.codecs.photograph import open_photograph
from lippmann.codecs.pillow_formats import RULE, open_picture
from lippmann.codecs.rgbd_names import White
from lippmann.errors import LippmannError, MemoryLimitError, PictureError, SceneError
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.parsing.numpy_array import read_numpy_array

#: Names of channels of OpenEXR that hold depth, by their own name or that of their layer, before those of any value.
_CHANNELS = (r"Z", r".*depth(\.[ZVYRX])?", r".*\.Z", r"[VYR]")
#: Names that say that larger values are nearer: ``disp0GT.pfm``, ``gt_disp_lowres.pfm``, ``photo_disparity.png``, and
#: ``photo-dpt_large_384.pfm``, ``photo-midas_v21_384.pfm`` as MiDaS writes inverse depth.
_DISPARITY = re.compile(r"disparity|(?<![a-z])(disp\d*(gt)?|dpt|midas)(?![a-z])", re.IGNORECASE)
#: Names that say that dark is near: as of colour beside depth, and as Marigold's programs write depth.
_DARK_NEAR = re.compile(r"-far$|marigold|depth_16bit", re.IGNORECASE)
#: Mean difference of the channels of a grey picture, in codes of 8 bits, which JPEG's greys stay below.
_MOST_TINT = 8.0

#: Depth and type of RGB and RGBA of 16 bits in the header of a PNG, of which Pillow reads the upper 8.
_WIDE_COLORS = (b"\x10\x02", b"\x10\x06")

_XMP = b"http://ns.adobe.com/xap/1.0/\0"
_XMP_EXTENSION = b"http://ns.adobe.com/xmp/extension/\0"
#: Of an extension: its name, its whole length, and where this part of it belongs.
_EXTENSION_HEAD = 40
#: Widths in pixels of the means that take the stairs out of whole numbers: plateaus of up to about the first are slopes
#: after that, the others make what is narrower even.
_SMOOTHING = (65, 33, 17, 9, 5, 3)
#: Side in pixels of the median that takes JPEG's ringing beside edges out of depth: 3 leaves it at quality 75.
_RINGING = 5
#: The prefix that XMP has for the namespace of GDepth, or of Dynamic Depth, which took its place; and a property with
#: such a prefix: an attribute, or an element.
_GDEPTH = re.compile(rb"""xmlns:([\w.-]+)\s*=\s*["']http://ns\.google\.com/photos/(?:dd/)?1\.0/depthmap/["']""")
_PROPERTY = rb"""\b%s:(%s)(?:\s*=\s*(["'])(.*?)\2|\s*>([^<]*)<)"""
#: An item of the directory that says what follows the picture in its file, and its properties.
_ITEM = re.compile(rb"<([\w.-]+:Item)\b(.{0,2000}?)(?:/>|</\1>)", re.DOTALL)
#: What the XMP of a picture behind a JPEG file's own says of it, as Apple's telephones write portraits.
_APPLE_DISPARITY = re.compile(rb""":AuxiliaryImageType\s*(?:>|=\s*["'])\s*disparity\b""")
_START_OF_IMAGE = b"\xff\xd8\xff"
_PRIMARY = (b"Primary", b"primary_image")
#: Digits of a length and a padding together; no file is so long.
_LONGEST_NUMBER = 30


@dataclass(frozen=True, eq=False)
class DepthMap:
    """Inverse depth along the camera's axis ``(h, w)`` float32, up to scale and shift; NaN where it is unknown.

    ``note`` says what was taken for granted.
    """

    inverse: NDArray[np.float32]
    note: str = ""


def of_depth(depth: NDArray[np.float32]) -> DepthMap:
    """Depth map of distances: infinity is the sky; 0, negative numbers and NaN are unknown."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse = np.where(depth > 0.0, 1.0 / depth, np.nan)
    return DepthMap(np.where(np.isfinite(inverse), inverse, np.nan).astype(np.float32))


def of_disparity(disparity: NDArray[np.float32]) -> DepthMap:
    """Depth map of disparities, of which larger ones are nearer; those that are not finite are unknown."""
    return DepthMap(np.where(np.isfinite(disparity), disparity, np.nan).astype(np.float32))


def without_stairs(levels: NDArray[Any]) -> NDArray[np.float32]:
    """Whole numbers ``(h, w)`` as the smooth surface that they may have been rounded from.

    No value moves by more than the half that rounding took, so that edges and details stay; the 256 levels of a picture
    become as many depths as a slope has pixels.
    """
    whole = levels.astype(np.float32)
    smooth = whole
    for width in _SMOOTHING:
        mean = ndimage.uniform_filter(smooth, width, mode="nearest")
        smooth = np.clip(mean, whole - np.float32(0.5), whole + np.float32(0.5))
    return smooth


def without_ringing(levels: NDArray[Any], data: bytes) -> NDArray[Any]:
    """Levels ``(h, w, ...)`` of the picture file ``data``, without JPEG's ripples, which would be edges."""
    if not data.startswith(_START_OF_IMAGE):
        return levels
    return np.asarray(ndimage.median_filter(levels, (_RINGING, _RINGING, 1)[: levels.ndim]))


def read_depth_map(path: Path) -> DepthMap:
    """Read a depth map.

    Floats (``.pfm``, ``.npy``, OpenEXR, TIFF) are metres, pictures of 16 bits millimetres, but disparities where the
    name says so. Floats that reach from 0 to 1 are depth without a unit. A picture of 8 bits, or one whose 16 bits are
    stretched to their whole range, is brighter where something is nearer, as programs that estimate depth write it,
    unless the name says that dark is near.

    Raises
    ------
    SceneError
        The file is missing, damaged, or of another kind.
    MemoryLimitError
        It takes more memory than is left.
    """
    data = read_bytes(path)
    check_input(2 * len(data), "the depth map", where=path.name)
    try:
        values = _values(path, data)
    except PictureError as error:
        raise SceneError(error.what, where=path.name, rule=error.rule, fix=error.fix) from None
    except (ValueError, EOFError, OSError) as error:
        raise SceneError(f"is no depth map ({error})", where=path.name) from None
    is_float, is_wide = values.dtype.kind == "f", values.dtype.itemsize > 1
    with np.errstate(over="ignore"):
        levels = values.astype(np.float32) if is_wide else without_stairs(values)
    if _DISPARITY.search(path.stem):
        if not is_float and values.max() < (65535 if is_wide else 255):  # one that is not stretched has no 0
            levels = np.where(values > 0, levels, np.float32(np.nan))
        note = f"{path.name} is taken for disparity, as its name says: larger values are nearer"
        return replace(of_disparity(levels), note=note)
    is_stretched = is_wide and _is_stretched(values, 1.0 if is_float else 65535.0)
    farther = "larger values are farther; say disparity in its name if they are nearer"
    if is_wide and not is_stretched:
        return replace(of_depth(levels), note=f"{path.name} is taken for distances: {farther}")
    if is_float or _DARK_NEAR.search(path.stem):
        return DepthMap(-levels, f"{path.name} is taken for depth without a unit: {farther}")
    span = " spans all of its 16 bits, as maps without a unit do" if is_wide else ""
    note = f"{path.name}{span}: brighter is taken as nearer; if dark is near, end its name with -far"
    return DepthMap(levels, note)


def _values(path: Path, data: bytes) -> NDArray[Any]:
    """Values ``(h, w)`` of a file, upright: floats, or whole numbers, one byte each if it holds grey levels."""
    suffix = path.suffix.lower()
    if suffix in (".npy", ".npz"):
        return _numpy_array(data, path.name)
    if suffix == ".pfm":
        return read_pfm(path)
    return _exr(path) if suffix == ".exr" else _gray(data, path.name)


def _is_stretched(values: NDArray[Any], top: float) -> bool:
    """Whether values reach from 0 to ``top`` without a gap of a 256th at either end.

    Programs that estimate depth stretch it so; in distances 0 and 65535 stand for what is unknown, far from all others.
    """
    within = values[(values > 0) & (values < top)]
    is_whole = (values.min(), values.max()) == (0, top) and within.size > 0
    return bool(is_whole and within.min() < top / 256.0 and within.max() > top - top / 256.0)


def _numpy_array(data: bytes, where: str) -> NDArray[Any]:
    try:
        if data.startswith(b"PK"):
            with zipfile.ZipFile(io.BytesIO(data)) as archive, archive.open("depth.npy") as file:
                values = read_numpy_array(file, "depth", where)
        else:
            values = read_numpy_array(io.BytesIO(data), "depth", where)
        values = np.squeeze(values) if values.ndim > 2 else values
    except LippmannError:
        raise
    except Exception as error:  # a header is read as Python, whose own errors come through
        rule = "an array of numbers, of .npz files the one called depth"
        raise SceneError(f"is no depth map ({error})", where=where, rule=rule) from error
    if values.ndim != 2 or not values.size:
        raise SceneError(f"is an array {values.shape} of {values.dtype}", where=where, rule="depth is (h, w) numbers")
    check_input(4 * values.size, "the depth map", where=where)
    return values


def _exr(path: Path) -> NDArray[np.float32]:
    header = read_exr_header(path, lambda names: any(_matches(form, name) for form in _CHANNELS[:-1] for name in names))
    check_input(4 * header.height * header.width * len(header.channels), "the depth map", where=path.name)
    channels = read_exr(path, header)
    scalars = [name for name in sorted(channels) if not (name.endswith(".Z") and f"{name[:-1]}X" in channels)]
    name = next((name for form in _CHANNELS for name in scalars if _matches(form, name)), None)
    if name is None:
        held, rule = ", ".join(sorted(channels)), "depth is Z, V, Y, R or that of a layer, such as depth.Z"
        raise SceneError(f"has the channels {held}", where=path.name, rule=rule)
    depth = np.asarray(channels[name], np.float32)
    others = [f"{name[:-1]}{letter}" for letter in "GB"] if name[-1] == "R" else []
    if any(other in channels and not np.array_equal(channels[other], depth, equal_nan=True) for other in others):
        raise _color_error(path.name)
    return depth


def _matches(form: str, name: str) -> bool:
    return re.fullmatch(form, name, re.IGNORECASE) is not None


def _color_error(where: str) -> SceneError:
    return SceneError("is a picture in colours", where=where, rule="depth is grey", fix="save it without a colour map")


def _gray(data: bytes, where: str, turn: int | None = None) -> NDArray[Any]:
    """Values ``(h, w)`` of a grey picture, upright: levels of one byte, longer whole numbers, or floats.

    ``turn`` is its EXIF orientation; None for that in the file.
    """
    try:
        # Pillow does not read floats of 16 bits in a TIFF, nor greys whose 0 is white.
        if data.startswith(tiff.SIGNATURES):
            return _luminance(tiff.TiffPicture(io.BytesIO(data), Path(where)).read(), where)
        if data.startswith(png.SIGNATURE) and data[24:26] in _WIDE_COLORS:
            with open_photograph(io.BytesIO(data), Path(where), ("PNG",)) as photograph:
                return _luminance(photograph.codes(), where)
        with open_picture(io.BytesIO(data)) as picture:
            turn = of_picture(picture) if turn is None else turn
            if picture.mode == "F":
                return upright(np.asarray(picture, np.float32), turn)
            if picture.mode.startswith("I"):
                return upright(np.asarray(picture).astype(np.int64), turn)
            if len(picture.getbands()) > 2 or picture.mode == "P":
                _check_grey(np.asarray(picture.convert("RGB")), where)
            return upright(without_ringing(np.asarray(picture.convert("L")), data), turn)
    except SceneError:
        raise
    except MemoryLimitError as error:
        raise MemoryLimitError(error.what, where=where, rule=error.rule, fix=error.fix) from None
    except UnidentifiedImageError:
        raise SceneError("is no depth map", where=where, rule=f".pfm, .npy, .npz, .exr, {RULE}") from None
    except Exception as error:  # Pillow's decoders pass on whatever their libraries throw at damaged data
        raise SceneError(f"cannot be decoded ({error})", where=where) from error


def _check_grey(codes: NDArray[np.uint8], where: str) -> None:
    if np.ptp(codes, axis=2).mean() > _MOST_TINT:
        raise _color_error(where)


def _luminance(values: NDArray[Any], where: str) -> NDArray[Any]:
    """Grey of ``(h, w, 1 to 4)`` values, of colours of 8 bits by the weights of Rec. 601."""
    if values.shape[2] >= 3 and values.dtype.kind == "u":
        _check_grey(np.asarray(values[..., :3] >> (8 * values.itemsize - 8), np.uint8), where)
    if values.shape[2] >= 3 and values.dtype == np.uint8:
        return np.asarray(np.rint(values[..., :3] @ np.array([0.299, 0.587, 0.114])), np.uint8)
    return values[..., 0]


def of_nearness(codes: NDArray[Any], white: White, where: str) -> DepthMap:
    """Depth map of a grey picture ``(h, w, 3)`` that is linear in inverse depth, of 8 bits or floats.

    Raises
    ------
    SceneError
        It is in colours.
    """
    if codes.dtype == np.uint8:
        _check_grey(np.asarray(codes, np.uint8), where)
        levels = without_stairs(codes[..., 1])
    else:
        levels = codes[..., 1].astype(np.float32)
    return DepthMap(levels if white == "near" else -levels)


def embedded_depth(data: bytes, where: str, turn: int = 1) -> DepthMap | None:
    """The depth that a JPEG file carries, as Android's portraits have it: in its XMP (GDepth), or behind its picture
    (Dynamic Depth 1.0), or as Apple's: a picture of disparity behind it (multi-picture format); None without it.

    Its pixels lie as those of the picture are stored, whose EXIF orientation is ``turn``.

    Depth is near + d (far - near) for ``RangeLinear``, and its inverse is linear in d for ``RangeInverse``
    (Depthmap Metadata, developers.google.com/depthmap-metadata).

    Raises
    ------
    SceneError
        Its values mean nothing, or its picture is damaged.
    """
    apple = _APPLE_DISPARITY.search(data) if data.startswith(_START_OF_IMAGE) else None
    if apple is not None and (start := data.rfind(_START_OF_IMAGE, 1, apple.start())) > 0:
        return DepthMap(without_stairs(_gray(data[start:], where, turn)))
    entries: dict[bytes, bytes] = {}
    xmp = _xmp(data)
    for prefix in dict.fromkeys((b"GDepth", *_GDEPTH.findall(xmp))):
        entries = _properties(xmp, re.escape(prefix), b"Format|Near|Far|Data|DepthURI") | entries
    behind = None if b"Data" in entries else _item_of_depth(data, xmp, entries.get(b"DepthURI"))
    if b"Data" not in entries and behind is None:
        return None
    try:
        near, far = float(entries.get(b"Near", b"nan")), float(entries.get(b"Far", b"nan"))
        encoded = base64.b64decode(entries[b"Data"]) if behind is None else behind
    except (ValueError, binascii.Error) as error:
        raise SceneError(f"has depth that is not readable ({error})", where=where, rule="GDepth in XMP") from None
    if not 0.0 < near < far < np.inf:
        raise SceneError(f"has depth from {near:g} to {far:g}", where=where, rule="near is above 0, far beyond it")
    values = _gray(encoded, where, turn)
    is_wide = values.dtype.itemsize > 1
    share = values.astype(np.float32) / np.float32(65535.0) if is_wide else without_stairs(values) / np.float32(255.0)
    if entries.get(b"Format") == b"RangeLinear":
        return of_depth((near + share * (far - near)).astype(np.float32))
    return DepthMap((1.0 / near + share * (1.0 / far - 1.0 / near)).astype(np.float32))


def _properties(xmp: bytes, prefix: bytes, names: bytes) -> dict[bytes, bytes]:
    """Values of the properties of these names, of each the first."""
    entries: dict[bytes, bytes] = {}
    for name, _, attribute, element in re.findall(_PROPERTY % (prefix, names), xmp, re.DOTALL):
        entries.setdefault(name, attribute or element.strip())
    return entries


def _item_of_depth(data: bytes, xmp: bytes, uri: bytes | None) -> bytes | None:
    """The depth picture behind a JPEG file's own, by the directory of Dynamic Depth; None where that lists none.

    Items follow each other up to the file's end, each with its padding behind it.
    """
    items = [_properties(body, rb"[\w.-]+", b"Length|Padding|Semantic|DataURI") for _, body in _ITEM.findall(xmp)]
    primary = [number for number, item in enumerate(items) if {*item.values()} & {*_PRIMARY}]
    end = len(data)
    for item in reversed(items[primary[-1] + 1 if primary else 0 :]):
        length, padding = (item.get(name, b"0") for name in (b"Length", b"Padding"))
        if not (length.isdigit() and padding.isdigit() and len(length + padding) < _LONGEST_NUMBER):
            return None
        end -= int(padding)
        start = end - int(length)
        if start < 0:
            return None
        if item.get(b"Semantic") == b"Depth" or (uri is not None and item.get(b"DataURI") == uri):
            return data[start:end]
        end = start
    return None


def _xmp(data: bytes) -> bytes:
    """The XMP of a JPEG file, the parts of its extension in their order; empty without any."""
    if not data.startswith(b"\xff\xd8"):
        return b""
    plain, parts, place = [], [], 2
    while place + 4 <= len(data) and data[place] == 0xFF and data[place + 1] not in (0xDA, 0xD9):
        length = int.from_bytes(data[place + 2 : place + 4], "big")
        segment = data[place + 4 : place + 2 + length]
        if data[place + 1] == 0xE1 and segment.startswith(_XMP):
            plain.append(segment[len(_XMP) :])
        elif data[place + 1] == 0xE1 and segment.startswith(_XMP_EXTENSION):
            body = segment[len(_XMP_EXTENSION) :]
            parts.append((int.from_bytes(body[36:_EXTENSION_HEAD], "big"), body[_EXTENSION_HEAD:]))
        place += 2 + max(length, 2)
    return b"".join([*plain, *(part for _, part in sorted(parts, key=lambda each: each[0]))])
