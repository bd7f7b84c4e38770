"""STL meshes, text and binary."""

import struct

import numpy as np
import pytest

from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.scene.readers.stl import read_stl

TRIANGLES = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 1, 0], [0, 0, 2]]], float)


def binary_file(header=b"made by a test"):
    facets = [struct.pack("<12fH", 0, 0, 1, *triangle.ravel(), 0) for triangle in TRIANGLES]
    return header.ljust(80, b"\0") + struct.pack("<I", len(facets)) + b"".join(facets)


def text_file(solids=1):
    facets = []
    for triangle in TRIANGLES:
        vertices = "".join(f"   vertex {x:e} {y:e} {z:e}\n" for x, y, z in triangle)
        facets.append(f" facet normal 0 0 1\n  outer loop\n{vertices}  endloop\n endfacet\n")
    return ("solid a name\n" + "".join(facets) + "endsolid a name\n").encode() * solids


@pytest.fixture
def read(tmp_path):
    def read(data):
        path = tmp_path / "model.stl"
        path.write_bytes(data)
        return read_stl(path)

    return read


@pytest.mark.parametrize("data", [text_file(), binary_file(), binary_file(b"solid beginnings lie")])
def test_facets(read, data):
    (mesh,) = read(data).meshes
    assert (mesh.positions[mesh.faces] == TRIANGLES).all()
    assert mesh.positions.dtype == np.float32
    assert mesh.normals is None


def colored_file(header, numbers):
    data = bytearray(binary_file(header))
    for facet, number in enumerate(numbers):
        struct.pack_into("<H", data, 84 + 50 * facet + 48, number)
    return bytes(data)


@pytest.mark.parametrize(
    ("header", "numbers", "expected"),
    [
        # VisCAM and SolidView: 1 bit "has a colour", then red, green, blue; without a colour the reader's own grey.
        (b"", (0b1_11111_00000_00000, 0), ((1, 0, 0), (0.7, 0.7, 0.7))),
        # Materialise: 1 bit "has the colour of the object", then blue, green, red.
        (b"COLOR=\x00\xff\x00\xff", (0b0_00000_00000_11111, 1 << 15), ((1, 0, 0), (0, 1, 0))),
        (b"COLOR=\x00\xff\x00\xff", (0, 0), ((0, 1, 0), (0, 1, 0))),
        # MeshLab: 1 bit "has a colour" instead, and 0 where there is none, as it writes meshes without colours.
        (
            b"COLOR=\x7f\x7f\x7f MATERIAL=\x7f\x7f\x7f",
            (0b1_00000_00000_11111, 0),
            ((1, 0, 0), decode_srgb(np.full(3, 127 / 255))),
        ),
    ],
)
def test_colours_of_facets(read, header, numbers, expected):
    scene = read(colored_file(header, numbers))
    (mesh,), (material,) = scene.meshes, scene.materials
    np.testing.assert_allclose(mesh.colors[mesh.faces[:, 0]][:, :3] * material.base_color, expected, atol=1e-6)


def test_numbers_of_facets_that_are_no_colours(read):
    assert read(colored_file(b"", (1 << 15, 7))).meshes[0].colors is None
    assert read(colored_file(b"COLOR=".rjust(80), (1, 7))).meshes[0].colors is None


def test_several_solids(read):
    assert len(read(text_file(3)).meshes[0].faces) == 6


@pytest.mark.parametrize(
    "data",
    [
        text_file().replace(b" facet", b"# facet of vertex 1 2 3\n // so it is\n facet"),
        text_file().replace(b"\n", b" # endfacet\n"),
        text_file().replace(b"facet normal 0 0 1", b"facet"),
        text_file().replace(b"facet normal 0 0 1", b"facet normal"),
        text_file().replace(b"facet normal 0 0 1", b"facet normal -nan(ind) nan 0"),
        text_file().replace(b"solid a name", b"solid facet vertex 1 2 3"),
        text_file().replace(b"\n", b"\r\n"),
        text_file().upper(),
        b"solid x\n" + b" ".join(text_file().split(b"\n")[1:-2]) + b"\nendsolid x\n",
        b"\xef\xbb\xbf" + text_file(),
        b"# made by a test\n" + text_file(),
    ],
)
def test_text_as_writers_write_it(read, data):
    (mesh,) = read(data).meshes
    assert (mesh.positions[mesh.faces] == TRIANGLES).all()


@pytest.mark.parametrize("data", [text_file(), binary_file()])
def test_every_cut_short_file_is_refused(read, data):
    for end in range(1, len(data.rstrip()) - len(b" a name")):
        with pytest.raises(SceneError):
            read(data[:end])


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "the file is empty"),
        (b"hello", "is no STL file"),
        (b"x" * 200, r"has 200 bytes, and its header speaks of \d+ facets"),
        (binary_file() + b"\0", r"has 185 bytes, and its header speaks of 2 facets; they take 184 bytes"),
        (binary_file()[:-1], "is it cut short"),
        (b"\0" * 84, "holds no facets"),
        (b"solid\nendsolid\n", "holds no facets"),
        (text_file().replace(b"0.000000e+00 0.000000e+00 2.0", b"0 x 2.0"), "a vertex is no number .*'x'"),
        (text_file().replace(b"0.000000e+00 0.000000e+00 2.000000e+00", b"0 2.0"), r"a vertex is no number"),
        (
            text_file().replace(b"   vertex 0.000000e+00 0.000000e+00 2", b"   v 2"),
            r"model\.stl:9: facet with 2 vertices",
        ),
        (text_file().replace(b"  endloop\n endfacet\nends", b"  endloop\nends"), "ends within a facet"),
        (text_file().replace(b"endsolid a name", b""), "has 1 'solid' and 0 'endsolid'"),
    ],
)
def test_bad_files(read, data, message):
    with pytest.raises(SceneError, match=message) as caught:
        read(data)
    assert "\n" not in str(caught.value)
