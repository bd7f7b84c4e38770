"""The plain values of classic scenes and the builder that collects them."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.errors import SceneError
from lippmann.scene.values.whitted_scene import ClassicCamera, ClassicScene
from lippmann.scene.values.whitted_surfaces import (
    Background,
    ClassicImage,
    ClassicLight,
    ClassicMaterial,
    ClassicTexture,
    Fog,
)
from lippmann.scene.whitted.builder import ClassicSceneBuilder, unit

numbers = st.floats(-100, 100)
vectors = st.tuples(numbers, numbers, numbers)


def one_of_each() -> ClassicSceneBuilder:
    builder = ClassicSceneBuilder("one of each")
    red = builder.material(ClassicMaterial(color=(1.0, 0.0, 0.0)))
    builder.spheres([0, 0, 0], 1.0, red)
    builder.tubes([0, 0, 0], [0, 0, 2], 0.5, red, apex_radius=0.25)
    builder.cylinders([0, 0, 0], [0, 3, 0], 0.5, red)
    builder.rings([0, 0, 0], [0, 0, 2], 0.5, 1.5, red)
    builder.boxes([0, 0, 0], [1, 1, 3], red)
    builder.planes([0, -1, 0], [0, 5, 0], red)
    builder.triangles([[0, 0, 0], [1, 0, 0], [0, 1, 0]], red)
    return builder


def test_counts_and_bounds_of_one_of_each():
    scene = one_of_each().build()
    kinds = ("sphere", "tube", "cylinder", "ring", "box", "plane", "triangle")
    assert scene.counts() == dict.fromkeys(kinds, 1)
    np.testing.assert_allclose(scene.bounds(), [[-1.5, -1.5, -1.0], [1.5, 1.5, 3.0]])


def test_directions_are_normalised_and_arrays_read_only():
    scene = one_of_each().build()
    np.testing.assert_array_equal(scene.planes.normals, [[0, 1, 0]])
    np.testing.assert_array_equal(scene.cylinders.axes, [[0, 1, 0]])
    np.testing.assert_array_equal(scene.rings.normals, [[0, 0, 1]])
    with pytest.raises(ValueError, match="read-only"):
        scene.spheres.radii[0] = 2.0


def test_flat_triangles_carry_the_normal_of_their_winding():
    triangles = one_of_each().build().triangles
    np.testing.assert_array_equal(triangles.normals, [[[0, 0, 1]] * 3])
    assert not triangles.smooth[0]
    assert not triangles.colored[0]


def test_single_values_stand_for_all_rows():
    builder = ClassicSceneBuilder("rows")
    red, blue = (builder.material(ClassicMaterial(color=color)) for color in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    group = builder.clip_group([[1, 0, 0, 2]])
    builder.spheres([[0, 0, 0], [3, 0, 0]], 2.0, [red, blue], clip_group=group)
    builder.spheres([9, 9, 9], [1.0], red)
    spheres = builder.build().spheres
    assert spheres.radii.tolist() == [2, 2, 1]
    assert spheres.material.tolist() == [red, blue, red]
    assert spheres.clip_group.tolist() == [0, 0, -1]


def test_equal_materials_are_one():
    builder = ClassicSceneBuilder("materials")
    first = builder.material(ClassicMaterial(diffuse=0.5))
    assert builder.material(ClassicMaterial(diffuse=0.25)) != first
    assert builder.material(ClassicMaterial(diffuse=0.5)) == first
    assert len(builder.build().materials) == 2


def test_mesh_shares_vertices():
    builder = ClassicSceneBuilder("mesh")
    white = builder.material(ClassicMaterial())
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    builder.mesh(corners, [[0, 1, 2], [0, 2, 3]], white, normals=np.tile([0, 0, 1.0], (4, 1)), colors=corners)
    triangles = builder.build().triangles
    np.testing.assert_array_equal(triangles.positions[1], corners[[0, 2, 3]])
    np.testing.assert_array_equal(triangles.colors, triangles.positions)
    assert triangles.smooth.all()
    assert triangles.colored.all()


def test_corners_of_a_box_run_through_z_first():
    builder = ClassicSceneBuilder("box")
    builder.boxes((1, 2, 3), (4, 5, 6), builder.material(ClassicMaterial()))
    corners = builder.build().boxes.corners()
    expected = [(1, 2, 3), (1, 2, 6), (1, 5, 3), (1, 5, 6), (4, 2, 3), (4, 2, 6), (4, 5, 3), (4, 5, 6)]
    np.testing.assert_array_equal(corners, [expected])


def test_scene_without_finite_primitives_has_no_bounds():
    builder = ClassicSceneBuilder("plane")
    builder.planes([0, 0, 0], [0, 1, 0], builder.material(ClassicMaterial()))
    assert builder.build().bounds() is None


@settings(deadline=None, max_examples=30)
@given(base=vectors, axis=vectors, radii=st.tuples(st.floats(0, 10), st.floats(0.1, 10)))
def test_bounds_of_a_tube_touch_its_rims(base, axis, radii):
    base, axis = np.array(base), np.array(axis)
    if np.linalg.norm(axis) < 1e-3 or (base == base + axis).all():
        return
    builder = ClassicSceneBuilder("tube")
    builder.tubes(base, base + axis, radii[0], builder.material(ClassicMaterial()), apex_radius=radii[1])
    low, high = builder.build().bounds()
    across = np.linalg.svd(axis[None] / np.linalg.norm(axis))[2][1:]
    angles = np.linspace(0, 2 * np.pi, 2001)
    circle = np.cos(angles)[:, None] * across[0] + np.sin(angles)[:, None] * across[1]
    rims = np.concatenate([base + radii[0] * circle, base + axis + radii[1] * circle])
    np.testing.assert_allclose(rims.min(axis=0), low, atol=1e-3)
    np.testing.assert_allclose(rims.max(axis=0), high, atol=1e-3)


@pytest.mark.parametrize(
    ("method", "arguments", "rule"),
    [
        ("spheres", ([0, 0, 0], 0.0), "radius is positive"),
        ("spheres", ([0, 0, 0], -1.0), "radius is positive"),
        ("spheres", ([0, 0, math.nan], 1.0), "not finite"),
        ("spheres", ([[0, 0, 0], [1, 1, 1]], [1.0, 2.0, 3.0]), "do not fit together"),
        ("tubes", ([0, 0, 0], [0, 0, 0], 1.0), "different points"),
        ("tubes", ([0, 0, 0], [0, 0, 1], -1.0), "not negative"),
        ("rings", ([0, 0, 0], [0, 0, 1], 2.0, 1.0), "outer larger"),
        ("rings", ([0, 0, 0], [0, 0, 0], 0.0, 1.0), "needs a length"),
        ("boxes", ([0, 0, 0], [1, -1, 1]), "not above"),
        ("planes", ([0, 0, 0], [0, math.inf, 0]), "not finite"),
    ],
)
def test_impossible_primitives_are_refused(method, arguments, rule):
    builder = ClassicSceneBuilder("impossible")
    with pytest.raises(SceneError, match=rule):
        getattr(builder, method)(*arguments, builder.material(ClassicMaterial()))


def test_indices_out_of_range_are_refused():
    builder = ClassicSceneBuilder("indices")
    builder.spheres([0, 0, 0], 1.0, 0)
    with pytest.raises(SceneError, match="without material"):
        builder.build()
    builder.material(ClassicMaterial())
    builder.light(ClassicLight("point", clip_group=0))
    with pytest.raises(SceneError, match="light in clip group 0"):
        builder.build()


@pytest.mark.parametrize(
    "make",
    [
        lambda: ClassicMaterial(diffuse=math.inf),
        lambda: ClassicMaterial(ior=0.0),
        lambda: ClassicMaterial(phong_size=-1.0),
        lambda: ClassicTexture("planar-image"),
        lambda: ClassicTexture("checker", image=0),
        lambda: ClassicTexture("plaid"),
        lambda: ClassicLight("point", radius=-1.0),
        lambda: ClassicLight("spot", direction=(0.0, 0.0, 2.0)),
        lambda: ClassicLight("point", attenuation=(0.0, 0.0, 0.0)),
        lambda: ClassicCamera(view=(0.0, 0.0, 0.0)),
        lambda: ClassicCamera(view=(0.0, 2.0, 0.0)),
        lambda: ClassicCamera(zoom=0.0),
        lambda: ClassicCamera(ray_depth=0),
        lambda: ClassicCamera(angle=180.0),
        lambda: Background("sky-sphere", top_value=0.0, bottom_value=0.0),
        lambda: Fog("linear", 1.0, 1.0, 0.0, (1.0, 1.0, 1.0)),
        lambda: ClassicImage("flat", np.zeros((4, 4, 3), np.uint8)),
        lambda: ClassicScene("none", resolution=(0, 512)),
    ],
)
def test_impossible_values_are_refused(make):
    with pytest.raises(SceneError):
        make()


def test_camera_frame_is_left_or_right_handed():
    left = ClassicCamera(view=(0.0, 0.0, 2.0), up=(0.0, 1.0, 1.0))
    right, up, view = left.frame()
    np.testing.assert_allclose([right, up, view], np.eye(3), atol=1e-15)  # +x is to the right, looking along +z
    mirrored = dataclasses.replace(left, handedness="right").frame()
    np.testing.assert_allclose(mirrored, [[-1, 0, 0], [0, 1, 0], [0, 0, 1]], atol=1e-15)


def test_camera_window():
    left, right, bottom, top = ClassicCamera(zoom=2.0, aspect=0.5).window(400, 200)
    assert (left, right, bottom, top) == (-1.0, 1.0, -0.25, 0.25)
    field = 2 * math.degrees(math.atan(0.5))
    assert field == pytest.approx(53.13, abs=0.01)
    assert ClassicCamera().window(512, 512) == (-0.5, 0.5, -0.5, 0.5)
    assert ClassicCamera(zoom=3.0, frustum=(-3.0, 1.0, -1.0, 2.0)).window(7, 9) == (-3.0, 1.0, -1.0, 2.0)


def test_nff_angle_spans_the_centers_of_the_outer_rows():
    left, right, bottom, top = ClassicCamera(angle=90.0).window(5, 3)
    pixel = (top - bottom) / 3
    assert top - pixel / 2 == pytest.approx(1.0)
    assert (right - left) / 5 == pytest.approx(pixel)


def test_unit_keeps_very_short_and_long_vectors():
    np.testing.assert_allclose(unit([[3e-300, 4e-300, 0], [0, 3e300, -4e300]], "axis"), [[0.6, 0.8, 0], [0, 0.6, -0.8]])
