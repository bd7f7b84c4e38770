"""Meshes compressed by Draco: the same as uncompressed ones up to their quantization; damage ends in one line."""

from __future__ import annotations

import json
from contextlib import suppress

import DracoPy
import numpy as np
import pytest
import trimesh

from lippmann.errors import SceneError
from lippmann.scene.readers.gltf import draco
from lippmann.scene.readers.load import load_scene

NAME = "KHR_draco_mesh_compression"
#: Draco's numbers of the attributes, in the order in which its encoder takes them.
IDS = {"TEXCOORD_0": 1, "COLOR_0": 0, "POSITION": 2}


@pytest.fixture
def ball():
    mesh = trimesh.creation.icosphere(3, 2.0)
    uvs = np.stack([0.5 + mesh.vertices[:, 0] / 8, 0.5 + mesh.vertices[:, 1] / 8], axis=1)
    colors = np.uint8(np.clip(128 + 40 * mesh.vertices, 0, 255))
    return mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32), uvs, colors


def written(folder, ball, *, data=None, **changes):
    """A glTF file of two compressed meshes, with its buffer beside it."""
    points, faces, uvs, colors = ball
    if data is None:
        data = DracoPy.encode(points, faces=faces, tex_coord=uvs, colors=colors, quantization_bits=16)
    accessors = [
        {"componentType": 5126, "count": len(points), "type": "VEC3", "min": [-2] * 3, "max": [2] * 3},
        {"componentType": 5126, "count": len(points), "type": "VEC2"},
        {"componentType": 5121, "normalized": True, "count": len(points), "type": "VEC3"},
        {"componentType": 5125, "count": 3 * len(faces), "type": "SCALAR"},
    ]
    primitive = {
        "attributes": {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2},
        "indices": 3,
        "extensions": {NAME: {"bufferView": 0, "attributes": IDS}},
    }
    values = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [NAME],
        "extensionsRequired": [NAME],
        "buffers": [{"byteLength": len(data), "uri": "mesh.bin"}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "accessors": accessors,
        "meshes": [{"primitives": [primitive]}, {"primitives": [primitive]}],
        "nodes": [{"mesh": 0}, {"mesh": 1, "translation": [9, 0, 0]}],
        "scenes": [{"nodes": [0, 1]}],
    } | changes
    (folder / "mesh.bin").write_bytes(data)
    (folder / "mesh.gltf").write_text(json.dumps(values))
    return folder / "mesh.gltf"


@pytest.mark.slow
def test_it_is_the_mesh_that_was_compressed(tmp_path, ball):
    points, faces, uvs, colors = ball
    scene = load_scene(written(tmp_path, ball))
    assert scene.bounds == pytest.approx(np.array([[-2, -2, -2], [11, 2, 2]]), abs=1e-3)
    first = scene.description.meshes[0]
    assert len(first.faces) == len(faces)
    # The encoder orders vertices anew.
    own, order = (np.lexsort(np.round(each, 2).T) for each in (points, first.positions))
    assert first.positions[order] == pytest.approx(points[own], abs=1e-3)
    assert first.uvs[0][order] == pytest.approx(uvs[own], abs=1e-3)
    assert first.colors[order] == pytest.approx(colors[own] / 255, abs=1e-6)
    corners = first.positions[first.faces]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", outward, corners.mean(axis=1)) > 0).all()


def test_all_meshes_of_a_file_are_decoded_by_one_process(tmp_path, ball, monkeypatch):
    calls, run = [], draco.subprocess.run
    monkeypatch.setattr(draco.subprocess, "run", lambda *a, **k: calls.append(a) or run(*a, **k))
    load_scene(written(tmp_path, ball))
    assert len(calls) == 1


@pytest.mark.slow
@pytest.mark.parametrize("data", [b"DRACO" + bytes(90), b"nothing of Draco's"])
def test_damaged_data_is_one_line(tmp_path, ball, data):
    with pytest.raises(SceneError, match="is no mesh that Draco decodes") as caught:
        load_scene(written(tmp_path, ball, data=data))
    assert "\n" not in str(caught.value)


@pytest.mark.long
def test_cut_and_mutated_data_end_in_a_result_or_an_error(tmp_path, ball):
    points, faces, uvs, colors = ball
    good = DracoPy.encode(points, faces=faces, tex_coord=uvs, colors=colors)
    rng = np.random.default_rng(5)
    for _ in range(4):
        bad = bytearray(good)
        for place in rng.integers(11, len(bad), 6):
            bad[place] = rng.integers(256)
        with suppress(SceneError):
            load_scene(written(tmp_path, ball, data=bytes(bad)))


@pytest.mark.slow
def test_what_was_compressed_counts_where_accessors_say_other_counts(tmp_path, ball):
    points, faces, uvs, colors = ball
    fewer = DracoPy.encode(points, faces=faces[:-4], tex_coord=uvs, colors=colors)
    meshes = load_scene(written(tmp_path, ball, data=fewer)).description.meshes
    assert [len(mesh.faces) for mesh in meshes] == [len(faces) - 4] * len(meshes)


def test_a_decoder_that_dies_is_one_line(tmp_path, ball, monkeypatch):
    monkeypatch.setattr(draco, "_CODE", "import os; os.kill(os.getpid(), 11)")
    with pytest.raises(SceneError, match="the decoder of Draco ended with the exit status -11; "):
        load_scene(written(tmp_path, ball))
