"""Meshes stand where they are placed, face the right way, and cost no more shapes and memory than they must."""

from dataclasses import replace

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.values.description import Instance, Material, Mesh

PLAIN = Material(base_color=(0.5, 0.5, 0.5), specular=0.0)
#: Bytes that hold one ball of 60 steps, but not six.
SCARCE = 4 << 20


def moved(*offset, scale=(1.0, 1.0, 1.0), turn=0.0):
    matrix = np.eye(4)
    cosine, sine = np.cos(turn), np.sin(turn)
    matrix[:3, :3] = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]) @ np.diag(scale)
    matrix[:3, 3] = offset
    return matrix


def is_instanced(built):
    return [shape for shape in built.mitsuba.shapes() if not shape.is_mesh()]


def outward(built, look, x, y, **where):
    """Geometric and shading normals where rays along the z axis meet the scene."""
    si = look.hit(built, x, y, **where)
    return np.array(si.n).T, np.array(si.sh_frame.n).T, np.array(si.p).T


@pytest.mark.slow
def test_a_mesh_whose_copies_would_fill_the_memory_is_kept_once(build, look, parts):
    mesh = parts.ball(steps=60)
    places = np.stack([moved(3.0 * number, 0, 0) for number in range(6)])
    built = build(parts.describe([mesh], [PLAIN], instances=[Instance(0, places)]), memory=SCARCE)
    assert len(is_instanced(built)) == len(built.mitsuba.shapes()) == 6
    assert sum(shape.primitive_count() for shape in built.mitsuba.shapes()) == 6
    for number in range(6):
        normal, smooth, point = outward(built, look, 3 * number + 0.3, 0.4)
        direction = np.array([0.3, 0.4, np.sqrt(0.75)])
        np.testing.assert_allclose(point, [direction + np.array([3.0 * number, 0, 0])], atol=5e-3)
        np.testing.assert_allclose(smooth, [direction], atol=5e-3)
        np.testing.assert_allclose(normal, [direction], atol=0.06)


def test_parts_of_an_object_share_its_instances(build, parts):
    """Meshes that are always placed together, as the primitives of one glTF mesh are, form one group."""
    meshes = [parts.ball(steps=60), parts.ball(1, steps=60, radius=0.5)]
    instances = [Instance(mesh, moved(3.0 * number, 0, 0)) for number in range(6) for mesh in (0, 1)]
    built = build(parts.describe(meshes, [PLAIN, Material(metallic=1.0)], instances=instances), memory=2 * SCARCE)
    assert len(built.mitsuba.shapes()) == 6


@pytest.mark.parametrize("stacked", [True, False])
def test_copies_are_merged(build, look, parts, stacked):
    """Instances would cost more time than the triangles that they save."""
    places = np.stack([moved(3.0 * number, 0, 0) for number in range(400)])
    instances = [Instance(0, places)] if stacked else [Instance(0, place) for place in places]
    built = build(parts.describe([parts.square()], [PLAIN], instances=instances))
    assert len(built.mitsuba.shapes()) == 1
    assert built.mitsuba.shapes()[0].primitive_count() == 800
    assert look.hit(built, [0, 3, 6, 1197], [0, 0, 0, 0]).is_valid().numpy().all()
    assert not look.hit(built, [1.5, 1195.5], [0, 0]).is_valid().numpy().any()


@pytest.mark.slow
@pytest.mark.parametrize("memory", [None, SCARCE])  # merged, and as instances
@pytest.mark.parametrize("smooth", [True, False])
def test_mirrored_placement_keeps_the_outside_out(build, look, parts, memory, smooth):
    ball = parts.ball(steps=60)
    if not smooth:
        ball = Mesh("ball", ball.positions, ball.faces, 0, None, ball.uvs)
    places = [moved(0, 0, 0, scale=(-1, 1, 1)), *(moved(5 + 3 * n, 0, 0) for n in range(5))]
    built = build(parts.describe([ball], [PLAIN], instances=[Instance(0, place) for place in places]), memory=memory)
    assert bool(is_instanced(built)) == (memory is not None)
    x, y = np.meshgrid(np.linspace(-0.6, 0.6, 9), np.linspace(-0.61, 0.62, 9))
    normal, shading, point = outward(built, look, x, y)
    assert ((normal * point).sum(1) > 0.9).all()
    assert ((shading * point).sum(1) > 0.9).all()
    assert (point[:, 2] > 0).all()


def test_stretched_normals(build, look, parts):
    """Normals of a ball made into an ellipsoid are those of the ellipsoid."""
    scale = np.array([2.0, 0.5, 1.0])
    built = build(parts.describe([parts.ball()], [PLAIN], instances=[Instance(0, moved(0, 0, 0, scale=scale))]))
    _, shading, point = outward(built, look, [0.8, -1.1], [0.2, 0.1])
    expected = point / scale**2
    np.testing.assert_allclose(shading, expected / np.linalg.norm(expected, axis=1, keepdims=True), atol=0.02)


def test_flat_and_smooth(build, look, parts):
    """Without normals faces are flat; with them the shading normal is between the vertices'."""
    corner = np.array([0.3, 0.0, 1.0]) / np.linalg.norm([0.3, 0.0, 1.0])
    normals = np.array([corner * [-1, 1, 1], corner, corner, corner * [-1, 1, 1]], np.float32)
    flat = build(parts.describe([parts.square()], [PLAIN]))
    smooth = build(parts.describe([parts.square(normals=normals)], [PLAIN]))
    np.testing.assert_allclose(outward(flat, look, 0.5, 0.2)[1], [(0, 0, 1)], atol=1e-6)
    bent = np.array([corner[0] / 2, 0, corner[2]])
    np.testing.assert_allclose(outward(smooth, look, 0.5, 0.2)[1], [bent / np.linalg.norm(bent)], atol=1e-5)


def test_lost_normals_are_made_anew(build, look, parts):
    built = build(parts.describe([parts.square(normals=np.zeros((4, 3), np.float32))], [PLAIN]))
    np.testing.assert_allclose(outward(built, look, 0.5, 0.2)[1], [(0, 0, 1)], atol=1e-6)


def test_meshes_of_one_material_are_merged(build, parts):
    meshes = [parts.square(z=0.01 * number) for number in range(50)]
    assert len(build(parts.describe(meshes, [PLAIN])).mitsuba.shapes()) == 1


def test_materials_that_differ_in_numbers_share_a_shape(build, look, parts):
    rng = np.random.default_rng(11)
    colors = rng.random((300, 3))
    materials = [Material(base_color=tuple(color), roughness=float(color[0])) for color in colors]
    meshes = [parts.square(number, half=0.4) for number in range(300)]
    instances = [Instance(number, moved(number, 0, 0)) for number in range(300)]
    built = build(parts.describe(meshes, materials, instances=instances))
    assert len(built.mitsuba.shapes()) == 1
    x = np.arange(300)
    np.testing.assert_allclose(look.attribute(built, "base_color", x, 0 * x), colors, atol=1e-6)
    np.testing.assert_allclose(look.scalar(built, "roughness", x, 0 * x), colors[:, 0], atol=1e-6)


def test_family_in_a_repeated_object(build, look, parts):
    """Members keep their colours inside instances, too."""
    materials = [Material(base_color=(1, 0, 0)), Material(base_color=(0, 1, 0))]
    meshes = [parts.ball(0, steps=60), parts.ball(1, steps=60)]
    meshes[1] = Mesh("up", meshes[1].positions + np.float32([0, 3, 0]), meshes[1].faces, 1, meshes[1].normals)
    instances = [Instance(mesh, moved(3.0 * number, 0, 0)) for number in range(6) for mesh in (0, 1)]
    built = build(parts.describe(meshes, materials, instances=instances), memory=2 * SCARCE)
    assert is_instanced(built)
    seen = look.attribute(built, "base_color", [3, 3], [0, 3])
    np.testing.assert_allclose(seen, [(1, 0, 0), (0, 1, 0)], atol=1e-6)


@pytest.mark.slow
def test_copies_keep_colours_coordinates_and_normals(build, look, parts):
    """Merged copies, some of them mirrored, equal the same meshes one by one."""
    rng = np.random.default_rng(5)
    colors = rng.random((4, 3), np.float32)
    square = parts.square(colors=colors, normals=np.tile(np.float32([0.1, 0, 1]), (4, 1)))
    places = np.stack([moved(3.0 * n, 0, 0, scale=(1, (-1) ** n, 1), turn=0.1 * n) for n in range(5)])
    stack = build(parts.describe([square], [PLAIN], instances=[Instance(0, places)]))
    single = build(parts.describe([square], [PLAIN], instances=[Instance(0, place) for place in places]))
    x, y = 3.0 * np.arange(5) + 0.2, np.full(5, 0.4)
    for mine, its in zip(outward(stack, look, x, y), outward(single, look, x, y), strict=True):
        np.testing.assert_array_equal(mine, its)
    for number in range(5):
        alone = build(parts.describe([square], [PLAIN], instances=[Instance(0, places[number])]))
        expected = look.attribute(alone, "base_color", x[number], 0.4)
        np.testing.assert_allclose(look.attribute(stack, "base_color", x[number], 0.4), expected, atol=1e-6)
        for mine, its in zip(outward(stack, look, x[number], 0.4), outward(alone, look, x[number], 0.4), strict=True):
            np.testing.assert_allclose(mine, its, atol=1e-5)


@pytest.mark.slow
def test_copies_beyond_the_memory_are_refused(build, parts):
    places = np.tile(np.eye(4), (200_000, 1, 1))
    with pytest.raises(SceneError, match=r"200,000 placed meshes of 2,808,400,000 triangles need .* GiB.* 1\.0 GiB"):
        build(parts.describe([parts.ball(steps=60)], [PLAIN], instances=[Instance(0, places)]), memory=1 << 30)


def test_vertex_colours_multiply(build, look, parts):
    colors = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)
    built = build(parts.describe([parts.square(colors=colors)], [Material(base_color=(0.5, 0.8, 1.0))]))
    x, y = np.array([0.5, -0.2]), np.array([0.3, 0.7])
    expected = np.column_stack([(x + 1) / 2 * 0.5, (y + 1) / 2 * 0.8, [0, 0]])
    np.testing.assert_allclose(look.attribute(built, "base_color", x, y), expected, atol=1e-5)


def test_slivers_have_a_colour(build, look, parts):
    """Of the bed of a printer, 300 mm long: single precision cannot tell its corners from points of one line."""
    corners = [(-147.71555, 150.04622, 0), (147.71555, 150.04622, 0), (147.71361, 150.0481, 0)]
    mesh = replace(
        parts.square(colors=np.full((3, 4), 0.35, np.float32)),
        positions=np.array(corners, np.float32),
        faces=np.array([(0, 1, 2)], np.uint32),
        uvs=(),
    )
    built = build(parts.describe([mesh], [Material(base_color=(1, 1, 1), alpha_mode="blend")]))
    x, y = [147.0, 147.5], [150.0475, 150.0475]
    assert np.array(look.hit(built, x, y).is_valid()).all()
    assert np.isfinite(look.attribute(built, "base_color", x, y)).all()
    np.testing.assert_allclose(look.opacity(built, x, y), 1.0)


def test_surfaces_whose_normals_lie_across_the_ray_are_lit(build, look, parts):
    """As leaves whose normals all point up, seen by level rays."""
    import mitsuba as mi

    upward = np.tile(np.float32([0, 1, 0]), (4, 1))
    built = build(parts.describe([parts.square(normals=upward)], [PLAIN]))
    si = look.hit(built, [0.3], [0.4])
    lit = np.array(si.bsdf().eval(mi.BSDFContext(), si, si.to_local(mi.Vector3f(0, 1, 0)))).T
    np.testing.assert_allclose(lit, 0.5 / np.pi, rtol=0.02)


def test_coloured_and_plain_meshes_of_one_material(build, look, parts):
    colors = np.tile(np.array([(0.25, 0.5, 1)], np.float32), (4, 1))
    meshes = [parts.square(half=0.4, colors=colors), parts.square(half=0.4)]
    instances = [Instance(0, moved(0, 0, 0)), Instance(1, moved(1, 0, 0))]
    built = build(parts.describe(meshes, [Material(base_color=(1, 1, 1))], instances=instances))
    np.testing.assert_allclose(look.attribute(built, "base_color", [0, 1], [0, 0]), [(0.25, 0.5, 1), (1, 1, 1)])


def test_objects_scaled_to_nothing_are_left_out(build, parts):
    instances = [Instance(0, moved(0, 0, 0)), Instance(0, moved(1, 0, 0, scale=(1, 0, 1)))]
    built = build(parts.describe([parts.square()], [PLAIN], instances=instances))
    assert built.mitsuba.shapes()[0].primitive_count() == 2
    assert len(built.notes) == 1
    assert built.notes[0].startswith("1 object")
