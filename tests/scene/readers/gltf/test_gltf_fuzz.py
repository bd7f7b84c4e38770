"""Whatever is changed in a file, the answer is a sound scene or one line of refusal."""

from __future__ import annotations

import copy
import json
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lippmann.errors import SceneError
from lippmann.scene.readers.gltf import read_gltf

SETTINGS = settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)


def _rich(writer):
    """A scene with a bit of everything."""
    half = 0.5**0.5
    attributes = {
        "NORMAL": writer.accessor([[0, 0, 1]] * 4),
        "TEXCOORD_0": writer.accessor([[0, 0], [255, 0], [0, 255], [255, 255]], "u1", normalized=True),
        "COLOR_0": writer.accessor([[255, 0, 0, 255]] * 4, "u1", normalized=True),
        "JOINTS_0": writer.accessor([[0, 1, 0, 0]] * 4, "u1"),
        "WEIGHTS_0": writer.accessor([[0.5, 0.5, 0, 0]] * 4),
    }
    positions = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
    mesh = writer.mesh(
        positions,
        attributes=attributes,
        indices=writer.accessor([0, 1, 2, 2, 1, 3], "u2"),
        material=0,
        targets=[{"POSITION": writer.accessor([[0, 0, 1]] * 4)}],
    )
    writer.json["meshes"][mesh]["weights"] = [0.5]
    sparse = {
        "count": 1,
        "indices": {"bufferView": writer.view(b"\1\0"), "componentType": 5123},
        "values": {"bufferView": writer.view(np.array([1, 0, 0.5], "<f4").tobytes())},
    }
    writer.json["accessors"][writer.json["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"]]["sparse"] = sparse
    texture = writer.texture([[[255, 0, 0], [0, 255, 0]]], sampler=writer.add("samplers", wrapS=33071, magFilter=9728))
    info = {"index": texture, "extensions": {"KHR_texture_transform": {"offset": [0, 1], "rotation": 0.5}}}
    writer.add(
        "materials",
        pbrMetallicRoughness={"baseColorTexture": info, "metallicFactor": 0.5},
        normalTexture={"index": texture, "scale": 2},
        alphaMode="MASK",
        extensions={"KHR_materials_clearcoat": {"clearcoatFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 1}},
    )
    camera = writer.add("cameras", type="perspective", perspective={"yfov": 1, "znear": 0.1})
    writer.json["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}}
    writer.json["extensionsUsed"] = ["KHR_texture_transform", "KHR_lights_punctual"]
    bind = writer.accessor(np.tile(np.eye(4).reshape(16), (2, 1)))
    writer.add("skins", joints=[1, 2], inverseBindMatrices=bind)
    writer.node(children=[1, 2], translation=[0, 0, 1], rotation=[0, half, 0, half], scale=[1, 2, 3])
    writer.node(mesh=mesh, camera=camera, matrix=np.eye(4).reshape(16).tolist())
    writer.node(mesh=mesh, skin=0, extensions={"KHR_lights_punctual": {"light": 0}})
    instancing = {"attributes": {"TRANSLATION": writer.accessor([[0, 0, 1], [0, 0, 2]])}}
    writer.node(mesh=mesh, extensions={"EXT_mesh_gpu_instancing": instancing})
    for mode in (0, 2):
        thin = {
            "POSITION": writer.accessor([[0, 0, 2], [1, 0, 2], [0, 1, 2]]),
            "COLOR_0": writer.accessor([[1, 0, 0]] * 3),
        }
        indices = writer.accessor([0, 1, 2, 1], "u1")
        writer.node(mesh=writer.add("meshes", primitives=[{"attributes": thin, "mode": mode, "indices": indices}]))
    return writer


def _is_sound(path: Path) -> None:
    """Reads the file; a scene that comes out of it must hold together."""
    begin = time.thread_time()
    try:
        scene = read_gltf(path)
    except SceneError:
        return
    finally:
        assert time.thread_time() - begin < 2.0
    assert scene.instances
    for mesh in scene.meshes:
        count = len(mesh.positions)
        assert mesh.faces.shape[1] == 3
        assert (mesh.faces < count).all()
        assert np.isfinite(mesh.positions).all()
        assert 0 <= mesh.material < len(scene.materials)
        for values in (mesh.normals, mesh.colors, *mesh.uvs):
            assert values is None or (len(values) == count and np.isfinite(values).all())
    for instance in scene.instances:
        assert 0 <= instance.mesh < len(scene.meshes)
        assert np.isfinite(np.linalg.inv(instance.world_from_mesh)).all()
    for matrix in [c.world_from_camera for c in scene.cameras] + [x.world_from_light for x in scene.lights]:
        np.testing.assert_allclose(np.linalg.det(matrix), 1.0)


@pytest.fixture(scope="module")
def glb(writer_class) -> bytes:
    return _rich(writer_class()).glb()


@pytest.fixture(scope="module")
def original(writer_class):
    return json.loads(_rich(writer_class()).gltf())


def test_the_unchanged_scene_is_read(glb, read):
    scene = read(glb)
    assert (len(scene.meshes), len(scene.lights), len(scene.cameras)) == (4, 1, 1)
    assert sum(len(places) for places in scene.placements.values()) == 6
    assert [note.split(" are drawn")[0] for note in scene.notes] == ["points", "lines"]


@SETTINGS
@given(changes=st.lists(st.tuples(st.integers(0, 2**20), st.integers(0, 255)), min_size=1, max_size=4))
def test_changed_bytes(tmp_path, glb, changes):
    data = bytearray(glb)
    for place, value in changes:
        data[place % len(data)] = value
    (tmp_path / "changed.glb").write_bytes(data)
    _is_sound(tmp_path / "changed.glb")


@SETTINGS
@given(start=st.integers(0, 2**20), length=st.integers(1, 400), put=st.binary(max_size=40))
def test_bytes_cut_out_and_put_in(tmp_path, glb, start, length, put):
    data = bytearray(glb)
    start %= len(data)
    data[start : start + length] = put
    (tmp_path / "changed.glb").write_bytes(data)
    _is_sound(tmp_path / "changed.glb")


VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 12),
    st.sampled_from([2**31, 2**63, 10**25, 1e308, float("nan"), float("inf"), -1e-300, 0.5]),
    st.sampled_from(["", "SCALAR", "VEC3", "MAT4", "MASK", "data:;base64,AAAA", "../x.bin", "\0"]),
    st.sampled_from([[], {}, [[]], [0, 0, 0], [0] * 16, [1, 1, 1, 1], {"index": 0}]),
)


def _places(value, path=()):
    """Paths to all members of a JSON value."""
    members = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, member in members:
        yield (*path, key)
        yield from _places(member, (*path, key))


@settings(SETTINGS, max_examples=60)
@given(data=st.data())
def test_changed_json(tmp_path, original, data):
    value = copy.deepcopy(original)
    for _ in range(data.draw(st.integers(1, 3))):
        places = list(_places(value))
        path = data.draw(st.sampled_from(places))
        holder = value
        for key in path[:-1]:
            holder = holder[key]
        if data.draw(st.booleans()):
            holder[path[-1]] = copy.deepcopy(data.draw(VALUES))  # a later change must not reach into the strategy
        else:
            del holder[path[-1]]
    (tmp_path / "changed.gltf").write_text(json.dumps(value))
    _is_sound(tmp_path / "changed.gltf")


@pytest.mark.long
def test_every_member_replaced_by_every_kind_of_value(tmp_path, original):
    """The same, without chance: each member in turn becomes something else."""
    for path in _places(original):
        for put in (None, -1, 10**6, "x", []):
            value = copy.deepcopy(original)
            holder = value
            for key in path[:-1]:
                holder = holder[key]
            holder[path[-1]] = put
            (tmp_path / "changed.gltf").write_text(json.dumps(value))
            _is_sound(tmp_path / "changed.gltf")
