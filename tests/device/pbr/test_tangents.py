"""Tangents that meshes bring, as glTF's TANGENT has them: bitangent = cross(normal, tangent) * w."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann.device.pbr.tangents import tangents_in_uv, with_own_corners
from lippmann.scene.values.description import Image, Instance, Material, Texture

TILT = np.array([0.3, 0.5, 0.8]) / np.linalg.norm([0.3, 0.5, 0.8])
NORMALS = np.tile(np.float32([0, 0, 1]), (4, 1))


def normal_map():
    return Texture(Image("map", ((TILT.reshape(1, 1, 3) + 1) / 2).astype(np.float32)), srgb=False)


def square(parts, tangents, **rest):
    mesh = parts.square(normals=NORMALS, **rest)
    return replace(mesh, tangents=np.broadcast_to(np.float32(tangents), (4, 4)))


def mapped(tangent, normal=(0, 0, 1)):
    """The world normal that the texel stands for, by the specification's formula."""
    along, normal = np.array(tangent[:3], float), np.array(normal, float)
    return TILT[0] * along + TILT[1] * tangent[3] * np.cross(normal, along) + TILT[2] * normal


@pytest.mark.parametrize("tangent", [(1, 0, 0, 1), (1, 0, 0, -1), (0, 1, 0, 1), (0.6, -0.8, 0, -1)])
def test_normal_map_follows_the_mesh_s_own_tangents(build, look, parts, tangent):
    built = build(parts.describe([square(parts, tangent)], [Material(normal_texture=normal_map())]))
    seen = look.attribute(built, "normal", [0.2, -0.5], [0.4, -0.3])
    np.testing.assert_allclose(seen, [mapped(tangent)] * 2, atol=1e-5)


def test_tangents_are_interpolated_over_a_triangle(build, look, parts):
    """In the middle between two corners, half of either."""
    angles = np.array([0.0, 0.0, 1.0, 1.0])
    tangents = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles, np.ones(4)])
    built = build(parts.describe([square(parts, tangents)], [Material(normal_texture=normal_map())]))
    seen = look.attribute(built, "normal", [0.4, 0.9], [0.0, 0.0])
    np.testing.assert_allclose(seen, [mapped((np.cos(0.5), np.sin(0.5), 0, 1))] * 2, atol=1e-4)


def test_corners_without_a_direction_take_that_of_the_texture(build, look, parts):
    for tangents in (np.zeros(4), [0, 0, 1, 1]):
        built = build(parts.describe([square(parts, tangents)], [Material(normal_texture=normal_map())]))
        np.testing.assert_allclose(look.attribute(built, "normal", 0.2, 0.4), [TILT], atol=1e-5)
    flat = square(parts, [0, 1, 0, 1], uvs=(np.zeros((4, 2), np.float32),))
    built = build(parts.describe([flat], [Material(normal_texture=normal_map())]))
    assert np.isfinite(look.attribute(built, "normal", 0.2, 0.4)).all()


def test_a_triangle_that_is_a_point_has_the_direction_of_the_texture(parts):
    """Models of aircraft and machines have some; their texture coordinates may be those of a triangle."""
    whole = square(parts, [0, 1, 0, 1])
    point = with_own_corners(replace(whole, positions=np.zeros((4, 3), np.float32)))
    assert tangents_in_uv(point, 0).tolist() == [[1, 0, 1]] * len(point.positions)


def quarter_turn(x):
    place = np.eye(4)
    place[:2, :2], place[0, 3] = [[0, -2], [2, 0]], x
    return place


@pytest.mark.parametrize("instanced", [False, True])
def test_placements_turn_and_mirror_what_the_tangents_show(build, look, parts, monkeypatch, instanced):
    from lippmann.device.pbr import shapes

    monkeypatch.setattr(shapes, "choose_instances", lambda groups, *_, **__: set(groups) if instanced else set())
    tangent = (0.6, 0.8, 0, 1)
    places = np.stack([quarter_turn(0), parts.shift(6, scale=(-1, 1, 1)), parts.shift(12)])
    mesh = square(parts, tangent)
    description = parts.describe([mesh], [Material(normal_texture=normal_map())], instances=[Instance(0, places)])
    built = build(description)
    seen = look.attribute(built, "normal", [0.2, 6.2, 12.2], [0.4, 0.4, 0.4])
    x, y, z = mapped(tangent)
    np.testing.assert_allclose(seen, [(-y, x, z), (-x, y, z), (x, y, z)], atol=1e-5)


def test_brushed_metal_follows_the_mesh_s_own_tangents(build, look, parts):
    import mitsuba as mi

    metal = Material(base_color=(1, 1, 1), metallic=1.0, roughness=0.2, anisotropy=1.0)
    built = build(parts.describe([square(parts, (0, 1, 0, 1))], [metal]))
    si = look.hit(built, 0.1, 0.2)
    along, across = (
        float(np.array(si.bsdf().eval(mi.BSDFContext(), si, si.to_local(mi.Vector3f(*wo))))[0, 0])
        for wo in ((0.0, 0.6, 0.8), (0.6, 0.0, 0.8))
    )
    assert along > 50 * across


def test_materials_that_need_no_tangents_keep_their_vertices(build, parts):
    def vertices(material):
        built = build(parts.describe([square(parts, (0, 1, 0, 1))], [material]))
        return built.mitsuba.shapes()[0].vertex_count()

    assert vertices(Material()) == 4
    assert vertices(Material(normal_texture=normal_map())) == 6
