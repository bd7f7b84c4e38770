"""What is added to the glTF file that Blender's exporter wrote: lights, focus, metres."""

import json
import math
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.scene.extent import bounds_of, extreme_points_of
from lippmann.scene.readers.blend.in_blender.additions import (
    add_default_material,
    add_focus,
    add_indices,
    add_interiors,
    add_lights,
    leave_out,
    leave_out_unseen,
    scale_to_metres,
    set_frames,
)
from lippmann.scene.readers.blend.in_blender.glb import Glb
from lippmann.scene.readers.gltf import read_gltf

SIZES = st.floats(0.01, 100.0)
COLORS = st.tuples(*[st.floats(0.0, 1.0)] * 3).filter(lambda color: max(color) > 0.01)


def document(*names):
    """A triangle, and nodes of these names with a light of the exporter's."""
    data = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    light = {"KHR_lights_punctual": {"light": 0}}
    root = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(names) + 1))}],
        "nodes": [{"mesh": 0, "name": "mesh"}, *({"name": name, "extensions": dict(light)} for name in names)],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensionsRequired": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 99.0}]}},
    }
    return Glb(root, bytearray(data))


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    folder = tmp_path_factory.mktemp("glb")

    def through_a_file(glb):
        glb.write(folder / "a.glb")
        content = (folder / "a.glb").read_bytes()
        assert struct.unpack("<4sII", content[:12]) == (b"glTF", 2, len(content))
        assert Glb.read(folder / "a.glb").root == json.loads(json.dumps(glb.root))
        return read_gltf(folder / "a.glb")

    return through_a_file


@settings(max_examples=25)
@given(width=SIZES, height=SIZES, color=COLORS, strength=st.floats(1e-3, 1e6), is_round=st.booleans(), unit=SIZES)
def test_area_lights_keep_radiance_and_area(read, width, height, color, strength, is_round, unit):
    glb = document("A")
    described = {"kind": "area", "color": color, "strength": strength}
    add_lights(glb, {"A": {**described, "width": width, "height": height, "is_round": is_round}}, unit)
    description = read(glb)
    assert not description.lights
    index = next(index for index, mesh in enumerate(description.meshes) if mesh.name == "A")
    mesh = description.meshes[index]
    material = description.materials[mesh.material]
    assert material.emission == pytest.approx(np.array(color) * strength, rel=1e-5)
    assert (material.base_color, material.specular, material.double_sided) == ((0.0, 0.0, 0.0), 0.0, False)
    corners = mesh.positions[mesh.faces].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(normals[:, 2] < 0.0)  # it shines along -z
    assert bounds_of(description).tolist() == [[0, 0, 0], [1, 1, 0]]  # of the triangle alone
    area = width * height * (math.pi / 4.0 if is_round else 1.0)
    assert -normals[:, 2].sum() / 2.0 == pytest.approx(area, rel=1e-4)


@settings(max_examples=25)
@given(color=COLORS, strength=st.floats(1e-3, 1e6), unit=SIZES)
def test_irradiance_is_the_same_in_metres(read, color, strength, unit):
    glb = document("P", "S")
    lights = {
        "P": {"kind": "point", "color": color, "strength": strength},
        "S": {"kind": "directional", "color": color, "strength": strength},
    }
    add_lights(glb, lights, unit)
    glb.root["nodes"][1]["translation"] = [0.0, 2.0, 0.0]
    scale_to_metres(glb, unit)
    point, sun = read(glb).lights
    distance = point.world_from_light[1, 3]
    assert distance == pytest.approx(2.0 * unit)
    assert np.array(point.color) / distance**2 == pytest.approx(np.array(color) * strength / 4.0, rel=1e-5)
    assert sun.color == pytest.approx(np.array(color) * strength, rel=1e-5)


def test_a_light_alone_is_fitted(read):
    glb = document("A")
    del glb.root["nodes"][0]["mesh"]
    area = {"kind": "area", "color": (1, 1, 1), "strength": 1.0, "width": 4.0, "height": 2.0, "is_round": False}
    add_lights(glb, {"A": area}, 1.0)
    assert np.ptp(extreme_points_of(read(glb)), axis=0).tolist() == [4.0, 2.0, 0.0]


def test_lights_that_are_not_described_are_gone():
    glb = document("A", "B")
    add_lights(glb, {"mesh": {"kind": "point", "color": (1, 1, 1), "strength": 1.0}}, 1.0)
    assert "KHR_lights_punctual" not in json.dumps(glb.root)


def test_a_spot_has_its_cone(read):
    glb = document("C")
    add_lights(glb, {"C": {"kind": "spot", "color": (1, 1, 1), "strength": 2.0, "inner": 0.2, "outer": 0.4}}, 1.0)
    (cone,) = read(glb).lights
    assert (cone.kind, cone.inner_angle, cone.outer_angle) == ("spot", pytest.approx(0.2), pytest.approx(0.4))


def test_focus(read):
    glb = document("L")
    lens = {"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}
    camera = glb.append("cameras", lens)
    for name in ("near", "far"):
        glb.root["scenes"][0]["nodes"].append(glb.append("nodes", {"name": name, "camera": camera}))
    add_focus(glb, {"near": 3.0, "mesh": 4.0}, 0.5)
    assert [each.focus_distance for each in read(glb).cameras] == [1.5, None]


def test_what_is_put_aside_loses_its_mesh_but_not_below_what_shows_it(read):
    glb = document("A", "Copy", "B")
    nodes = glb.root["nodes"]
    for node in nodes[1:]:
        node.pop("extensions")
    nodes[1] |= {"mesh": 0, "children": [3]}
    nodes[3] |= {"mesh": 0, "translation": [5.0, 0.0, 0.0]}
    nodes[2]["children"] = [glb.append("nodes", {"name": "A", "mesh": 0, "translation": [0.0, 7.0, 0.0]})]
    glb.root["scenes"][0]["nodes"] = [0, 1, 2]
    leave_out(glb, {"A"}, {"Copy"})
    (places,) = read(glb).placements.values()
    assert sorted(place[:3, 3].tolist() for place in places) == [[0, 0, 0], [0, 7, 0], [5, 0, 0]]


@pytest.mark.parametrize(("kind", "shift"), [("perspective", (0.25, -0.5)), ("orthographic", (2.5, -5.0))])
def test_frames_are_slopes_or_lengths(read, kind, shift):
    glb = document("Camera")
    lens = {"perspective": {"yfov": 1.0}} if kind == "perspective" else {"orthographic": {"xmag": 1.0, "ymag": 1.0}}
    glb.root["cameras"] = [{"type": kind, **lens}]
    glb.root["nodes"][1] = {"name": "Camera", "camera": 0}
    set_frames(glb, {"Camera": (0.25, -0.5, 0.6, 0.4), "other": (9.0, 9.0, 1.0, 1.0)}, 10.0)
    (camera,) = read(glb).cameras
    assert camera.shift == shift
    assert camera.aspect == pytest.approx(1.5)
    assert (camera.height if camera.fov_y is None else np.tan(camera.fov_y / 2)) == pytest.approx(
        8.0 if camera.fov_y is None else 0.4
    )


def test_faces_without_a_material_are_of_a_dull_grey(read):
    glb = document("A")
    for part in glb.root["meshes"][0]["primitives"]:
        part.pop("material", None)
    add_default_material(glb)
    (material,) = read(glb).materials
    assert (material.base_color, material.metallic, material.roughness) == ((0.8, 0.8, 0.8), 0.0, 1.0)


def test_glass_is_solid_but_for_materials_that_say_otherwise(read):
    glb = document("A")
    glass = {"KHR_materials_transmission": {"transmissionFactor": 1.0}}
    deep = {**glass, "KHR_materials_volume": {"thicknessFactor": 0.0}}
    glb.root["materials"] = [{}, {"extensions": {**glass}}, {"extensions": deep}]
    part = glb.root["meshes"][0]["primitives"][0]
    glb.root["meshes"][0]["primitives"] = [{**part, "material": index} for index in range(3)]
    add_interiors(glb)
    assert [material.thickness for material in read(glb).materials] == [0.0, 1.0, 0.0]


def test_indices_of_refraction_that_the_exporter_leaves_out(read):
    glb = document("A")
    told = {"KHR_materials_ior": {"ior": 1.1}}
    glb.root["materials"] = [{"name": "water"}, {"name": "plain"}, {"name": "ice", "extensions": told}]
    part = glb.root["meshes"][0]["primitives"][0]
    glb.root["meshes"][0]["primitives"] = [{**part, "material": index} for index in range(3)]
    add_indices(glb, {"water": 1.33, "plain": 1.5, "ice": 1.3})
    assert [material.ior for material in read(glb).materials] == [1.33, 1.5, 1.1]


def test_what_cameras_do_not_see_is_left_out_unless_it_glows(read):
    glb, notes = document("A", "B"), []
    mesh = glb.root["meshes"][0]
    glowing = glb.append("materials", {"emissiveFactor": [1, 1, 1]})
    parts = [{**part, "material": glowing} for part in mesh["primitives"]]
    for node in glb.root["nodes"][1:]:
        node.pop("extensions")
        node["mesh"] = 0 if node["name"] == "A" else glb.append("meshes", {"primitives": parts})
    leave_out_unseen(glb, {"A", "B"}, notes.append)
    assert notes == [
        "object 'A': cameras do not see it: it is left out, and so are its shadows",
        "object 'B': cameras do not see it in Blender; it glows, and is shown",
    ]
    assert [node["name"] for node in glb.root["nodes"] if "mesh" in node][-1] == "B"
