"""Animations of glTF files: values between keys, and what moves with them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.errors import SceneError
from lippmann.scene.readers.gltf_animation.animated_file import MovingGltf
from lippmann.scene.readers.gltf_animation.keyframes import Sampler

HALF = np.sqrt(0.5)


def sampler(times, values, interpolation="LINEAR", turning=False):
    return Sampler(np.array(times, float), np.array(values, float), interpolation, turning)


def test_linear_values_lie_between_their_keys():
    found = sampler([1, 3], [[0, 10], [4, 20]])
    assert found.at(1.5) == pytest.approx([1, 12.5])
    assert found.at(0) == pytest.approx([0, 10])
    assert found.at(9) == pytest.approx([4, 20])


def test_steps_hold_until_the_next_key():
    found = sampler([0, 1, 2], [[5], [6], [7]], "STEP")
    assert [float(found.at(t)[0]) for t in (0, 0.999, 1, 1.5, 2, 3)] == [5, 5, 6, 6, 7, 7]


def test_cubic_splines_follow_their_tangents():
    """x^3 has the slopes 0 and 12 at 0 and 2, and a spline of its values and slopes is x^3."""
    found = sampler([0, 2], [[[9], [0], [0]], [[12], [8], [9]]], "CUBICSPLINE")
    for x in (0, 0.3, 1, 1.7, 2):
        assert found.at(x)[0] == pytest.approx(x**3)


def test_rotations_go_along_the_arc():
    found = sampler([0, 1], [[0, 0, 0, 1], [0, HALF, 0, HALF]], turning=True)
    third = found.at(1 / 3)
    assert third == pytest.approx([0, np.sin(np.pi / 12), 0, np.cos(np.pi / 12)])


def test_rotations_take_the_shorter_way():
    near = np.array([0, np.sin(0.2), 0, np.cos(0.2)])
    found = sampler([0, 1], [[0, 0, 0, 1], -near], turning=True)
    assert abs(found.at(0.5) @ [0, np.sin(0.1), 0, np.cos(0.1)]) == pytest.approx(1)


quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)


@settings(max_examples=30, deadline=None)
@given(before=quaternions, after=quaternions, share=st.floats(0, 1))
def test_rotations_keep_unit_length(before, after, share):
    found = sampler([0, 1], [before, after], turning=True).at(share)
    assert np.linalg.norm(found) == pytest.approx(1)


@settings(max_examples=30, deadline=None)
@given(times=st.lists(st.floats(0, 100), min_size=2, max_size=6, unique=True), share=st.floats(0, 1))
def test_linear_keys_are_met_and_nothing_overshoots(times, share):
    times = sorted(times)
    values = [[float(number**2)] for number in range(len(times))]
    found = sampler(times, values)
    for time, value in zip(times, values, strict=True):
        assert found.at(time) == pytest.approx(value)
    assert 0 <= found.at(times[0] + share * (times[-1] - times[0]))[0] <= values[-1][0] + 1e-9


def animated(writer, path, times, values, interpolation="LINEAR", dtype="f4", **accessor):
    """One triangle on a moving node, below a node that stands still."""
    child = writer.node(mesh=writer.mesh())
    writer.node(children=[child], translation=[0, 0, 5])
    sampled = {"input": writer.accessor(np.array(times)), "output": writer.accessor(values, dtype, **accessor)}
    writer.add(
        "animations",
        name="move",
        samplers=[{**sampled, "interpolation": interpolation}],
        channels=[{"sampler": 0, "target": {"node": child, "path": path}}],
    )
    return writer


@pytest.fixture
def moving(tmp_path):
    def open_it(writer, **options):
        path = tmp_path / "moving.glb"
        path.write_bytes(writer.glb())
        return MovingGltf(path, **options)

    return open_it


def test_nodes_move(writer, moving, world_points):
    scene = moving(animated(writer, "translation", [0, 2], [[0, 0, 0], [4, 0, 0]]))
    assert scene.duration == 2
    assert world_points(scene.at(0))[0] == pytest.approx([0, 0, 5])
    assert world_points(scene.at(1))[0] == pytest.approx([2, 0, 5])
    assert world_points(scene.at(0.5))[0] == pytest.approx([1, 0, 5])


def test_nodes_turn_by_normalised_integers(writer, moving, world_points):
    turn = [[0, 0, 0, 32767], [0, 0, 23170, 23170]]
    scene = moving(animated(writer, "rotation", [0, 1], turn, dtype="i2", normalized=True))
    assert world_points(scene.at(1))[1] == pytest.approx([0, 1, 5], abs=1e-3)


def test_nodes_grow(writer, moving, world_points):
    scene = moving(animated(writer, "scale", [0, 1], [[1, 1, 1], [3, 1, 1]], "STEP"))
    assert world_points(scene.at(0.9))[1] == pytest.approx([1, 0, 5])
    assert world_points(scene.at(1))[1] == pytest.approx([3, 0, 5])


def test_morph_weights_change_shapes(writer, moving, world_points):
    change = writer.accessor([[0, 0, 1]] * 3)
    mesh = writer.mesh(targets=[{"POSITION": change}])
    node = writer.node(mesh=mesh)
    times, weights = writer.accessor(np.array([0.0, 1.0])), writer.accessor(np.array([0.0, 2.0]))
    writer.add(
        "animations",
        samplers=[{"input": times, "output": weights}],
        channels=[{"sampler": 0, "target": {"node": node, "path": "weights"}}],
    )
    scene = moving(writer)
    assert world_points(scene.at(0))[:, 2] == pytest.approx([0] * 3)
    assert world_points(scene.at(0.5))[:, 2] == pytest.approx([1] * 3)
    assert world_points(scene.at(0))[:, 2] == pytest.approx([0] * 3)


def test_joints_carry_the_mesh_that_they_hold(writer, moving, world_points):
    joint = writer.node(translation=[0, 0, 0])
    attributes = {
        "JOINTS_0": writer.accessor([[0, 0, 0, 0]] * 3, "u1"),
        "WEIGHTS_0": writer.accessor([[1, 0, 0, 0]] * 3),
    }
    skin = writer.add("skins", joints=[joint])
    writer.node(mesh=writer.mesh(attributes=attributes), skin=skin)
    times, places = writer.accessor(np.array([0.0, 1.0])), writer.accessor([[0, 0, 0], [0, 8, 0]])
    writer.add(
        "animations",
        samplers=[{"input": times, "output": places}],
        channels=[{"sampler": 0, "target": {"node": joint, "path": "translation"}}],
    )
    scene = moving(writer)
    assert world_points(scene.at(0.25))[0] == pytest.approx([0, 2, 0])
    assert world_points(scene.at(1))[0] == pytest.approx([0, 8, 0])


def test_what_stays_the_same_is_kept(writer, moving):
    scene = moving(animated(writer, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]]))
    first, second = scene.at(0), scene.at(1)
    assert first.meshes[0].positions is second.meshes[0].positions
    assert first.materials == second.materials


def test_points_do_not_grow_with_the_scene(writer, moving):
    animated(writer, "translation", [0, 1], [[0, 0, 0], [0, 8, 0]])
    writer.node(mesh=writer.mesh(mode=0))
    found = moving(writer)
    before, after = found.at(0.0), found.at(1.0)
    np.testing.assert_array_equal(after.meshes[1].positions, before.meshes[1].positions)
    # Whoever renders the last time first gets the same.
    np.testing.assert_array_equal(moving(writer).at(1.0).meshes[1].positions, before.meshes[1].positions)
    assert after.notes == before.notes
    assert after.notes[-1].startswith("points are drawn as balls")


def test_the_first_animation_is_played_unless_another_is_named(writer, moving):
    animated(writer, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    writer.json["animations"].append({**writer.json["animations"][0], "name": "other"})
    scene = moving(writer)
    assert scene.animation.name == "move"
    assert "of 2 animations 'move' is played" in scene.at(0).notes
    assert moving(writer, animation="other").animation.name == "other"
    with pytest.raises(SceneError, match=r"unknown animation 'othre', did you mean 'other'"):
        moving(writer, animation="othre")


@pytest.mark.parametrize(
    ("times", "at_two"),
    [
        ([0, 2, 2, 4], 6.0),  # it jumps
        ([4, 0, 2, 3], 6.0),
        ([-2, 0, 1, 3], 7.0),
        ([-4, -3, -2, -1], 8.0),
    ],
)
def test_keys_are_followed_in_the_order_of_their_times(writer, moving, world_points, times, at_two):
    scene = moving(animated(writer, "translation", times, [[0, 0, 0], [2, 0, 0], [6, 0, 0], [8, 0, 0]]))
    assert world_points(scene.at(2))[0, 0] == pytest.approx(at_two)
    assert scene.duration == max(0, *times)
    assert any("do not rise" in note for note in scene.at(0).notes) == (sorted(set(times)) != times)


def test_pointers_to_nodes_move_them(writer, moving, world_points):
    animated(writer, "translation", [0, 1], [[0, 0, 0], [4, 0, 0]])
    channel = writer.json["animations"][0]["channels"][0]
    pointer = f"/nodes/{channel['target']['node']}/translation"
    channel["target"] = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}
    writer.json["extensionsUsed"] = ["KHR_animation_pointer"]
    scene = moving(writer)
    assert not any("followed" in note for note in scene.at(0).notes)
    assert world_points(scene.at(0.5))[0, 0] - world_points(scene.at(0))[0, 0] == pytest.approx(2)
    channel["target"]["extensions"]["KHR_animation_pointer"]["pointer"] = "/nodes/9/translation"
    with pytest.raises(SceneError, match="there are 2 nodes"):
        moving(writer)


def test_what_cannot_be_followed_is_said(writer, moving):
    animated(writer, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    pointer = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/materials/0/alphaCutoff"}}}
    writer.json["animations"][0]["channels"].append({"sampler": 0, "target": pointer})
    assert any("anything but nodes and weights" in note for note in moving(writer).at(0).notes)


def test_no_animation(writer, moving):
    with pytest.raises(SceneError, match=r"the file has no animation; leave frames=\.\.\. out"):
        moving(writer.triangle())


def break_(writer, **changes):
    sampled, channel = writer.json["animations"][0]["samplers"][0], writer.json["animations"][0]["channels"][0]
    for key, value in changes.items():
        place = channel if key == "sampler" else channel["target"] if key in ("node", "path") else sampled
        place[key] = value


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"interpolation": "SPLINE"}, "LINEAR, STEP, CUBICSPLINE belongs here"),
        ({"sampler": 3}, "there are 1 samplers"),
        ({"node": 9}, "there are 2 nodes"),
        ({"path": "color"}, "translation, rotation, scale, weights belongs here"),
        ({"input": 99}, "accessors, counted from 0"),
        ({"interpolation": "CUBICSPLINE"}, "2 keys of CUBICSPLINE need 6 values"),
        ({"path": "rotation"}, "VEC4 belongs here"),
    ],
)
def test_broken_animations_are_refused(writer, moving, changes, message):
    animated(writer, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    break_(writer, **changes)
    with pytest.raises(SceneError, match=message):
        moving(writer)


@pytest.mark.parametrize(
    ("times", "values", "path", "message"),
    [
        ([0, float("nan")], [[0, 0, 0], [1, 0, 0]], "translation", "times must be finite"),
        ([0, 1], [[0, 0, 0], [np.inf, 0, 0]], "translation", "must be finite"),
        ([0, 1], [[0, 0, 0, 1], [0, 0, 0, 0]], "rotation", "length 0"),
    ],
)
def test_bad_keys_are_refused(writer, moving, times, values, path, message):
    with pytest.raises(SceneError, match=message):
        moving(animated(writer, path, times, values))


def test_a_node_with_a_matrix_cannot_be_animated(writer, moving):
    animated(writer, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    writer.json["nodes"][0]["matrix"] = np.eye(4).ravel().tolist()
    with pytest.raises(SceneError, match="has a matrix, which cannot be animated"):
        moving(writer)


def test_two_channels_of_one_thing_are_refused(writer, moving):
    animated(writer, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    channels = writer.json["animations"][0]["channels"]
    channels.append(channels[0])
    with pytest.raises(SceneError, match="another channel moves the translation"):
        moving(writer)
