"""Gaussian splats in glTF files: attributes, places, and surfaces beside them."""

import gzip
import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lippmann.errors import SceneError
from lippmann.scene.readers.load import load_scene

COUNT = 5
KEY = "KHR_gaussian_splatting"


def numbers(degree=0, seed=0):
    random = np.random.default_rng(seed)
    values = {
        "SCALE": random.uniform(0.1, 0.5, (COUNT, 3)),
        "ROTATION": Rotation.random(COUNT, rng=random).as_quat(),
        "OPACITY": random.uniform(0, 1, COUNT),
    }
    for own in range(degree + 1):
        for place in range(2 * own + 1):
            values[f"SH_DEGREE_{own}_COEF_{place}"] = random.normal(size=(COUNT, 3))
    return random.normal(size=(COUNT, 3)), values


def splat_mesh(writer, positions, values, dtypes=None, **extension):
    told = {}
    for name, value in values.items():
        kind, most = (dtypes or {}).get(name, ("f4", 1))
        more = {} if kind == "f4" else {"normalized": True}
        told[f"{KEY}:{name}"] = writer.accessor(np.round(value * most) if more else value, kind, **more)
    extension = {"kernel": "ellipse", "colorSpace": "srgb_rec709_display", **extension}
    return writer.mesh(positions, mode=0, attributes=told, extensions={KEY: extension})


@pytest.fixture
def load(tmp_path):
    def read(writer):
        writer.json["extensionsUsed"] = [KEY]
        path = tmp_path / "a.glb"
        path.write_bytes(writer.glb())
        return load_scene(path)

    return read


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_attributes_become_splats(writer, load, degree):
    positions, values = numbers(degree)
    writer.node(mesh=splat_mesh(writer, positions, values))
    scene = load(writer)
    splats = scene.description.splats
    np.testing.assert_allclose(splats.centers, positions, rtol=1e-6)
    np.testing.assert_allclose(splats.scales, values["SCALE"], rtol=1e-6)
    np.testing.assert_allclose(splats.rotations, values["ROTATION"], atol=1e-6)
    np.testing.assert_allclose(splats.opacities, values["OPACITY"], rtol=1e-6)
    true = np.stack([value for name, value in values.items() if name.startswith("SH")], axis=1)
    np.testing.assert_allclose(splats.harmonics, true, rtol=1e-6)
    assert not splats.linear
    assert not scene.notes


def test_integers_logarithms_and_linear_colors_are_understood(writer, load):
    positions, values = numbers()
    dtypes = {"ROTATION": ("i2", 32767), "OPACITY": ("u1", 255)}
    true = {**values}
    values["SCALE"] = np.log(values["SCALE"])
    writer.node(mesh=splat_mesh(writer, positions, values, dtypes, colorSpace="lin_rec709_display"))
    splats = load(writer).description.splats
    np.testing.assert_allclose(splats.scales, true["SCALE"], rtol=1e-5)
    np.testing.assert_allclose(splats.rotations, true["ROTATION"], atol=1e-4)
    np.testing.assert_allclose(splats.opacities, true["OPACITY"], atol=0.002)
    assert splats.linear


def test_nodes_place_splats_beside_surfaces(writer, load):
    positions, values = numbers(1)
    mesh = splat_mesh(writer, positions, values)
    writer.node(mesh=mesh, translation=[1, 2, 3], scale=[2, 2, 2])
    writer.node(mesh=mesh)
    writer.node(mesh=writer.mesh())
    description = load(writer).description
    assert description.splats.count == 2 * COUNT
    assert len(description.placements) == 1
    np.testing.assert_allclose(description.splats.centers[:COUNT], 2 * positions + [1, 2, 3], rtol=1e-5)
    np.testing.assert_allclose(description.splats.scales[:COUNT], 2 * values["SCALE"], rtol=1e-5)


@pytest.mark.parametrize("draft", [False, True])
def test_splats_compressed_as_spz(writer, load, draft):
    place = b"".join(int(v * 4096).to_bytes(3, "little", signed=True) for v in (1.5, -0.25, 2.0))
    body = place + bytes([51, 128, 128, 128, 112, 112, 112, 128, 128, 128])
    data = gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", 2, 1, 0, 12, 0, 0) + body)
    name = "KHR_gaussian_splatting_compression_spz_2"
    view = writer.view(data)
    extension = {KEY: {"kernel": "ellipse", "extensions": {name: {"bufferView": view}}}}
    if draft:
        extension = {"KHR_spz_gaussian_splats_compression": {"bufferView": view}}
        writer.json["extensionsRequired"] = writer.json["extensionsUsed"] = [*extension]
    mesh = writer.add("meshes", primitives=[{"attributes": {}, "mode": 0, "extensions": extension}])
    writer.node(mesh=mesh)
    np.testing.assert_array_equal(load(writer).description.splats.centers, [[1.5, -0.25, 2.0]])


@pytest.mark.parametrize(
    ("missing", "said"),
    [("OPACITY", "OPACITY is missing"), ("SH_DEGREE_1_COEF_1", "SH_DEGREE_1_COEF_1 is missing")],
)
def test_missing_attributes_are_named(writer, load, missing, said):
    positions, values = numbers(1)
    del values[missing]
    writer.node(mesh=splat_mesh(writer, positions, values))
    with pytest.raises(SceneError, match=said):
        load(writer)


def test_attributes_of_other_lengths_are_refused(writer, load):
    positions, values = numbers()
    writer.node(mesh=splat_mesh(writer, positions[:-1], values))
    with pytest.raises(SceneError, match="has 5 elements for 4 splats"):
        load(writer)


def test_mixed_colors_are_refused(writer, load):
    positions, values = numbers()
    for space in ("srgb_rec709_display", "lin_rec709_display"):
        writer.node(mesh=splat_mesh(writer, positions, values, colorSpace=space))
    with pytest.raises(SceneError, match="several colour spaces"):
        load(writer)
