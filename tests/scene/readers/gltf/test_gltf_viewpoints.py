"""Cameras and light sources."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lippmann.errors import SceneError

PERSPECTIVE = {"yfov": 0.8, "znear": 0.1}


def _camera(writer, read, node=None, **camera):
    writer.triangle().node(camera=writer.add("cameras", **camera), **(node or {}))
    return read(writer).cameras[0]


def test_perspective_without_end(writer, read):
    camera = _camera(writer, read, name="eye", type="perspective", perspective=PERSPECTIVE)
    assert (camera.name, camera.fov_y, camera.height) == ("eye", 0.8, None)
    assert (camera.aspect, camera.focus_distance) == (None, None)


def test_perspective_with_aspect_and_far_plane(writer, read):
    lens = {**PERSPECTIVE, "aspectRatio": 1.5, "zfar": 100}
    camera = _camera(writer, read, node={"name": "left eye"}, name="eye", type="perspective", perspective=lens)
    assert (camera.name, camera.aspect) == ("left eye", 1.5)


def test_orthographic_magnifications_are_half_extents(writer, read):
    lens = {"xmag": 3, "ymag": -2, "znear": 0, "zfar": 10}
    camera = _camera(writer, read, type="orthographic", orthographic=lens)
    assert (camera.fov_y, camera.height, camera.aspect) == (None, 4.0, 1.5)


@pytest.mark.parametrize("holder", ["camera", "node"])
def test_focus_distance_in_extras(writer, read, holder):
    extras = {"extras": {"focus_distance": 2.5}}
    camera = extras if holder == "camera" else {}
    node = extras if holder == "node" else {}
    assert _camera(writer, read, node, type="perspective", perspective=PERSPECTIVE, **camera).focus_distance == 2.5


@pytest.mark.parametrize(
    "extras",
    [
        {"lens_shift": [1.0]},
        {"lens_shift": ["a", 2.0]},
        {"focus_distance": "far"},
        {"focus_distance": -1},
        {"focus_distance": True},
        [1],
        7,
    ],
)
def test_foreign_extras_are_left_alone(writer, read, extras):
    camera = _camera(writer, read, type="perspective", perspective=PERSPECTIVE, extras=extras)
    assert (camera.focus_distance, camera.shift) == (None, (0.0, 0.0))


def test_a_camera_stands_where_its_node_does_without_its_scale(writer, read):
    mesh = writer.mesh()
    half = 0.5**0.5
    writer.node(mesh=mesh, children=[1], scale=[5, 5, 5], translation=[0, 0, 1])
    camera = writer.add("cameras", type="perspective", perspective=PERSPECTIVE)
    writer.node(camera=camera, translation=[2, 0, 0], rotation=[0, half, 0, half])
    matrix = read(writer).cameras[0].world_from_camera
    np.testing.assert_allclose(matrix[:3, 3], [10, 0, 1])
    np.testing.assert_allclose(-matrix[:3, 2], [-1, 0, 0], atol=1e-12)  # a quarter turn about y: it looks along -x
    np.testing.assert_allclose(matrix[:3, 1], [0, 1, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"type": "fisheye"}, 'cameras[0].type is "fisheye"'),
        ({"type": "perspective"}, "perspective or orthographic"),
        ({"type": None}, "cameras[0].type is missing"),
        ({"type": "perspective", "perspective": {"znear": 1}}, "yfov is missing"),
        ({"type": "perspective", "perspective": {"yfov": 3.15}}, "between 0 and pi"),
        ({"type": "perspective", "perspective": {"yfov": 1, "aspectRatio": 0}}, "above 0"),
        ({"type": "orthographic", "orthographic": {"xmag": 0, "ymag": 1}}, "xmag is 0"),
        ({"type": "orthographic", "orthographic": {"xmag": 1}}, "ymag is missing"),
    ],
)
def test_bad_cameras_are_refused(writer, read, values, words):
    with pytest.raises(SceneError) as caught:
        _camera(writer, read, **values)
    assert words in str(caught.value)


def _light(writer, read, node=None, **light):
    writer.json["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
    writer.triangle().node(extensions={"KHR_lights_punctual": {"light": 0}}, **(node or {}))
    return read(writer).lights[0]


def test_point_light(writer, read):
    light = _light(
        writer, read, {"translation": [1, 2, 3]}, type="point", color=[1, 0.5, 0.25], intensity=40, name="bulb"
    )
    assert (light.kind, light.color, light.name, light.radius) == ("point", (40, 20, 10), "bulb", 0.0)
    np.testing.assert_array_equal(light.world_from_light[:3, 3], [1, 2, 3])


def test_light_defaults(writer, read):
    light = _light(writer, read, type="spot")
    assert (light.color, light.inner_angle, light.outer_angle) == ((1, 1, 1), 0.0, math.pi / 4)


def test_a_range_is_noted(writer, read):
    _light(writer, read, type="point", range=5.0)
    assert "light falls with the square of the distance, beyond its range, too (extensions" in read(writer).notes[0]


def test_spot_of_a_right_angle_in_single_precision(writer, read):
    cone = {"innerConeAngle": 0.3, "outerConeAngle": float(np.float32(np.pi / 2))}
    light = _light(writer, read, type="spot", spot=cone)
    assert (light.inner_angle, light.outer_angle) == (0.3, math.pi / 2)


def test_directional_light_turns_with_its_node(writer, read):
    half = 0.5**0.5
    light = _light(writer, read, {"rotation": [-half, 0, 0, half], "scale": [3, 3, 3]}, type="directional", intensity=2)
    assert (light.kind, light.color) == ("directional", (2, 2, 2))
    np.testing.assert_allclose(-light.world_from_light[:3, 2], [0, -1, 0], atol=1e-12)  # straight down


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"type": "area"}, "point, spot or directional"),
        ({}, "type is missing"),
        ({"type": "point", "intensity": -1}, "at least 0"),
        ({"type": "point", "color": [1, -1, 0]}, "not be negative"),
        ({"type": "spot", "spot": {"outerConeAngle": 0}}, "from 0.001"),
        ({"type": "spot", "spot": {"outerConeAngle": 2}}, "from 0.001"),
    ],
)
def test_bad_lights_are_refused(writer, read, values, words):
    with pytest.raises(SceneError) as caught:
        _light(writer, read, **values)
    assert words in str(caught.value)


def test_a_light_that_does_not_exist_is_refused(writer, read):
    writer.triangle().node(extensions={"KHR_lights_punctual": {"light": 0}})
    with pytest.raises(SceneError, match="there are 0 lights"):
        read(writer)
