"""Photographs with depth: a picture and its depth map become a height field whose hidden parts are filled."""

from __future__ import annotations

import io
import math
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from lippmann.codecs.orientation import lies
from lippmann.codecs.photograph import open_photograph
from lippmann.codecs.rgbd_names import RgbdForm, rgbd_of_name
from lippmann.codecs.stereo_pairs import HEIF
from lippmann.errors import SceneError
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import decoding, read_bytes, texels_of_codes
from lippmann.scene.readers.depth_layers import Layers, split_layers
from lippmann.scene.readers.depth_map import (
    DepthMap,
    embedded_depth,
    of_nearness,
    read_depth_map,
    without_ringing,
)
from lippmann.scene.values.description import Image, Instance, Material, Mesh, SceneDescription, Texture

#: How the name of a depth map goes on after that of its photograph, and how it ends.
_DEPTH = re.compile(
    r"[-_. ]?(depth|depthmap|depth[-_ ]map|disparity)(-far)?(\.(png|jpe?g|webp|tiff?|exr|pfm|npy|npz))", re.IGNORECASE
)
#: The end of a photograph's name that says that it is the one of both with the colours.
_COLOR = re.compile(r"(?:^|[-_. ])(?:image|img|rgb|colou?r)$", re.IGNORECASE)
#: Endings of files that may hold the slices of a volume.
_TIFF = (".tif", ".tiff")
#: The last bytes of a JPEG file behind whose picture Samsung's telephones lay more.
_SAMSUNG = b"SEFT"
#: How deep the height field is, over the shorter side of the picture; displays scale it to what they resolve.
DEPTH = 0.5
#: Points of the height field; of larger depth maps one pixel in so many is taken.
_MOST_POINTS = 1 << 20
#: Bytes of intermediate values for a point.
_BYTES_PER_POINT = 400
#: How much the sides of picture and depth map may differ in proportion.
_ASPECT = 0.02


def read_depth_photo(path: Path, *, depth_map: Path | None = None) -> SceneDescription:
    """Read a photograph with its depth, both as their EXIF orientation turns them.

    The picture shows its own colours, unlit, and is 1 high or wide, whichever is less. What the camera saw as a pyramid
    becomes a block: seen along its axis it is the photograph, and parallax is proportional to inverse depth. Where a
    display looks past something near, the far side goes on behind it.

    Parameters
    ----------
    depth_map:
        A depth map; None for one beside the colours, where the name ends in ``_rgbd`` (:func:`rgbd_of_name`), one
        within the picture (Dynamic Depth, XMP GDepth or Apple's disparity in JPEG files, an
        auxiliary picture in HEIF files), or one beside it (:func:`depth_beside`).

    Raises
    ------
    SceneError
        A file is missing or damaged; the picture holds no depth and none is given; their sides differ in proportion.
    """
    data, turn = read_bytes(path), 1
    notes: tuple[str, ...] = ()
    if path.suffix.lower() in HEIF:
        from lippmann.scene.readers.heif import read_heif_photo

        image, own = read_heif_photo(data, path.name)
    else:
        with decoding("the photograph", path.name), open_photograph(io.BytesIO(data), path) as photograph:
            image = Image(path.name, texels_of_codes(photograph.srgb_codes()))
            turn, notes = photograph.orientation, photograph.notes
        form = rgbd_of_name(path)
        if depth_map is not None:
            own = None
        elif form is None:
            own = embedded_depth(data, path.name, turn)
        else:
            image, own = _color_and_depth(image, form, data)
    if depth_map is None and own is None:
        depth_map = depth_beside(path)
        if depth_map is None:
            fix = f"add depth_map=..., or lay {path.stem[:40]}_depth.png beside it"
            if image.pixels.shape[1] > 2 * image.pixels.shape[0]:
                fix += f"; where its right half is the depth, name it {path.stem[:40]}_rgbd{path.suffix}"
            rule = "pictures are read as photographs with depth: 'lippmann weave' takes quilts, 'lippmann view' our own"
            if data.endswith(_SAMSUNG):
                fix += "; Samsung's own is taken out by: exiftool -b -SingleShotDepthMapTiff a.jpg > a_depth.tif"
            if path.suffix.lower() in _TIFF and any(note.endswith("the first is shown") for note in notes):
                fix += "; slices of a volume are read as .npz, with the mm between voxels along z, y and x: "
                fix += "numpy.savez('a.npz', tifffile.imread('a.tif'), spacing=(2, 1, 1))"
            raise SceneError("needs a depth map", where=path.name, rule=rule, fix=fix)
        notes = (*notes, f"depth from {depth_map.name}, which lies beside it")
    chosen = read_depth_map(depth_map) if depth_map is not None else own
    assert chosen is not None
    notes = (*notes, *filter(None, [chosen.note]))
    height, width = image.pixels.shape[:2]
    rows, columns = chosen.inverse.shape
    if not _alike((width, height), (columns, rows)):
        fix = f"turn the map as the picture's EXIF orientation {turn} turns it" if lies(turn) else "turn one of them"
        raise SceneError(
            f"the depth map has {columns}x{rows} pixels, the picture {width}x{height}",
            where=path.name,
            rule="their sides have the same proportion",
            fix=fix if _alike((height, width), (columns, rows)) else "",
        )
    step = math.ceil(math.sqrt(rows * columns / _MOST_POINTS))
    check_input(_BYTES_PER_POINT * (rows // step) * (columns // step), "its height field", where=path.name)
    places = np.arange(step // 2, rows, step), np.arange(step // 2, columns, step)
    inverse = chosen.inverse[np.ix_(*places)]
    if min(inverse.shape) < 2:
        raise SceneError(f"the depth map has {columns}x{rows} pixels", where=path.name, rule="2 x 2 and more are read")
    v, u = ((place + 0.5) / count for place, count in zip(places, (rows, columns), strict=True))
    layers = split_layers(inverse, _colors_at(image, u, v), path.name)
    description = _description(path.stem, image, layers, u, v)
    return replace(description, notes=[*notes, *description.notes])


def _color_and_depth(image: Image, form: RgbdForm, data: bytes) -> tuple[Image, DepthMap]:
    """The two halves of a picture whose name says that it has depth beside colour."""
    width = image.pixels.shape[1]
    if width % 2 or image.pixels.shape[2] < 3:
        rule = "colour and depth have one width, in red, green and blue"
        raise SceneError(f"is {width} pixels wide", where=image.name, rule=rule)
    color, depth = np.split(image.pixels[..., :3], 2, axis=1)
    depth = without_ringing(depth, data)
    if form.half:
        color = np.repeat(color, 2, axis=1)
        depth = np.repeat(depth, 2, axis=1)
    return Image(image.name, np.ascontiguousarray(color)), of_nearness(depth, form.white, image.name)


def depth_beside(photograph: Path) -> Path | None:
    """The depth map beside a photograph, named like it; None without.

    That is ``photo_depth.png`` beside ``photo.jpg``, or ``a-depth.png`` beside ``a-image.jpg``.
    """
    try:
        names = sorted(os.listdir(photograph.parent))
    except OSError:
        return None
    for stem in dict.fromkeys((photograph.stem, _COLOR.sub("", photograph.stem))):
        for name in names:
            if name.startswith(stem) and _DEPTH.fullmatch(name, len(stem)):
                return photograph.with_name(name)
    return None


def _alike(first: tuple[int, int], second: tuple[int, int]) -> bool:
    """Whether two pictures ``(width, height)`` have sides of one proportion."""
    return abs(math.log((first[0] / first[1]) / (second[0] / second[1]))) <= _ASPECT


def _colors_at(image: Image, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float32]:
    """Colours ``(h, w, 3)`` of the picture, as coded, in [0, 1], in the size of the height field."""
    pixels = image.pixels[..., :3]
    if pixels.dtype != np.uint8:
        pixels = np.rint(np.clip(pixels, 0.0, 1.0) * 255.0).astype(np.uint8)
    picture = Pillow.fromarray(np.ascontiguousarray(np.broadcast_to(pixels, (*pixels.shape[:2], 3))))
    small = picture.resize((len(u), len(v)), Pillow.Resampling.BOX)
    return np.asarray(small, np.float32) / np.float32(255.0)


def _description(
    name: str, image: Image, layers: Layers, u: NDArray[np.float64], v: NDArray[np.float64]
) -> SceneDescription:
    height, width = image.pixels.shape[:2]
    sides = np.array([width, height]) / min(width, height)
    across = np.stack(np.broadcast_arrays((u - 0.5) * sides[0], (0.5 - v[:, None]) * sides[1]), axis=-1)
    uvs = np.stack(np.broadcast_arrays(u, v[:, None]), axis=-1).reshape(-1, 2).astype(np.float32)

    def mesh(label: str, nearness: NDArray[np.float32], faces: NDArray[np.uint32], material: int) -> Mesh:
        points = np.concatenate([across, DEPTH * nearness[..., None]], axis=-1).reshape(-1, 3)
        used = np.zeros(len(points), bool)
        used[faces] = True
        places = np.cumsum(used, dtype=np.uint32) - np.uint32(1)
        return Mesh(label, points[used].astype(np.float32), places[faces], material, uvs=(uvs[used],))

    behind = Image(f"{name}, behind", np.rint(layers.behind_colors * 255.0).astype(np.uint8))
    materials = [
        Material(label, base_color_texture=Texture(each, srgb=True, wrap_u="clamp", wrap_v="clamp"), unlit=True)
        for label, each in (("photograph", _rgb(image)), ("behind", behind))
    ]
    meshes = [mesh("photograph", layers.nearness, layers.faces, 0)]
    if len(layers.behind_faces):
        meshes.append(mesh("behind", layers.behind, layers.behind_faces, 1))
    notes = []
    if layers.filled:
        notes.append(f"{100 * layers.filled:.1f} % of the depth map have no depth and are filled from beside")
    instances = [Instance(number, np.eye(4)) for number in range(len(meshes))]
    return SceneDescription(name, meshes, materials[: len(meshes)], instances, notes=notes, fills_panel=True)


def _rgb(image: Image) -> Image:
    """Without alpha: a photograph hides what lies behind it."""
    return Image(image.name, np.ascontiguousarray(image.pixels[..., :3])) if image.pixels.shape[2] == 4 else image
