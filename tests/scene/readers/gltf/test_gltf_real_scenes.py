"""Real files made by others; the numbers were read off their JSON by hand."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.scene.readers.gltf import read_gltf


@pytest.fixture(scope="module")
def teapot(shared_scenes):
    return read_gltf(shared_scenes / "gltf" / "fancy_teapot" / "scene.gltf")


@pytest.fixture(scope="module")
def coats(shared_scenes):
    return read_gltf(shared_scenes / "gltf" / "clearcoat_test" / "ClearCoatTest.gltf")


def test_teapot_geometry(teapot, world_points):
    assert teapot.name == "scene"
    assert teapot.notes == ("occlusion textures are left out: light is traced into corners (materials[0])",)
    (mesh,) = teapot.meshes
    assert mesh.positions.shape == (6660, 3)
    assert mesh.faces.shape == (12144, 3)
    assert mesh.uvs[0].shape == (6660, 2)
    points = world_points(teapot)
    # accessors[0] of the file states these bounds; its only node has the identity matrix.
    np.testing.assert_allclose(points.min(axis=0), [-0.15179364, 0.0, -0.25773081], atol=1e-7)
    np.testing.assert_allclose(points.max(axis=0), [0.15179364, 0.30000067, 0.23573080], atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)


def test_teapot_normals_look_outward(teapot):
    mesh = teapot.meshes[0]
    corners = mesh.positions[mesh.faces].astype(np.float64)
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    agreement = np.einsum("ij,ij->i", flat, mesh.normals[mesh.faces].mean(axis=1))
    assert (agreement > 0).mean() > 0.99
    # A closed surface that looks outward encloses a positive volume.
    assert np.einsum("ij,ij->i", corners[:, 0], flat).sum() > 0


def test_teapot_material(teapot):
    (material,) = teapot.materials
    assert material.name == "PorcelainFlowers"
    assert (material.metallic, material.roughness) == (1.0, 1.0)
    assert material.base_color_texture.image.pixels.shape == (2048, 2048, 3)
    assert material.metallic_roughness_texture.image.pixels.shape == (2048, 2048, 3)
    assert material.base_color_texture.srgb
    assert not material.metallic_roughness_texture.srgb
    assert material.base_color_texture.wrap_u == "repeat"


def test_clearcoat_hierarchy(coats, world_points):
    assert len(coats.instances) == 27
    assert len(coats.meshes) == 27
    points = world_points(coats)
    # Row R5 stands at y = -3.15, R4 at -5.25 with spheres of radius 1; the labels of the rows begin at
    # -5.3578 - 2 and those of the columns end at 6.6195 + 0.2350.
    np.testing.assert_allclose(points.min(axis=0), [-7.3578033, -6.25, -0.06], atol=1e-6)
    np.testing.assert_allclose(points.max(axis=0), [3.1, 6.8545169, 1.05], atol=1e-6)
    last = [i for i in coats.instances if coats.materials[coats.meshes[i.mesh].material].name == "CoatNorm_Coating"]
    np.testing.assert_allclose(last[0].world_from_mesh[:3, 3], [2.1, -5.25, 0.0], atol=1e-6)


def test_clearcoat_arrays_are_shared(coats):
    samples = [mesh for mesh in coats.meshes if mesh.name == "ClearCoatSampleMesh"]
    assert len(samples) == 18
    assert len({id(mesh.positions) for mesh in samples}) == 1
    assert len({id(mesh.normals) for mesh in samples}) == 1


def test_clearcoat_materials(coats):
    named = {material.name: material for material in coats.materials}
    assert len(named) == 19
    plain, coated = named["Simple_Base"], named["Simple_Coated"]
    assert (plain.clearcoat, coated.clearcoat, coated.clearcoat_roughness) == (0.0, 1.0, 0.03)
    np.testing.assert_allclose(coated.base_color, (0.5, 0.02, 0.01), atol=1e-7)
    assert (coated.metallic, coated.roughness) == (0.0, pytest.approx(0.44))
    assert named["Partial_Coated"].clearcoat_texture.image.name == "PartialCoating.png"
    assert named["RoughVariations_Coated"].clearcoat_roughness == 1.0
    assert named["RoughVariations_Coated"].clearcoat_roughness_texture.image.name == "RoughnessStripes.png"
    shared = named["SharedNorm_Coated"]
    assert shared.normal_texture.image is shared.clearcoat_normal_texture.image
    assert shared.normal_texture.image.name == "RibsNormal.png"
    assert named["CoatNorm_Coated"].clearcoat_normal_texture.image.name == "PlasticWrap_normals.jpg"
    assert named["CoatNorm_Coated"].normal_texture is None
    blend = named["Partial_Coating"]
    assert (blend.alpha_mode, blend.base_color_texture.image.pixels.shape[2]) == ("blend", 4)
    assert named["LabelMaterial"].emission == (1.0, 1.0, 1.0)
    assert named["LabelMaterial"].emission_texture.srgb
