"""Coordinates far from the origin, as surveys write them."""

import base64
import itertools
import json
import struct

import numpy as np
import pytest

from lippmann.scene.parsing.far_origin import make_traceable, near_origin
from lippmann.scene.readers.load import load_scene
from lippmann.scene.values.description import Camera, Instance, Light, Material, Mesh, SceneDescription

UTM = np.array([450_000.0, 5_400_000.0, 312.0])
CORNERS = np.array([(0, 0, 0), (0.1, 0, 0), (0, 0.2, 0), (0, 0, 0.3)])
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def obj(places):
    lines = ["v " + " ".join(map(repr, place)) for place in places.tolist()]
    return "\n".join(lines + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES]).encode()


def ply(places, faces=FACES):
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(places)}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    return head.encode() + places.astype("<f8").tobytes() + b"".join(struct.pack("<B3i", 3, *face) for face in faces)


def stl(places):
    facets = [
        "facet\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in places[[*face]]) + "endfacet\n" for face in FACES
    ]
    return ("solid a\n" + "".join(facets) + "endsolid a\n").encode()


@pytest.mark.parametrize(("ending", "write"), [("obj", obj), ("ply", ply), ("stl", stl)])
def test_a_model_in_coordinates_of_a_survey_keeps_its_shape(tmp_path, ending, write):
    (tmp_path / f"here.{ending}").write_bytes(write(CORNERS))
    (tmp_path / f"far.{ending}").write_bytes(write(CORNERS + UTM))
    here, far = (load_scene(tmp_path / f"{name}.{ending}") for name in ("here", "far"))
    sizes = [scene.bounds[1] - scene.bounds[0] for scene in (here, far)]
    assert sizes[1] == pytest.approx(sizes[0], rel=1e-5)
    assert np.abs(far.bounds).max() < 1
    assert not any("moved by" in note for note in here.notes)
    assert any(note.startswith("moved by -45") for note in far.notes)


def test_a_cloud_of_points_with_strays_is_moved(tmp_path):
    rng = np.random.default_rng(0)
    places = np.concatenate([rng.uniform(-1, 1, (50, 3)) + UTM, np.zeros((1, 3))])
    (tmp_path / "a.ply").write_bytes(ply(places, []))
    scene = load_scene(tmp_path / "a.ply")
    balls = scene.description.meshes[0]
    middles = balls.positions.reshape(-1, balls.points, 3).mean(axis=1)
    assert middles == pytest.approx(places[:50] - np.round(np.median(places, axis=0)), abs=1e-5)
    assert "moved by -450000, -5400000, -312: so far from the origin its shape would be rounded" in scene.notes


def test_vtks_surfaces_are_moved(tmp_path):
    pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed")
    pyvista.PolyData(CORNERS + UTM, faces=np.hstack([(3, *face) for face in FACES])).save(tmp_path / "a.vtp")
    low, high = load_scene(tmp_path / "a.vtp").bounds
    assert high - low == pytest.approx(np.array([0.1, 0.2, 0.3]), rel=1e-5)


@pytest.mark.parametrize("far", [0, 1])
def test_meshes_that_their_placements_put_far_away_move_with_their_lights_and_cameras(tmp_path, far):
    offset = far * UTM
    matrix = np.eye(4)
    matrix[:3, 3] = offset + 0.25
    placed = {"matrix": matrix.T.ravel().tolist()}
    data = CORNERS.astype("<f4").tobytes() + np.array(FACES, "<u4").tobytes()
    views = [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 48}]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [0.1, 0.2, 0.3]},
        {"bufferView": 1, "componentType": 5125, "count": 12, "type": "SCALAR"},
    ]
    lights = {"KHR_lights_punctual": {"lights": [{"type": "point"}]}}
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 96, "uri": "data:;base64," + base64.b64encode(data).decode()}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        "extensions": lights,
        "extensionsUsed": [*lights],
        "nodes": [
            {"mesh": 0, **placed},
            {"camera": 0, **placed},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}, **placed},
        ],
        "scenes": [{"nodes": [0, 1, 2]}],
        "scene": 0,
    }
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    loaded = load_scene(tmp_path / "a.gltf")
    scene, (low, high) = loaded.description, loaded.bounds
    assert high - low == pytest.approx(np.array([0.1, 0.2, 0.3]), rel=1e-5)
    assert np.abs(low).max() < 1
    for matrix in (scene.cameras[0].world_from_camera, scene.lights[0].world_from_light):
        assert matrix[:3, 3] == pytest.approx(low, abs=1e-6)
    assert any("its shape would be rounded" in note for note in scene.notes) == bool(far)


@pytest.mark.parametrize(
    "places",
    [
        np.empty((0, 3)),
        np.ones((4, 3)),  # without extent
        CORNERS + 5,
        np.array([(np.inf, 0, 0), (np.nan, 1, 0), (0, 0, 1)]),
        CORNERS[:1] + UTM,
    ],
)
def test_others_stay(places):
    notes = []
    assert near_origin(places, notes) is places
    assert notes == []


def test_an_animation_far_away_is_moved_by_the_same_at_all_times(tmp_path):
    from lippmann.sequences.motion import AnimatedFile

    way = np.array([UTM, UTM + np.array([2.0, 0.0, 0.0])])
    parts = [CORNERS.astype("<f4"), np.array(FACES, "<u4"), np.array([0, 1], "<f4"), way.astype("<f4")]
    kinds = [(5126, 4, "VEC3"), (5125, 12, "SCALAR"), (5126, 2, "SCALAR"), (5126, 2, "VEC3")]
    starts = np.cumsum([0, *(part.nbytes for part in parts)]).tolist()
    data = base64.b64encode(b"".join(part.tobytes() for part in parts)).decode()
    accessors = [
        {"bufferView": number, "componentType": kind, "count": count, "type": shape}
        for number, (kind, count, shape) in enumerate(kinds)
    ]
    accessors[0] |= {"min": [0, 0, 0], "max": [0.1, 0.2, 0.3]}
    accessors[2] |= {"min": [0], "max": [1]}
    views = [{"buffer": 0, "byteOffset": a, "byteLength": b - a} for a, b in itertools.pairwise(starts)]
    channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": starts[-1], "uri": f"data:;base64,{data}"}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "animations": [{"samplers": [{"input": 2, "output": 3}], "channels": [channel]}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    motion = AnimatedFile(tmp_path / "a.gltf", fps=1)
    first, last = (motion.scene(frame).bounds for frame in (0, 1))
    assert np.abs(first).max() < 1
    assert last - first == pytest.approx(np.array([[2.0, 0.0, 0.0]] * 2), abs=1e-5)
    assert any("its shape would be rounded" in note for note in motion.scene(0).notes)


def lit_corner(unit):
    """A corner 6 units wide with a camera and lights; the same light in every unit of length."""

    def pose(*place):
        matrix = np.eye(4)
        matrix[:3, 3] = np.array(place) * unit
        return matrix

    return SceneDescription(
        "corner",
        [Mesh("corner", (np.array(CORNERS) / 0.3 * 6 * unit).astype(np.float32), np.array(FACES, np.uint32), 0)],
        [Material(attenuation_distance=3 * unit), Material()],
        [Instance(0, np.eye(4))],
        [
            Light("point", (1.0 * unit**2, 2.0 * unit**2, 3.0 * unit**2), pose(0, 4, 0), radius=0.5 * unit),
            Light("directional", (5.0, 5.0, 5.0), pose(0, 0, 1)),
        ],
        [Camera("eye", pose(1, 2, 6), height=3 * unit, focus_distance=6 * unit)],
    )


@pytest.mark.parametrize("unit", [1e-12, 1e-3, 1e12])
def test_a_scene_of_a_unit_that_cannot_be_traced_is_scaled_with_its_light_and_cameras(unit):
    plain, scaled = lit_corner(1.0), make_traceable(lit_corner(unit))
    assert make_traceable(plain) is plain
    (camera,) = scaled.cameras
    point, sun = scaled.lights
    world = scaled.instances[0].world_from_mesh[:3, :3] @ scaled.meshes[0].positions.T.astype(np.float64)
    assert np.ptp(world, axis=1) == pytest.approx(np.ptp(plain.meshes[0].positions, axis=0), rel=1e-5)
    assert camera.world_from_camera == pytest.approx(plain.cameras[0].world_from_camera)
    assert (camera.height, camera.focus_distance) == pytest.approx((3, 6))
    assert point.world_from_light == pytest.approx(plain.lights[0].world_from_light)
    assert (*point.color, point.radius) == pytest.approx((1, 2, 3, 0.5))
    assert sun.color == (5, 5, 5)
    assert [each.attenuation_distance for each in scaled.materials] == pytest.approx([3, np.inf])
    assert scaled.notes[-1] == f"scaled by {1 / unit:g}: single precision does not trace a scene of its size"
