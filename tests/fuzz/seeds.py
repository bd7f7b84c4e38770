"""Writes the sound inputs of the corpus that are no plain text, ``corpus/TARGET/seed-NAME``; the others are by hand.

python tests/fuzz/seeds.py
"""

from __future__ import annotations

import base64
import gzip
import io
import json
import shutil
import struct
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np

from lippmann.codecs.pfm import write_pfm
from lippmann.display import Display, LensArray, Panel
from lippmann.exchange.layouts import export_image
from lippmann.image import IntegralImage, Provenance, write_micro_images, write_views
from lippmann.image.metadata import metadata_of, to_text
from lippmann.image.write import write_picture
from lippmann.journal import FrameJournal, TileResult, TileStore, encode

from parcels import packed  # isort: skip
from targets import GRID  # isort: skip

sys.path.insert(0, str(Path(__file__).parent.parent / "scene" / "readers"))
from heif_files import gradient, heif  # isort: skip

CORPUS = Path(__file__).parent / "corpus"

DISPLAY = Display("tiny", Panel(6, 4, 0.25), LensArray("square", 0.5), gap=2.0)


def image(stored: str = "uint8", **maps: Any) -> IntegralImage:
    """A small picture."""
    codes = np.random.default_rng(1).integers(0, 256, (4, 6, 3)).astype(np.float32) / 255
    provenance = Provenance(method="full", spp=4, scene="x", transfer="linear", rays={"primary": 24})
    return IntegralImage(codes, DISPLAY, provenance=provenance, maps=maps, stored=stored)  # type: ignore[arg-type]


def main() -> None:
    for target, name, data in _all():
        path = CORPUS / target / f"seed-{name}"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def _all() -> Iterator[tuple[str, str, bytes]]:
    yield from _gltf()
    yield "ply", "binary", _ply()
    yield from _splats()
    yield from _volumes()
    pixels, depth = gradient(16, 16)
    yield "heif", "depth", heif(pixels, depth, representation=1)
    yield "stl", "binary", b"made by hand".ljust(80) + struct.pack("<I", 1) + struct.pack("<12fH", *range(12), 0)
    depth = {"depth": np.arange(24, dtype=np.float32).reshape(4, 6), "normal": np.ones((4, 6, 3), np.float32)}
    for target, name, stored, maps in (
        ("png", "8.png", "uint8", {}),
        ("png", "16.png", "uint16", {}),
        ("tiff", "8.tif", "uint8", {}),
        ("tiff", "float.tif", "float32", {}),
        ("exr", "float.exr", "float32", depth),
        ("exr", "half.exr", "float16", {}),
        ("zarr", "8.zarr", "uint8", {}),
    ):
        picture = image(stored, **maps)
        bits = {"uint8": 8, "uint16": 16, "float16": 16, "float32": 32}[stored]
        yield f"picture-{target}", name, _written(lambda path, p=picture, b=bits: write_picture(p, path, bits=b), name)
    for name, data in _tiffs():
        yield "photograph", name, data
    for target, name in (("tiff", "8.tif"), ("zarr", "8.zarr")):
        yield f"pieces-{target}", name, _written(lambda path: write_picture(image("uint8"), path), name)
    yield "metadata", "full", to_text(metadata_of(image())).encode()
    yield "quilt-name", "modern", b"a_qs8x6a0.75.png"
    yield "quilt-name", "older", b"b_qs5x9.jpg"
    yield "views-folder", "views", _written(lambda path: write_views(image(), path), "views")
    yield "views-folder", "micro", _written(lambda path: write_micro_images(image(), path), "micro")
    maps = {"depth": depth["depth"]}
    for layout, name, given in (
        ("hci", "folder", image(**maps)),
        ("views", "folder", image()),
        ("zarr", "8", image(**maps)),
        ("lftoolbox", "8.mat", image()),
        ("eslf", "8.png", image()),
    ):
        yield (
            f"layout-{layout}",
            name.partition(".")[0],
            _written(lambda path, g=given, kind=layout: export_image(g, path, kind, bits=8), name),
        )
    yield "layout-lftoolbox", "5", _matlab_5()
    yield from _scene_pictures()
    yield (
        "quilt-picture",
        "small",
        _encoded(np.random.default_rng(3).integers(0, 256, (32, 48, 3)).astype(np.uint8), "JPEG"),
    )
    yield "tile", "maps", encode(_tile(1))
    yield "journal", "half", _journal()
    yield "frame-journal", "two", _frame_journal()
    yield "pfm", "plain", _written(lambda path: write_pfm(path, depth["depth"]), "a.pfm")


def _written(write: Callable[[Path], object], name: str) -> bytes:
    folder = Path(tempfile.mkdtemp())
    try:
        write(folder / name)
        return packed(folder / name) if (folder / name).is_dir() else (folder / name).read_bytes()
    finally:
        shutil.rmtree(folder)


def _scene_pictures() -> Iterator[tuple[str, str, bytes]]:
    """What scenes take along: surroundings and textures."""
    import OpenEXR

    light = np.linspace(0.1, 2.0, 24, dtype=np.float32).reshape(2, 4, 3)
    planes = {name: np.ascontiguousarray(light[..., number]) for number, name in enumerate("RGB")}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    yield "environment", "exr", _written(lambda path: OpenEXR.File(header, planes).write(str(path)), "a.exr")
    texels = b"".join(bytes((value, 100, 50, 128)) for value in range(8))
    yield "environment", "hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" + texels
    codes = np.random.default_rng(2).integers(0, 256, (4, 4, 4)).astype(np.uint8)
    yield "texture", "rgba.png", _encoded(codes, "PNG")
    yield "texture", "grey16.png", _encoded(codes[..., 0].astype(np.uint16) * 200, "PNG")
    for kind in ("JPEG", "BMP", "TGA", "GIF", "PPM", "WEBP"):
        yield "texture", kind.lower(), _encoded(codes[..., :3], kind)


def _encoded(pixels: Any, kind: str) -> bytes:
    from PIL import Image as Pillow

    stream = io.BytesIO()
    Pillow.fromarray(pixels).save(stream, kind)
    return stream.getvalue()


def _tiffs() -> Iterator[tuple[str, bytes]]:
    """Small TIFF files of every kind of colours."""
    import tifffile
    from PIL import Image as Pillow

    codes = np.random.default_rng(4).integers(0, 256, (4, 6, 3)).astype(np.uint8)
    for kind in ("palette", "ycbcr", "jpeg"):
        picture = Pillow.fromarray(codes)
        picture = picture.quantize(8) if kind == "palette" else picture.convert("YCbCr")
        stream = io.BytesIO()
        picture.save(stream, "TIFF", compression="jpeg" if kind == "jpeg" else None)
        yield f"{kind}.tif", stream.getvalue()
    alpha = np.concatenate([codes, codes[..., :1]], axis=-1)
    for kind, values, options in (
        ("lab", codes, {"photometric": "cielab"}),
        ("planes", np.moveaxis(codes, -1, 0), {"photometric": "rgb", "planarconfig": "separate"}),
        ("bits", codes[..., 0] < 99, {"photometric": "minisblack"}),
        ("half", codes.astype(np.float16), {"photometric": "rgb"}),
        ("associated", alpha, {"photometric": "rgb", "extrasamples": ["assocalpha"]}),
        ("turned", codes, {"photometric": "rgb", "extratags": [(274, 3, 1, 6, True)]}),
        ("white-is-zero", codes[..., 0], {"photometric": "miniswhite", "compression": "lzw"}),
    ):
        stream = io.BytesIO()
        tifffile.imwrite(stream, values, metadata=None, software="", **options)
        yield f"{kind}.tif", stream.getvalue()


def _tile(index: int) -> TileResult:
    shape = GRID[index].shape
    codes = np.random.default_rng(index).integers(0, 256, (*shape, 3)).astype(np.uint8)
    return TileResult(
        index,
        codes,
        {"depth": np.ones(shape, np.float32)},
        {"error": np.zeros((2, 3))},
        {"primary": 32, "discarded": 0},
    )


def _journal() -> bytes:
    folder = Path(tempfile.mkdtemp())
    try:
        with TileStore.open(folder / "p.tif", {"version": "1", "spp": "4"}, GRID, resume=True) as store:
            for index in range(len(GRID)):
                store.put(_tile(index))
        return packed(folder / "p.tif.parts")
    finally:
        shutil.rmtree(folder)


def _frame_journal() -> bytes:
    folder = Path(tempfile.mkdtemp())
    try:
        (folder / "0.png").write_bytes(b"frame")
        with FrameJournal.open(folder / "j", {"version": "1", "spp": "4"}, resume=False) as journal:
            for number in range(2):
                journal.add(number, folder / "0.png", {"method": "full", "denoise": "none"})
        return (folder / "j").read_bytes()
    finally:
        shutil.rmtree(folder)


def _matlab_5() -> bytes:
    from scipy import io as matlab

    stream = io.BytesIO()
    matlab.savemat(stream, {"LF": np.zeros((1, 2, 2, 2, 3), np.uint8)}, do_compression=True)
    return b"MATLAB 5.0 MAT-file".ljust(116) + stream.getvalue()[116:]  # without the date


def _ply() -> bytes:
    head = """ply
format binary_little_endian 1.0
comment by hand
element vertex 3
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 1
property list uchar int vertex_indices
end_header
"""
    corners = ((0, 0, 0, 255, 0, 0), (1, 0, 0, 0, 255, 0), (0, 1, 0, 0, 0, 255))
    return head.encode() + b"".join(struct.pack("<3f3B", *c) for c in corners) + struct.pack("<B3i", 3, 0, 1, 2)


def _gltf() -> Iterator[tuple[str, str, bytes]]:
    tree, data = _scene()
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    yield "glb", "scene", struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body
    tree["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    yield "gltf", "scene", json.dumps(tree, separators=(",", ":")).encode()


def _volumes() -> Iterator[tuple[str, str, bytes]]:
    """A grid of 3 x 2 x 2 voxels in every kind of file."""
    import nibabel
    import pydicom

    grid = np.arange(12, dtype=np.int16).reshape(2, 2, 3)
    nifti = nibabel.Nifti1Image(grid.T, np.eye(4)).to_bytes()
    yield "nifti", "1", nifti
    yield "nifti", "2", nibabel.Nifti2Image(grid.T, np.eye(4)).to_bytes()
    yield "nifti-packed", "1", gzip.compress(nifti, mtime=0)
    npy = io.BytesIO()
    np.save(npy, grid)
    yield "volume-npy", "plain", npy.getvalue()
    npz = io.BytesIO()
    np.savez(npz, grid=grid, spacing=np.ones(3))
    yield "volume-npz", "plain", npz.getvalue()
    header = struct.pack("<3sB5i6f", b"VOL", 3, 1, 3, 2, 2, 1, 0, 0, 0, 1, 1, 1)
    yield "volume-vol", "plain", header + grid.astype("<f4").tobytes()
    meta = pydicom.dataset.FileMetaDataset()
    meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = "1.2.840.10008.5.1.4.1.1.2", "1.2.3"
    data = pydicom.dataset.FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
    data.SOPClassUID, data.SOPInstanceUID, data.SeriesInstanceUID = meta.MediaStorageSOPClassUID, "1.2.3", "1.2.4"
    data.Rows, data.Columns, data.SamplesPerPixel, data.PhotometricInterpretation = 2, 3, 1, "MONOCHROME2"
    data.BitsAllocated, data.BitsStored, data.HighBit, data.PixelRepresentation = 16, 16, 15, 1
    data.PixelSpacing, data.ImagePositionPatient, data.ImageOrientationPatient = [1, 1], [0, 0, 0], [1, 0, 0, 0, 1, 0]
    data.RescaleSlope, data.RescaleIntercept, data.SliceThickness = 1, -1024, 2
    data.PixelData = grid[0].tobytes()
    data["PixelData"].VR = "OW"
    written = io.BytesIO()
    data.save_as(written, enforce_file_format=True)
    yield "dicom", "slice", written.getvalue()


def _splats() -> Iterator[tuple[str, str, bytes]]:
    """Three Gaussian splats in every kind of file."""
    random = np.random.default_rng(5)
    names = ["x", "y", "z", *(f"f_dc_{n}" for n in range(3)), *(f"f_rest_{n}" for n in range(9)), "opacity"]
    names += [*(f"scale_{n}" for n in range(3)), *(f"rot_{n}" for n in range(4))]
    yield "ply-splats", "trained", _rows("vertex", names, "float", random.normal(size=(3, len(names))).astype("<f4"))
    discs = [name for name in names if name != "scale_2"]
    yield "ply-splats", "discs", _rows("vertex", discs, "float", random.normal(size=(3, len(discs))).astype("<f4"))
    colored = ["red" if name == "f_dc_0" else {"f_dc_1": "green", "f_dc_2": "blue"}.get(name, name) for name in names]
    colored = [name for name in colored if not name.startswith("f_rest")]
    yield "ply-splats", "colours", _rows("vertex", colored, "float", random.random((3, len(colored))).astype("<f4"))
    bounds = [f"{end}{part}{axis}" for part in ("_", "_scale_") for end in ("min", "max") for axis in "xyz"]
    bounds += [f"{end}_{color}" for end in ("min", "max") for color in "rgb"]
    chunk = _rows("chunk", bounds, "float", np.repeat([-1, 1, -4, -1, 0, 1], 3).astype("<f4")[None])
    packed_names = [f"packed_{part}" for part in ("position", "rotation", "scale", "color")]
    words = random.integers(0, 2**32, (3, 4), dtype=np.uint32)
    sh = random.integers(0, 256, (3, 9), dtype=np.uint8)
    parts = [
        chunk,
        _rows("vertex", packed_names, "uint", words),
        _rows("sh", [f"f_rest_{n}" for n in range(9)], "uchar", sh),
    ]
    heads, bodies = zip(*(part.split(b"end_header\n", 1) for part in parts), strict=True)
    start = b"ply\nformat binary_little_endian 1.0\n"
    yield (
        "ply-splats",
        "packed",
        start + b"".join(h.removeprefix(start) for h in heads) + b"end_header\n" + b"".join(bodies),
    )
    payload = struct.pack("<4sIIBBBB", b"NGSP", 3, 3, 1, 12, 0, 0) + random.bytes(3 * (9 + 1 + 3 + 3 + 4 + 9))
    yield "spz", "unpacked", payload
    yield "spz", "packed.spz", gzip.compress(payload, mtime=0)
    yield "spz", "version-4", _spz_4(np.random.default_rng(7).bytes(3 * 29))
    yield "sog", "bundled", _sog()
    yield "gltf", "splats", _gltf_splats()


def _spz_4(body: bytes) -> bytes:
    """Three splats with harmonics of degree 1, of those bytes, and an extension that says what their axes are."""
    ends = 3 * np.cumsum([9, 1, 3, 3, 4, 9])
    sections = [body[start:end] for start, end in zip([0, *ends[:-1]], ends, strict=True)]
    streams = [imagecodecs.zstd_encode(section) for section in sections]
    head = struct.pack("<4sIIBBBBI12xIII", b"NGSP", 4, 3, 1, 12, 2, 6, 44, 0xADBE0003, 4, 6)
    sizes = [struct.pack("<QQ", len(p), len(s)) for p, s in zip(streams, sections, strict=True)]
    return head + b"".join(sizes) + b"".join(streams)


def _rows(element: str, names: list[str], kind: str, rows: Any) -> bytes:
    """A PLY file of one element."""
    lines = ["ply", "format binary_little_endian 1.0", f"element {element} {len(rows)}"]
    lines += [f"property {kind} {name}" for name in names]
    return "\n".join([*lines, "end_header", ""]).encode() + rows.tobytes()


def _sog() -> bytes:
    random = np.random.default_rng(6)
    book = random.normal(size=256).round(2).tolist()
    meta = {
        "version": 2,
        "count": 3,
        "means": {"mins": [-1, -1, -1], "maxs": [1, 1, 1], "files": ["l.webp", "u.webp"]},
        "scales": {"codebook": book, "files": ["s.webp"]},
        "quats": {"files": ["q.webp"]},
        "sh0": {"codebook": book, "files": ["c.webp"]},
        "shN": {"count": 64, "bands": 1, "codebook": book, "files": ["p.webp", "n.webp"]},
    }

    def write(path: Path) -> None:
        from PIL import Image as Pillow

        path.mkdir()
        (path / "meta.json").write_text(json.dumps(meta))
        for name in ("l", "u", "s", "q", "c", "n", "p"):
            pixels = random.integers(0, 256, (1, 192, 4) if name == "p" else (2, 2, 4), dtype=np.uint8)
            if name == "n":
                pixels[..., :2] = 0
            Pillow.fromarray(pixels).save(path / f"{name}.webp", "WEBP", lossless=True, exact=True)

    return _written(write, "sog")


def _gltf_splats() -> bytes:
    random = np.random.default_rng(7)
    widths = {"POSITION": 3, "SCALE": 3, "ROTATION": 4, "OPACITY": 1, "SH_DEGREE_0_COEF_0": 3}
    widths |= {f"SH_DEGREE_1_COEF_{n}": 3 for n in range(3)}
    shapes = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
    data, views, accessors, attributes = b"", [], [], {}
    values_of = {name: random.uniform(0.1, 1, (3, width)).astype("<f4") for name, width in widths.items()}
    values_of |= {"times": np.array([[0], [1]], "<f4"), "places": np.array([[0, 0, 0], [0, 0, 1]], "<f4")}
    for name, values in values_of.items():
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes})
        data += values.tobytes()
        if name in widths:
            attributes[name if name == "POSITION" else f"KHR_gaussian_splatting:{name}"] = len(accessors)
        accessors.append(
            {"bufferView": len(accessors), "componentType": 5126, "count": len(values), "type": shapes[values.shape[1]]}
        )
    splats = {"KHR_gaussian_splatting": {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}}
    tree = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_gaussian_splatting"],
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "rotation": [0, 0.6, 0, 0.8], "scale": [1, 2, 1]}],
        "animations": [
            {
                "samplers": [{"input": len(accessors) - 2, "output": len(accessors) - 1}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            }
        ],
        "meshes": [{"primitives": [{"mode": 0, "attributes": attributes, "extensions": splats}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [
            {
                "byteLength": len(data),
                "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
            }
        ],
    }
    return json.dumps(tree, separators=(",", ":")).encode()


def _texture() -> bytes:
    from PIL import Image as Pillow

    picture = io.BytesIO()
    Pillow.fromarray(np.full((2, 2, 4), 200, np.uint8)).save(picture, "PNG")
    return picture.getvalue()


def _scene() -> tuple[dict[str, Any], bytes]:
    """A skinned, morphed, animated triangle with texture, points, lines, a sparse accessor, a light and a camera."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
    parts: list[tuple[Any, str | None]] = [
        (corners, "VEC3"),
        (np.tile(np.array([0, 0, 1], "<f4"), (3, 1)), "VEC3"),
        (corners[:, :2].copy(), "VEC2"),
        (np.array([0, 1, 2], "<u2"), "SCALAR"),
        (np.zeros((3, 4), "u1"), "VEC4"),
        (np.tile(np.array([1, 0, 0, 0], "<f4"), (3, 1)), "VEC4"),
        (np.eye(4, dtype="<f4").reshape(1, 16), "MAT4"),
        (np.array([0, 1], "<f4"), "SCALAR"),
        (np.array([[0, 0, 0], [0, 0, 1]], "<f4"), "VEC3"),
        (np.array([0, 1], "<f4"), "SCALAR"),
        (np.array([2], "<u2"), None),
        (np.array([[0, 2, 0]], "<f4"), None),
        (np.frombuffer(_texture(), "u1"), None),
    ]
    component = {"f": 5126, "u2": 5123, "u1": 5121}
    data, views, accessors = b"", [], []
    for values, kind in parts:
        data += bytes(-len(data) % 4)
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes})
        data += values.tobytes()
        if kind is not None:
            code = component["f" if values.dtype.kind == "f" else f"u{values.dtype.itemsize}"]
            accessors.append({"bufferView": len(views) - 1, "componentType": code, "count": len(values), "type": kind})
    sparse = {"count": 1, "indices": {"bufferView": 10, "componentType": 5123}, "values": {"bufferView": 11}}
    accessors.append({"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse})
    attributes = {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "JOINTS_0": 4, "WEIGHTS_0": 5}
    rough = {"baseColorTexture": {"index": 0, "texCoord": 0}, "metallicFactor": 0.5, "roughnessFactor": 0.3}
    material = {
        "pbrMetallicRoughness": rough,
        "emissiveFactor": [0.1, 0, 0],
        "alphaMode": "MASK",
        "alphaCutoff": 0.4,
        "extensions": {
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.5},
            "KHR_materials_ior": {"ior": 1.4},
            "KHR_texture_transform": {},
        },
    }
    lamp = {"type": "spot", "color": [1, 1, 1], "intensity": 10, "spot": {"outerConeAngle": 0.5}}
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 2, 3]}],
        "extensionsUsed": [
            "KHR_lights_punctual",
            "KHR_materials_clearcoat",
            "KHR_materials_ior",
            "KHR_draco_mesh_compression",
        ],
        "extensions": {"KHR_lights_punctual": {"lights": [lamp]}},
        "nodes": [
            {"mesh": 0, "skin": 0, "children": [1], "weights": [0.5]},
            {"translation": [0, 0, 1], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]},
            {"camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}, "mesh": 1},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.6, "znear": 0.1, "aspectRatio": 1.5}}],
        "skins": [{"joints": [1], "inverseBindMatrices": 6}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": attributes, "indices": 3, "material": 0, "mode": 4, "targets": [{"POSITION": 10}]}
                ]
            },
            {"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "mode": mode} for mode in (0, 2, 3)]},
        ],
        "materials": [material],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": 33071, "magFilter": 9728}],
        "images": [{"bufferView": 12, "mimeType": "image/png"}],
        "animations": [
            {
                "samplers": [{"input": 7, "output": 8, "interpolation": "LINEAR"}, {"input": 7, "output": 9}],
                "channels": [
                    {"sampler": 0, "target": {"node": 1, "path": "translation"}},
                    {"sampler": 1, "target": {"node": 0, "path": "weights"}},
                ],
            }
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }, data


if __name__ == "__main__":
    main()
