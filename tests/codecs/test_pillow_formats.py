"""Textures are opened by an allow list of formats: no file that a scene names starts a program."""

from __future__ import annotations

import base64
import io
import json
import os
import re
from pathlib import Path

import numpy as np
import pytest
import tifffile
import trimesh
from PIL import EpsImagePlugin
from PIL import Image as Pillow

import lippmann.codecs.pillow_formats
from lippmann.codecs.pillow_formats import FORMATS, is_allowed, open_picture
from lippmann.errors import SceneError
from lippmann.scene.parsing.files import decode_image
from lippmann.scene.readers.gltf import read_gltf
from lippmann.scene.readers.obj import read_obj
from lippmann.scene.readers.ply import read_ply
from lippmann.scene.readers.tachyon.reader import read_tachyon
from lippmann.scene.readers.trimesh_objects import from_trimesh

EPS = b"""%!PS-Adobe-3.0 EPSF-3.0
%%BoundingBox: 0 0 4 4
%%EndComments
0 0 4 4 rectfill
%%EOF
"""

OBJ = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n"

TACHYON = """BEGIN_SCENE RESOLUTION 8 6
SPHERE CENTER 0 0 0 RAD 1
TEXTURE AMBIENT 0 DIFFUSE 1 SPECULAR 0 OPACITY 1 COLOR 1 0 0
TEXFUNC 9 skin.tga CENTER 0 0 0 ROTATE 0 0 0 SCALE 1 1 1 UAXIS 1 0 0 VAXIS 0 1 0
END_SCENE
"""

PLY = """ply
format ascii 1.0
comment TextureFile skin.png
element vertex 3
property float x
property float y
property float z
property float s
property float t
element face 1
property list uchar int vertex_indices
end_header
0 0 0 0 0
1 0 0 1 0
0 1 0 0 1
3 0 1 2
"""


@pytest.fixture
def ghostscript(tmp_path, monkeypatch):
    """The file that a program named ``gs`` makes when it is started, which stands in for Ghostscript."""
    programs, marker = tmp_path / "bin", tmp_path / "started"
    programs.mkdir()
    program = programs / "gs"
    program.write_text(f"#!/bin/sh\n: > '{marker}'\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setattr(EpsImagePlugin, "gs_binary", None)  # Pillow looks for the program once
    return marker


def obj(folder):
    (folder / "skin.png").write_bytes(EPS)
    (folder / "m.mtl").write_text("newmtl a\nmap_Kd skin.png\n")
    (folder / "s.obj").write_text(OBJ)
    return read_obj(folder / "s.obj")


def ply(folder):
    (folder / "skin.png").write_bytes(EPS)
    (folder / "s.ply").write_text(PLY)
    return read_ply(folder / "s.ply")


def gltf(folder, image, *, view=None):
    """A triangle that glows by a picture: ``image`` is its entry, ``view`` its bytes where they lie in the buffer."""
    data = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    views = [{"buffer": 0, "byteLength": len(data)}]
    if view is not None:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(view)})
        data += view
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    tree = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"emissiveTexture": {"index": 0}}],
        "textures": [{"source": 0}],
        "images": [image],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": views,
        "buffers": [{"byteLength": len(data), "uri": uri}],
    }
    (folder / "s.gltf").write_text(json.dumps(tree))
    return read_gltf(folder / "s.gltf")


def gltf_file(folder):
    (folder / "skin.png").write_bytes(EPS)
    return gltf(folder, {"uri": "skin.png"})


def gltf_data(folder):
    gltf(folder, {"uri": "data:image/png;base64," + base64.b64encode(EPS).decode()})


def gltf_view(folder):
    gltf(folder, {"bufferView": 1, "mimeType": "image/png"}, view=EPS)


def tachyon(folder):
    (folder / "skin.tga").write_bytes(EPS)
    (folder / "s.dat").write_text(TACHYON)
    read_tachyon(folder / "s.dat")


def in_memory(folder):
    mesh = trimesh.creation.box()
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=Pillow.open(io.BytesIO(EPS)))
    mesh.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(mesh.vertices), 2)), material=material)
    from_trimesh(mesh)


@pytest.mark.parametrize("scene", [obj, ply, gltf_file, gltf_data, gltf_view, tachyon, in_memory])
def test_a_texture_starts_no_program(tmp_path, ghostscript, scene):
    folder = tmp_path / "scene"
    folder.mkdir()
    with pytest.raises(SceneError) as refused:
        scene(folder)
    assert not ghostscript.exists()
    line = str(refused.value)
    assert len(line.splitlines()) == 1
    assert "PNG, JPEG, GIF, BMP, TIFF, WebP, AVIF, PPM, DDS and TGA are read" in line


def test_the_stand_in_is_started_where_formats_are_not_restricted(ghostscript):
    with Pillow.open(io.BytesIO(EPS)) as picture, pytest.raises(OSError):  # noqa: PT011  # it makes no picture
        picture.convert("RGB")
    assert ghostscript.exists()


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "GIF", "BMP", "TIFF", "WEBP", "AVIF", "PPM", "DDS", "TGA"])
def test_the_formats_of_the_list_are_read_whatever_their_name_says(kind):
    Pillow.init()
    if kind not in Pillow.SAVE:
        pytest.skip(f"this Pillow does not write {kind}")
    stream = io.BytesIO()
    Pillow.new("RGB", (5, 4), (250, 0, 0)).save(stream, kind)
    image = decode_image(stream.getvalue(), "skin.eps", where="f:7")
    assert image.pixels.shape == (4, 5, 3)
    assert image.pixels[0, 0].tolist() == pytest.approx([250, 0, 0], abs=6)


def dds(texels, blocks):
    stream = io.BytesIO()
    Pillow.fromarray(np.tile(np.array(texels, np.uint8), (8, 8, 1))).save(stream, "DDS", pixel_format=blocks)
    return stream.getvalue()


@pytest.mark.parametrize(("blocks", "srgb"), [("BC2", 75), ("BC3", 78)])
def test_dds_of_srgb_coded_blocks(blocks, srgb):
    data = bytearray(dds([200, 100, 50, 255], blocks))
    data[128:132] = srgb.to_bytes(4, "little")
    found = decode_image(bytes(data), "skin.dds", where="f").pixels
    assert found[3, 3].tolist() == pytest.approx([200, 100, 50, 255], abs=6)


@pytest.mark.parametrize("scene", [obj, ply, gltf_file])
def test_models_are_shown_without_dds_that_pillow_does_not_decode(tmp_path, monkeypatch, scene):
    unknown = bytearray(dds([200, 100, 50, 255], "BC3"))
    unknown[128:132] = (61).to_bytes(4, "little")  # R8
    monkeypatch.setattr(f"{__name__}.EPS", bytes(unknown))
    notes = scene(tmp_path).notes
    assert any("is not decoded (Unimplemented DXGI format 61)" in note and "shown without it" in note for note in notes)


def test_dds_of_two_channels_are_normals():
    found = decode_image(dds([204, 128, 0], "BC5"), "relief.dds", where="f").pixels
    assert found[3, 3].tolist() == pytest.approx([204, 128, 229], abs=3)  # of x 0.6, z is 0.8


def test_two_pictures_in_one_jpeg_file_are_a_jpeg_file():
    stream = io.BytesIO()
    first, second = (Pillow.new("RGB", (5, 4), color) for color in ("red", "blue"))
    first.save(stream, "MPO", save_all=True, append_images=[second])
    assert decode_image(stream.getvalue(), "camera.jpg", where="f").pixels.shape == (4, 5, 3)


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "TIFF"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_textures_stay_as_stored(kind, orientation):
    exif = Pillow.Exif()
    exif[0x112] = orientation
    texels = np.repeat(np.repeat(np.array([[0, 90, 160], [255, 40, 200]], np.uint8), 8, axis=0), 8, axis=1)
    stream = io.BytesIO()
    Pillow.fromarray(texels).save(stream, kind, exif=exif, **({"quality": 95} if kind == "JPEG" else {}))
    found = decode_image(stream.getvalue(), "skin", where="f").pixels[..., 0]
    assert found.shape == texels.shape
    assert np.abs(found.astype(int) - texels).max() < 12


def test_greys_of_16_bits_whose_0_is_white():
    stream = io.BytesIO()
    tifffile.imwrite(stream, np.array([[0, 65535]], np.uint16), photometric="miniswhite")
    assert decode_image(stream.getvalue(), "skin.tif", where="f").pixels[..., 0].tolist() == [[1.0, 0.0]]


@pytest.mark.parametrize("kind", ["ICO", "PCX", "SGI", "PDF", "EPS"])
def test_other_formats_are_refused(kind):
    stream = io.BytesIO()
    Pillow.new("RGB", (16, 16)).save(stream, kind)
    with pytest.raises(SceneError, match=r"^f:7: texture 'skin\.png' is not a picture that can be read; PNG, JPEG"):
        decode_image(stream.getvalue(), "skin.png", where="f:7")


def test_pictures_in_memory_count_by_the_format_they_were_opened_as():
    assert is_allowed(Pillow.new("RGB", (2, 2)))
    assert not is_allowed(Pillow.open(io.BytesIO(EPS)))
    stream = io.BytesIO()
    Pillow.new("RGB", (2, 2)).save(stream, "PNG")
    with open_picture(stream) as picture:
        assert is_allowed(picture)
    assert "EPS" not in FORMATS


def test_no_other_module_opens_pictures_with_pillow():
    source = Path(lippmann.codecs.pillow_formats.__file__).parents[1]
    modules = [path for path in source.rglob("*.py") if re.search(r"\b(Image|Pillow)\.open\(", path.read_text("utf-8"))]
    assert modules == [source / "codecs" / "pillow_formats.py"]


def test_the_memory_that_is_left_bounds_a_picture_of_16384_pixels_a_side():
    import struct
    import zlib

    from lippmann.errors import MemoryLimitError
    from lippmann.runtime.machine import limit_inputs

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">2I5B", 16384, 16384, 8, 2, 0, 0, 0)
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", b"") + chunk(b"IEND", b"")
    limit = Pillow.MAX_IMAGE_PIXELS
    says = "16384 x 16384 pixels takes 2"
    with limit_inputs(1 << 30), pytest.raises(MemoryLimitError, match=says), open_picture(io.BytesIO(png)):
        pass
    with limit_inputs(4 << 30), open_picture(io.BytesIO(png)) as picture:
        assert picture.size == (16384, 16384)
    assert limit == Pillow.MAX_IMAGE_PIXELS
