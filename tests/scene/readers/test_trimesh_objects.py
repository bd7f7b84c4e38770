"""Scenes of other libraries."""

import sys

import numpy as np
import pytest
import trimesh
from PIL import Image as Pillow

from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.scene.readers.load import load_scene


def box(**fields):
    return trimesh.creation.box((1, 2, 3), **fields)


def test_a_trimesh_mesh():
    scene = load_scene(box())
    assert scene.bounds.tolist() == [[-0.5, -1, -1.5], [0.5, 1, 1.5]]
    (mesh,) = scene.description.meshes
    assert len(mesh.faces) == 12
    assert mesh.normals is None


def test_normals_that_the_mesh_holds():
    ball = trimesh.creation.icosphere(subdivisions=1)
    ball = trimesh.Trimesh(ball.vertices, ball.faces, vertex_normals=ball.vertices, process=False)
    (mesh,) = load_scene(ball).description.meshes
    assert mesh.normals == pytest.approx(mesh.positions, abs=1e-6)


def test_instances_share_their_mesh():
    scene = trimesh.Scene()
    scene.add_geometry(box(), geom_name="box", node_name="a")
    scene.graph.update("b", "world", geometry="box", matrix=trimesh.transformations.translation_matrix((10, 0, 0)))
    found = load_scene(scene)
    assert len(found.description.meshes) == 1
    assert len(found.description.instances) == 2
    assert found.bounds.tolist() == [[-0.5, -1, -1.5], [10.5, 1, 1.5]]


def test_colours_of_vertices_and_faces():
    mesh = box()
    mesh.visual.vertex_colors = np.tile([255, 0, 188, 51], (8, 1)).astype(np.uint8)
    scene = load_scene(mesh).description
    (found,) = scene.meshes
    assert found.colors[0] == pytest.approx([1, 0, float(decode_srgb(np.array(188 / 255))), 0.2], abs=1e-6)
    assert scene.materials[found.material].alpha_mode == "blend"
    mesh = box()
    mesh.visual.face_colors = np.array([[255, 0, 0, 255]] + [[0, 0, 255, 255]] * 11, np.uint8)
    scene = load_scene(mesh).description
    (found,) = scene.meshes
    assert scene.materials[found.material].alpha_mode == "opaque"
    assert len(found.positions) == 36
    assert (found.colors[found.faces][0] == (1, 0, 0, 1)).all()
    assert (found.colors[found.faces][1:] == (0, 0, 1, 1)).all()


def textured(material):
    mesh = box()
    mesh.visual = trimesh.visual.TextureVisuals(uv=np.tile([0.25, 0.0], (8, 1)), material=material)
    return load_scene(mesh).description


def test_physically_based_materials():
    picture = Pillow.new("RGBA", (4, 2), (10, 20, 30, 40))
    material = trimesh.visual.material.PBRMaterial(
        name="m",
        baseColorFactor=[51, 102, 153, 204],
        baseColorTexture=picture,
        metallicFactor=0.25,
        roughnessFactor=0.5,
        metallicRoughnessTexture=picture,
        normalTexture=picture,
        emissiveFactor=[0.1, 0.2, 0.3],
        alphaMode="MASK",
        alphaCutoff=0.3,
        doubleSided=True,
    )
    description = textured(material)
    (found,) = description.materials
    assert found.base_color == pytest.approx((0.2, 0.4, 0.6))
    assert (found.alpha, found.alpha_mode, found.alpha_cutoff) == (0.8, "mask", 0.3)
    assert (found.metallic, found.roughness, found.double_sided) == (0.25, 0.5, True)
    assert found.emission == pytest.approx((0.1, 0.2, 0.3))
    assert (found.base_color_texture.srgb, found.normal_texture.srgb) == (True, False)
    assert found.base_color_texture.image is found.normal_texture.image
    assert found.base_color_texture.image.pixels.shape == (2, 4, 4)
    assert description.meshes[0].uvs[0][0].tolist() == [0.25, 1.0]


def test_glTF_defaults_hold_where_nothing_is_said():  # noqa: N802
    (found,) = textured(trimesh.visual.material.PBRMaterial()).materials
    assert (found.metallic, found.roughness, found.alpha_mode, found.base_color) == (1, 1, "opaque", (1, 1, 1))


def test_phong_materials():
    simple = trimesh.visual.material.SimpleMaterial
    (found,) = textured(simple(diffuse=[51, 102, 153, 255], glossiness=30)).materials
    assert found.base_color == pytest.approx((0.2, 0.4, 0.6))
    assert (found.metallic, found.roughness) == (0, 0.5)
    (found,) = textured(simple(image=Pillow.new("L", (2, 2), 9))).materials
    assert found.base_color == (1, 1, 1)
    assert found.base_color_texture.image.pixels.shape == (2, 2, 1)


def test_cameras_and_lamps():
    scene = box().scene()
    assert load_scene(scene).cameras == ()
    assert not load_scene(scene).has_lights
    scene.lights  # noqa: B018 - asking invents lights
    invented = load_scene(scene)
    assert invented.has_lights
    light = trimesh.scene.lighting.SpotLight(
        name="light", color=[255, 0, 51, 255], intensity=10, innerConeAngle=0.1, outerConeAngle=0.3
    )
    scene.lights = [light]
    scene.graph.update("light", "world", matrix=trimesh.transformations.translation_matrix((0, 5, 0)))
    scene.set_camera(angles=(0, 0, 0), distance=10, center=(0, 0, 0), fov=(60, 40))
    found = load_scene(scene).description
    (light,), (camera,) = found.lights, found.cameras
    assert (light.kind, light.inner_angle, light.outer_angle) == ("spot", 0.1, 0.3)
    assert light.color == pytest.approx((10, 0, 2))
    assert light.world_from_light[:3, 3].tolist() == [0, 5, 0]
    assert camera.fov_y == pytest.approx(np.radians(40))
    assert camera.aspect == pytest.approx(np.tan(np.radians(30)) / np.tan(np.radians(20)))
    assert camera.world_from_camera[:3, 3] == pytest.approx([0, 0, 10])


def test_what_has_no_faces():
    scene = box().scene()
    scene.add_geometry(trimesh.Trimesh(), geom_name="nothing")
    assert "'nothing' has no faces and is not rendered" in load_scene(scene).notes
    with pytest.raises(SceneError, match="holds no triangles"):
        load_scene(trimesh.Scene())


def test_points_and_paths_lie_where_their_nodes_are():
    scene = box().scene()
    cloud = trimesh.PointCloud([*np.eye(3), (np.nan, 0, 0)], colors=[(255, 0, 0, 255)] * 4)
    scene.add_geometry(cloud, transform=trimesh.transformations.translation_matrix((10, 0, 0)))
    scene.add_geometry(trimesh.load_path(np.array([(0, 0, 5), (4, 0, 5), (4, 4, 5)], float)))
    found = load_scene(scene).description
    solid, balls, rods = found.meshes
    assert balls.positions.reshape(3, -1, 3).mean(axis=1) == pytest.approx(np.eye(3) + np.array([10, 0, 0]), abs=1e-5)
    assert (balls.colors[:, :3] == [1, 0, 0]).all()
    assert rods.positions.reshape(2, -1, 3).mean(axis=1) == pytest.approx(np.array([(2, 0, 5), (4, 2, 5)]), abs=1e-5)
    assert [found.materials[mesh.material].unlit for mesh in (solid, balls, rods)] == [False, True, False]
    assert len(load_scene(cloud).description.meshes) == 1


class Values(dict):
    active_normals = active_normals_name = active_texture_coordinates_name = None


class PolyData:
    """As much of a PyVista surface as is asked for."""

    verts = ()
    n_verts = n_lines = 0
    active_texture_coordinates = None

    def __init__(self, scalars=None, cells=()):
        self.points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)
        self.faces = np.array(cells).ravel()
        self.n_cells = len(cells)
        self.point_data = Values()
        self.active_scalars, self.active_scalars_name = scalars, "heat"

    def triangulate(self):
        triangles = [(3, 0, 1, 2), (3, 0, 2, 3)] if len(self.faces) else []
        return PolyData(self.active_scalars, triangles)


class UnstructuredGrid:
    active_scalars_name, point_data, cell_data = None, Values(), Values()

    def extract_surface(self):
        return PolyData(cells=[(4, 0, 1, 2, 3)])


class MultiBlock:
    def combine(self):
        return UnstructuredGrid()

    def recursive_iterator(self, skip_none):
        return iter([UnstructuredGrid()])


@pytest.fixture
def stand_in(monkeypatch):
    for kind in (PolyData, UnstructuredGrid, MultiBlock):
        monkeypatch.setattr(kind, "__module__", "pyvista.core")


SQUARE = [(4, 0, 1, 2, 3)]


@pytest.mark.usefixtures("stand_in")
def test_surfaces_grids_and_collections_of_pyvista():
    for source in (PolyData(cells=SQUARE), UnstructuredGrid(), MultiBlock()):
        scene = load_scene(source)
        assert scene.bounds.tolist() == [[0, 0, 0], [1, 1, 0]]
        assert scene.description.meshes[0].faces.tolist() == [[0, 1, 2], [0, 2, 3]]
        assert scene.description.meshes[0].colors is None


@pytest.mark.usefixtures("stand_in")
def test_colours_and_scalars_of_pyvista():
    colors = np.array([[255, 0, 0]] * 4, np.uint8)
    assert (load_scene(PolyData(colors, SQUARE)).description.meshes[0].colors == (1, 0, 0)).all()
    triangles = [(3, 0, 1, 2), (3, 0, 2, 3)]
    (mesh,) = load_scene(PolyData(np.array([[255, 0, 0], [0, 255, 0]], np.uint8), triangles)).description.meshes
    assert mesh.colors[mesh.faces][:, 0].tolist() == [[1, 0, 0], [0, 1, 0]]
    scene = load_scene(PolyData(np.arange(4.0), SQUARE))
    assert "the scalars 'heat' from 0 to 3 are coloured by viridis" in scene.notes


@pytest.mark.usefixtures("stand_in")
def test_a_cloud_of_points():
    with pytest.raises(SceneError, match="the PyVista data set has no surface"):
        load_scene(PolyData())


def test_the_real_pyvista():
    pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed")
    sphere = load_scene(pyvista.Sphere(radius=2.0))
    assert sphere.bounds[1] == pytest.approx([2, 2, 2], rel=0.02)
    assert sphere.description.meshes[0].normals is not None
    grid = load_scene(pyvista.ImageData(dimensions=(3, 3, 3)))
    assert grid.bounds.tolist() == [[0, 0, 0], [2, 2, 2]]
    assert len(grid.description.meshes[0].faces) == 48
    plane = load_scene(pyvista.Plane()).description.meshes[0]
    low_left = np.argmin(plane.positions[:, :2].sum(axis=1))
    assert plane.uvs[0][low_left].tolist() == [0, 1]


@pytest.mark.slow
def test_neither_library_is_loaded_for_the_others(tmp_path):
    import subprocess

    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    code = (
        "import sys; from lippmann.scene.readers.load import load_scene; "
        f"load_scene({str(path)!r}).bounds; print(*sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(run.stdout.split()) & {"trimesh", "pyvista", "mitsuba", "pygltflib", "OpenEXR", "PIL"} == set()
