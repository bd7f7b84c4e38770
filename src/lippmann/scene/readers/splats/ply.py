"""Splats in PLY files: as trainers write them, and packed as SuperSplat does.

Trainers write a vertex for each splat, as the program of Kerbl et al. 2023 does: logarithms of standard deviations,
logits of opacity, quaternions that begin with w, coefficients one colour after the other. Those of 2D Gaussian
splatting (Huang et al. 2024) leave out the third standard deviation, which is 0: their splats are discs. Some programs
write sRGB colours in place of the coefficients of degree 0. The packed form holds 16 bytes a splat, in chunks of 256
with bounds of their own (PlayCanvas, "Compressed PLY format").
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.parsing.far_origin import near_origin
from lippmann.scene.parsing.ply_header import Element, Header
from lippmann.scene.parsing.vertex_colors import full_brightness
from lippmann.scene.readers.splats.activation import (
    MOST_SMALL,
    SH_0,
    activate,
    ask_memory,
    coefficients_of,
    largest_left_out,
    sigmoid,
)
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.splats import FloatArray, Splats

#: Properties of a vertex, besides a colour, that a splat has; a disc has no third standard deviation.
_TRAINED = ("x", "y", "z", "opacity", "scale_0", "scale_1", "rot_0", "rot_1", "rot_2", "rot_3")
_THIRD_SCALE = "scale_2"
_DC = ("f_dc_0", "f_dc_1", "f_dc_2")
_RGB = ("red", "green", "blue")
#: The standard deviation of the filter by which Mip-Splatting (Yu et al. 2024) widens each splat.
_FILTER = "filter_3D"
#: Properties that change no picture: normals, which trainers write as 0.
_UNUSED = ("nx", "ny", "nz")
_PACKED = {"packed_position", "packed_rotation", "packed_scale", "packed_color"}

_CHUNK = 256
_CORNERS = ("min_x", "min_y", "min_z", "max_x", "max_y", "max_z")
_SCALES = ("min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z")
_COLORS = ("min_r", "min_g", "min_b", "max_r", "max_g", "max_b")

Rows = NDArray[np.void]
Words = NDArray[np.uint32]


def holds_splats(header: Header) -> bool:
    """Whether a PLY file holds splats, by the names of its vertices' properties."""
    return any(
        element.name == "vertex" and (_is_trained(element) or _is_packed(element)) for element in header.elements
    )


def read_splat_ply(data: bytes, header: Header, name: str, where: str) -> SceneDescription:
    """The splats of a PLY file for which :func:`holds_splats` is true.

    Raises
    ------
    SceneError, MemoryLimitError
        The file is cut short, has lists, a wrong number of coefficients, or no splat that is whole; it takes more
        memory than is left.
    """
    element = next(each for each in header.elements if each.name == "vertex")
    if _is_trained(element):
        _check_whole(element, where)
    rows = _rows_of(data, header, where)
    splats, notes = _read_trained(rows["vertex"], element, where) if _is_trained(element) else _read_packed(rows, where)
    return SceneDescription(name, splats=splats, notes=(*header.notes, *notes), up=header.up)


def _names(element: Element) -> set[str]:
    return {each.name for each in element.properties}


def _is_trained(element: Element) -> bool:
    """Whether vertices have what nothing but a splat has."""
    names = _names(element)
    return not names.isdisjoint(_DC) or names >= {"scale_0", "rot_0"}


def _check_whole(element: Element, where: str) -> None:
    names = _names(element)
    missing = [name for name in _TRAINED if name not in names]
    if not names.issuperset(_RGB):
        missing += [name for name in _DC if name not in names]
    if missing:
        raise SceneError(
            f"holds Gaussian splats without {', '.join(missing)}",
            where=where,
            rule=f"each has {', '.join(_TRAINED)}, and f_dc_0, f_dc_1, f_dc_2 or red, green, blue",
        )


def _is_packed(element: Element) -> bool:
    return _names(element) >= _PACKED


def _rows_of(data: bytes, header: Header, where: str) -> Mapping[str, Rows]:
    """The entries of all elements, which have no lists."""
    rows: dict[str, Rows] = {}
    words = data[header.end :].split() if header.order is None else []
    position, length = (0, len(words)) if header.order is None else (header.end, len(data))
    for element in header.elements:
        names = [each.name for each in element.properties]
        has_lists = any(each.count_type is not None for each in element.properties)
        if has_lists and not element.count:  # faces, which mesh libraries declare wherever there are vertices
            continue
        if has_lists or len(set(names)) < len(names):
            raise SceneError(
                f"'{element.name[:40]}' has a list, or a property twice", where=where, rule="splats do not"
            )
        if not names:
            continue
        kind = np.dtype([(each.name, (header.order or "<") + each.type) for each in element.properties])
        size = len(names) if header.order is None else kind.itemsize
        end = position + element.count * size
        if end > length:
            raise SceneError(
                f"ends after {(length - position) // size} of {element.count} entries of '{element.name[:40]}'",
                where=where,
                fix="is it cut short?",
            )
        if header.order is None:
            rows[element.name] = _text_rows(words[position:end], element.count, kind, where)
        else:
            rows[element.name] = np.frombuffer(data, kind, element.count, position)
        position = end
    return rows


@np.errstate(over="ignore", invalid="ignore")
def _text_rows(words: list[bytes], count: int, kind: np.dtype[np.void], where: str) -> Rows:
    try:
        values = np.array(words, dtype=np.float64).reshape(count, -1)
    except ValueError as error:
        raise SceneError(f"entries of splats: {error}", where=where, rule="numbers only") from None
    rows = np.empty(count, kind)
    for number, name in enumerate(kind.names or ()):
        whole = kind[name].kind in "iu"
        rows[name] = np.nan_to_num(np.clip(values[:, number], -(2.0**31), 2.0**32 - 1)) if whole else values[:, number]
    return rows


@np.errstate(over="ignore", invalid="ignore")
def _floats(rows: Rows, names: Sequence[str]) -> FloatArray:
    """``(n, len(names))`` float32."""
    values = np.empty((len(rows), len(names)), np.float32)
    for number, name in enumerate(names):
        values[:, number] = rows[name]
    return values


@np.errstate(over="ignore")  # of damaged numbers, which are left out
def _read_trained(rows: Rows, element: Element, where: str) -> tuple[Splats, tuple[str, ...]]:
    names = _names(element)
    rest = sum(name.startswith("f_rest_") for name in names)
    count = coefficients_of(rest, "properties f_rest_...", where=where)
    ask_memory(len(rows), count, where=where)
    harmonics = np.empty((len(rows), count, 3), np.float32)
    harmonics[:, 0] = _floats(rows, list(_DC)) if names >= set(_DC) else _coefficients_of_colors(rows, element)
    try:
        for color in range(3):
            own = [f"f_rest_{color * (count - 1) + place}" for place in range(count - 1)]
            harmonics[:, 1:, color] = _floats(rows, own)
    except ValueError:
        raise SceneError("properties f_rest_... leave numbers out", where=where, rule="they count from 0") from None
    log_scales = np.full((len(rows), 3), -np.inf, np.float32)
    known = 3 if _THIRD_SCALE in names else 2
    log_scales[:, :known] = _floats(rows, [f"scale_{axis}" for axis in range(known)])
    opacities = sigmoid(_floats(rows, ["opacity"])[:, 0])
    if _FILTER in names:
        log_scales, opacities = _filter(log_scales, opacities, _floats(rows, [_FILTER]))
    moved: list[str] = []
    centers = near_origin(np.stack([rows[axis].astype(np.float64) for axis in "xyz"], axis=1), moved)
    splats, notes = activate(
        centers.astype(np.float32),
        log_scales,
        _floats(rows, ["rot_1", "rot_2", "rot_3", "rot_0"]),
        opacities,
        harmonics,
        where=where,
    )
    unread = sorted(name[:40] for name in names - {*_TRAINED, _THIRD_SCALE, *_DC, *_RGB, _FILTER, *_UNUSED})
    unread = [name for name in unread if not name.startswith("f_rest_")]
    return splats, (*moved, *notes, *([f"of splats not shown: {', '.join(unread[:20])}"] if unread else []))


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # of damaged numbers, which are left out
def _filter(log_scales: FloatArray, opacities: FloatArray, widths: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Splats convolved with a Gaussian: variances add up, and opacities fall as volumes grow (Mip-Splatting, 4.1)."""
    variances = np.exp(2.0 * log_scales.astype(np.float64))
    wide = variances + np.square(widths.astype(np.float64))
    shares = np.sqrt((variances / np.where(wide > 0.0, wide, 1.0)).prod(axis=1))
    return (0.5 * np.log(wide)).astype(np.float32), (opacities * shares).astype(np.float32)


@np.errstate(over="ignore", invalid="ignore")  # of damaged numbers, which are left out
def _coefficients_of_colors(rows: Rows, element: Element) -> FloatArray:
    """Coefficients of degree 0 of sRGB colours."""
    brightest = {each.name: each.brightest for each in element.properties}
    tops = np.array([brightest[name] for name in _RGB], np.float32)
    colors = _floats(rows, list(_RGB)) / tops
    return (colors / np.float32(full_brightness(colors)) - np.float32(0.5)) / np.float32(SH_0)


@np.errstate(over="ignore", invalid="ignore")  # of damaged bounds, whose splats are left out
def _read_packed(rows: Mapping[str, Rows], where: str) -> tuple[Splats, tuple[str, ...]]:
    vertex, chunk, sh = rows["vertex"], rows.get("chunk"), rows.get("sh")
    names = set() if chunk is None else set(chunk.dtype.names or ())
    if chunk is None or not names >= {*_CORNERS, *_SCALES} or len(chunk) * _CHUNK < len(vertex):
        raise SceneError("packed splats without their bounds", where=where, rule=f"there is a chunk for each {_CHUNK}")
    if any(vertex.dtype[name].kind not in "iu" or vertex.dtype[name].itemsize != 4 for name in _PACKED):
        raise SceneError("packed splats that are no whole numbers of 32 bits", where=where)
    rest = 0 if sh is None else len(sh.dtype.names or ())
    count = coefficients_of(rest, "properties of 'sh'", where=where)
    if sh is not None and (len(sh) < len(vertex) or any(sh.dtype[name] != np.uint8 for name in sh.dtype.names or ())):
        raise SceneError("coefficients of packed splats are missing", where=where, rule="each splat has its own bytes")
    ask_memory(len(vertex), count, where=where)
    own = np.arange(len(vertex)) // _CHUNK

    def within(names: Sequence[str], shares: FloatArray) -> FloatArray:
        """Values at ``shares`` between the bounds of each splat's chunk."""
        bounds = _floats(chunk, names)
        low, high = bounds[:, :3][own], bounds[:, 3:][own]
        return low + shares * (high - low)

    word = {name: vertex[name].astype(np.uint32) for name in _PACKED}
    color = _parts(word["packed_color"], (24, 16, 8, 0), (8, 8, 8, 8))
    rgb = within(_COLORS, color[:, :3]) if names >= set(_COLORS) else color[:, :3]
    turn = (_parts(word["packed_rotation"], (20, 10, 0), (10, 10, 10)) - np.float32(0.5)) * 2 * MOST_SMALL
    w_first = largest_left_out(turn, word["packed_rotation"] >> 30)
    harmonics = np.empty((len(vertex), count, 3), np.float32)
    harmonics[:, 0] = (rgb - np.float32(0.5)) / np.float32(SH_0)
    if sh is not None and count > 1:
        bytes_ = sh.view(np.uint8).reshape(len(sh), rest)[: len(vertex)]
        values = (bytes_.astype(np.float32) - np.float32(127.5)) / np.float32(32.0)
        harmonics[:, 1:] = values.reshape(len(vertex), 3, count - 1).transpose(0, 2, 1)
    return activate(
        within(_CORNERS, _parts(word["packed_position"], (21, 11, 0), (11, 10, 11))),
        within(_SCALES, _parts(word["packed_scale"], (21, 11, 0), (11, 10, 11))),
        np.roll(w_first, -1, axis=1),
        np.ascontiguousarray(color[:, 3]),
        harmonics,
        where=where,
    )


def _parts(words: Words, shifts: tuple[int, ...], bits: tuple[int, ...]) -> FloatArray:
    """Parts of 32-bit words as shares of their largest values, ``(n, len(shifts))``."""
    parts = [
        (words >> np.uint32(shift) & np.uint32(2**size - 1)).astype(np.float32) / np.float32(2**size - 1)
        for shift, size in zip(shifts, bits, strict=True)
    ]
    return np.stack(parts, axis=1)
