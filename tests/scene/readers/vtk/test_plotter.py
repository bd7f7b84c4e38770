"""PyVista's plotters and VTK's files as scenes."""

import numpy as np
import pytest

import lippmann
from lippmann.color.transfer import decode_srgb
from lippmann.errors import LippmannError, SceneError
from lippmann.scene.readers.load import load_scene


@pytest.fixture(scope="module", autouse=True)
def library():
    """PyVista, when the first test runs: as pytest asks every name of a module for marks, all of it would be loaded."""
    global pyvista
    pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed")


@pytest.fixture
def plotter(monkeypatch):
    made = pyvista.Plotter(off_screen=True)
    yield made
    made.close()


def test_actors_keep_their_colours_places_and_maps(plotter):
    sphere = pyvista.Sphere()
    sphere["height"] = sphere.points[:, 2]
    plotter.add_mesh(sphere, scalars="height", cmap=["black", "red"], smooth_shading=True)
    cube = plotter.add_mesh(pyvista.Cube(), color="lime", opacity=0.5)
    cube.position = (3, 0, 0)
    plotter.set_background("blue")
    scene = load_scene(plotter)
    ball, box = scene.description.meshes
    top, bottom = np.argmax(ball.positions[:, 2]), np.argmin(ball.positions[:, 2])
    (uvs,), texels = ball.uvs, scene.description.materials[0].base_color_texture.image.pixels
    rows, columns = len(texels), texels.shape[1]
    red, black = (texels[int(uvs[at, 1] * rows), int(uvs[at, 0] * columns)].tolist() for at in (top, bottom))
    assert (red, black) == ([255, 0, 0, 255], [0, 0, 0, 255])
    assert ball.normals is not None
    assert box.normals is None  # shaded flat
    assert scene.description.materials[1].base_color == (0, 1, 0)
    assert (scene.description.materials[1].alpha, scene.description.materials[1].alpha_mode) == (0.5, "blend")
    assert scene.description.instances[1].world_from_mesh[:3, 3].tolist() == [3, 0, 0]
    assert scene.background == (0, 0, 1)
    assert any("1 annotations and hidden objects" in note for note in scene.notes)  # the scalar bar


def test_the_camera_is_the_plotter_s(plotter):
    plotter.add_mesh(pyvista.Cube())
    before = load_scene(plotter).cameras[0]
    assert before.world_from_camera[:3, 2] == pytest.approx(np.full(3, 3**-0.5))  # from (1, 1, 1), z up
    assert before.world_from_camera[2, 1] > 0.8
    plotter.camera_position = [(0, -5, 0), (0, -1, 0), (0, 0, 1)]
    plotter.camera.view_angle = 40
    scene = load_scene(plotter)
    (camera,) = scene.cameras
    assert (scene.home_camera, camera.focus_distance) == ("plotter", 4)
    assert camera.fov_y == pytest.approx(np.radians(40))
    assert camera.world_from_camera == pytest.approx(
        np.array([[1, 0, 0, 0], [0, 0, -1, -5], [0, 1, 0, 0], [0, 0, 0, 1]]), abs=1e-12
    )
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = 3
    assert load_scene(plotter).cameras[0].height == 6


def test_scalars_of_cells_and_hidden_actors(plotter):
    plane = pyvista.Plane(i_resolution=2, j_resolution=1)
    plane.cell_data["side"] = [0.0, 1.0]
    plotter.add_mesh(plane, scalars="side", cmap=["black", "white"])
    plotter.add_mesh(pyvista.Cube()).visibility = False
    (mesh,) = load_scene(plotter).description.meshes
    colors = mesh.colors[mesh.faces][:, :, 0]
    assert sorted(colors.mean(axis=1).tolist()) == [0, 0, 1, 1]


def test_blocks_keep_their_names_colours_and_opacities(plotter):
    inner = pyvista.MultiBlock({"ball": pyvista.Sphere(), "none": None, "cone": pyvista.Cone()})
    _, mapper = plotter.add_composite(pyvista.MultiBlock({"box": pyvista.Cube(), "inner": inner}), color="red")
    mapper.block_attr[1].opacity = 0.25
    mapper.block_attr[2].color = "blue"  # of the group, and so of what is in it
    mapper.block_attr[5].visible = False
    description = load_scene(plotter).description
    assert [mesh.name for mesh in description.meshes] == ["MultiBlock/box", "MultiBlock/inner/ball"]
    box, ball = description.materials
    assert (box.base_color, box.alpha) == ((1, 0, 0), 0.25)
    assert (ball.base_color, ball.alpha) == ((0, 0, 1), 1)


@pytest.mark.parametrize("way", ["add_mesh", "add_composite"])
def test_blocks_however_they_are_added(plotter, way):
    getattr(plotter, way)(pyvista.MultiBlock([pyvista.Sphere(), pyvista.Cube(center=(1.5, 0, 0))]))
    assert len(load_scene(plotter).description.meshes) == 2


def test_what_is_not_taken_over_is_named(plotter):
    plotter.add_mesh(pyvista.Sphere(), name="net", style="wireframe")
    plotter.add_mesh(pyvista.Cube(), name="box", show_edges=True, culling="back", backface_params={"color": "red"})
    plotter.add_mesh_clip_plane(pyvista.Cone(), name="cut", normal="x")
    plotter.set_background("black", top="white")
    notes = load_scene(plotter).notes
    assert "'net': lines or points in place of the surface: not taken over" in notes
    assert "'box': edges, culling, the look of its back: not taken over" in notes
    assert "the plotter's background is shown in one colour" in notes


def test_images_whose_extent_does_not_begin_at_0(plotter, tmp_path):
    import vtk

    image = pyvista.ImageData(dimensions=(6, 5, 4), spacing=(0.5, 1, 2), origin=(1, 2, 3))
    image.direction_matrix = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    image["density"] = np.arange(120.0)
    cut = vtk.vtkExtractVOI()
    cut.SetInputData(image)
    cut.SetVOI(2, 5, 1, 4, 3, 3)
    cut.Update()
    part = pyvista.wrap(cut.GetOutput())
    part.save(tmp_path / "part.vti")
    plotter.add_volume(part)
    for source in (part, tmp_path / "part.vti", plotter):
        volume = load_scene(source).description.volume
        assert volume.world_from_voxel[:3, 3] == pytest.approx(part.GetPoint(0))
        assert volume.world_from_voxel @ (1, 0, 0, 1) == pytest.approx((*part.GetPoint(1), 1))


@pytest.mark.parametrize(("of_points", "flag"), [(True, 2), (False, 32)])
def test_hidden_voxels_count_as_the_lowest(of_points, flag):
    image = pyvista.ImageData(dimensions=(3, 3, 3))
    data = image.point_data if of_points else image.cell_data
    values = np.arange(1.0, 28.0 if of_points else 9.0)
    data["v"], ghosts = values, np.zeros(len(values), np.uint8)
    ghosts[-2:] = flag
    ghosts[0] = 1  # of a neighbouring piece, and shown
    data["vtkGhostType"] = ghosts
    image.set_active_scalars("v")
    scene = load_scene(image).description
    assert any("2 voxels are no finite numbers" in note for note in scene.notes)
    assert scene.volume.grid.ravel()[[0, -1]].tolist() == [1.0, 1.0]


def test_a_volume_of_a_plotter(plotter):
    image = pyvista.ImageData(dimensions=(5, 4, 3), spacing=(1, 2, 3), origin=(7, 8, 9))
    image["density"] = np.arange(60.0)
    plotter.add_volume(image, cmap=["black", "white"], opacity="linear", shade=True)
    volume = load_scene(plotter).description.volume
    assert volume.size == (5, 4, 3)
    assert volume.world_from_voxel[:3, 3].tolist() == [7, 8, 9]
    assert volume.transfer.opacities[0] == 0
    assert volume.transfer.opacities[-1] > 0.5
    assert volume.transfer.shading == 1


def test_an_empty_plotter_is_refused(plotter):
    with pytest.raises(SceneError, match="the plotter shows no surface and no volume"):
        load_scene(plotter)


@pytest.mark.slow
def test_a_plotter_is_rendered(engine, plotter):
    plotter.add_mesh(pyvista.Sphere(), color="red")
    image = lippmann.render(plotter, "seed-lenticular", spp=1, method="full")
    assert image.pixels[200:300, 200:300, 0].mean() > 4 * image.pixels[200:300, 200:300, 1].mean()


def wavelet():
    return pyvista.ImageData(dimensions=(4, 3, 2), spacing=(1, 2, 3), origin=(5, 6, 7))


@pytest.mark.slow
def test_files(tmp_path):
    sphere = pyvista.Sphere()
    sphere["height"] = sphere.points[:, 2]
    for name in ("a.vtp", "a.vtk"):
        sphere.save(tmp_path / name)
        scene = load_scene(tmp_path / name)
        assert any("the scalars 'height' from -0.5 to 0.5 are coloured by viridis" in note for note in scene.notes)
        (mesh,) = scene.description.meshes
        top = np.argmax(mesh.positions[:, 2])
        assert mesh.colors[top, :3] == pytest.approx(decode_srgb(np.array([253, 231, 36]) / 255), abs=1e-3)
    wavelet().cast_to_unstructured_grid().save(tmp_path / "a.vtu")
    assert load_scene(tmp_path / "a.vtu").bounds.tolist() == [[5, 6, 7], [8, 10, 10]]
    image = wavelet()
    image.cell_data["v"] = np.arange(6.0)
    image.save(tmp_path / "a.vti")
    volume = load_scene(tmp_path / "a.vti").description.volume
    assert (volume.size, volume.world_from_voxel[:3, 3].tolist()) == ((3, 2, 1), [5.5, 7, 8.5])
    assert volume.grid.ravel().tolist() == [0, 1, 2, 3, 4, 5]


def test_colours_of_a_file_are_its_own(tmp_path):
    """Bytes of four channels with their opacity; a table of colours that a file of the older kind brings along."""
    sheet = pyvista.Plane(i_resolution=1, j_resolution=1)
    sheet["rgba"] = np.array([[255, 0, 0, 255], [255, 0, 0, 51]] * 2, np.uint8)
    sheet.set_active_scalars("rgba")
    sheet.save(tmp_path / "a.vtp")
    scene = load_scene(tmp_path / "a.vtp").description
    assert scene.materials[0].alpha_mode == "blend"
    assert sorted(scene.meshes[0].colors[:, 3].tolist()) == pytest.approx([0.2, 0.2, 1, 1])
    head = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n"
    table = "SCALARS heat float 1\nLOOKUP_TABLE own\n0 5 10\nLOOKUP_TABLE own 3\n1 0 0 1\n0 1 0 1\n0 0 1 1\n"
    (tmp_path / "b.vtk").write_text(head + "POLYGONS 1 4\n3 0 1 2\nPOINT_DATA 3\n" + table)
    scene = load_scene(tmp_path / "b.vtk").description
    assert scene.meshes[0].colors[:, :3].tolist() == np.eye(3).tolist()
    assert "the scalars 'heat' from 0 to 10 are coloured by their own 3 colours" in scene.notes


def test_lines_and_points_beside_a_surface_are_named_and_take_none_of_its_colours(plotter):
    """VTK counts cells from points over lines to polygons: the scalars of the last two are those of the triangles."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (2, 2, 0)], np.float32)
    mixed = pyvista.PolyData(corners, faces=[3, 0, 1, 2, 3, 1, 3, 2], lines=[2, 3, 4], verts=[1, 4])
    mixed.cell_data["heat"] = np.array([9.0, 8.0, 1.0, 2.0])
    mixed.set_active_scalars("heat", preference="cell")
    scene = load_scene(mixed)
    (mesh,) = scene.description.meshes
    alone = pyvista.PolyData(corners[:4], faces=[3, 0, 1, 2, 3, 1, 3, 2])
    alone.cell_data["heat"] = np.array([1.0, 2.0])
    alone.set_active_scalars("heat", preference="cell")
    np.testing.assert_array_equal(mesh.colors, load_scene(alone).description.meshes[0].colors)
    told = "beside the surface, points (1) and lines (1) are not shown"
    assert told in scene.notes
    plotter.add_mesh(mixed, name="both")
    assert any(note.endswith(told) for note in load_scene(plotter).notes)


def test_clouds_of_points_are_drawn_as_balls(plotter, tmp_path):
    """From an object, a file and a plotter, in the colours of their scalars."""
    cloud = pyvista.PolyData(np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0)], np.float32))
    cloud["heat"] = np.array([0.0, 1.0, 2.0])
    cloud.save(tmp_path / "a.vtp")
    plotter.add_mesh(cloud, name="scan", style="points", cmap="viridis")
    for source in (cloud, tmp_path / "a.vtp", plotter):
        scene = load_scene(source)
        (mesh,) = scene.description.meshes
        assert mesh.points  # of balls
        assert mesh.positions.reshape(3, -1, 3).mean(axis=1) == pytest.approx(cloud.points, abs=1e-5)
        assert scene.description.materials[mesh.material].unlit
        yellow = decode_srgb(np.array([253, 231, 36]) / 255)  # viridis at its end
        if mesh.colors is not None:  # else by a texture, as the plotter has it
            assert mesh.colors.reshape(3, -1, mesh.colors.shape[1])[2, 0, :3] == pytest.approx(yellow, abs=0.01)
        assert (mesh.colors is None) == (len(mesh.uvs) == 1) == (source is plotter)
        assert any("points are drawn as balls" in note for note in scene.notes)
        assert not any("lines or points" in note for note in scene.notes)


def test_spheres_and_tubes_are_as_wide_as_at_the_focus_and_shaded(plotter):
    plotter.add_points(np.eye(3), render_points_as_spheres=True, point_size=20)
    plotter.add_mesh(pyvista.Line(), line_width=10, render_lines_as_tubes=True)
    plotter.enable_parallel_projection()
    plotter.camera.position, plotter.camera.focal_point, plotter.camera.parallel_scale = (0, 0, 9), (0, 0, 0), 2
    scene = load_scene(plotter).description
    pixel = 4 / plotter.window_size[1]
    balls, rod = scene.meshes
    assert np.ptp(balls.positions.reshape(3, -1, 3), axis=1).max() == pytest.approx(20 * pixel, rel=0.02)
    assert np.ptp(rod.positions[:, 1:], axis=0).max() == pytest.approx(10 * pixel, rel=0.02)
    assert not any(material.unlit for material in scene.materials)


def test_a_surface_of_one_value_has_the_first_colour(plotter):
    """As a contour at one level has, whose colour map has no range."""
    plane = pyvista.Plane(i_resolution=1, j_resolution=1)
    plane.point_data["level"] = [7.0] * 4
    plotter.add_mesh(plane, cmap="viridis")
    scene = load_scene(plotter).description
    assert np.isfinite(scene.meshes[0].uvs[0]).all()
    assert scene.materials[0].base_color_texture.image.pixels[-1, 128, :3].tolist() == [68, 1, 84]


@pytest.mark.parametrize("of_cells", [False, True], ids=["points", "cells"])
def test_lines_alone_are_drawn_as_rods(plotter, tmp_path, of_cells):
    """Streamlines, from an object, a file and a plotter: two pieces and one, in the colours of their scalars."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 3, 0), (2, 3, 0)], np.float32)
    lines = pyvista.PolyData(corners, lines=[3, 0, 1, 2, 2, 3, 4])
    table = lines.cell_data if of_cells else lines.point_data
    table["speed"] = np.array([0.0, 1.0] if of_cells else [0.0, 0.0, 0.0, 1.0, 1.0])
    lines.set_active_scalars("speed")
    lines.save(tmp_path / "a.vtp")
    lines.cast_to_unstructured_grid().save(tmp_path / "a.vtu")
    plotter.add_mesh(lines, name="streams", cmap="viridis", interpolate_before_map=False)
    for source in (lines, tmp_path / "a.vtp", tmp_path / "a.vtu", plotter):
        scene = load_scene(source)
        (mesh,) = scene.description.meshes
        pieces = mesh.positions.reshape(3, -1, 3)
        assert pieces.mean(axis=1) == pytest.approx(np.array([(0.5, 0, 0), (1.5, 0, 0), (1, 3, 0)]), abs=1e-5)
        yellow = decode_srgb(np.array([253, 231, 36]) / 255)
        colors = mesh.colors.reshape(3, pieces.shape[1], -1)[..., :3]
        assert colors[2] == pytest.approx(np.tile(yellow, (pieces.shape[1], 1)), abs=0.01)
        assert colors[:2].max() < 0.1
        assert scene.description.materials[mesh.material].unlit
        assert any("lines are drawn as rods" in note for note in scene.notes)


def test_an_array_is_chosen_by_its_name(tmp_path):
    sphere = pyvista.Sphere()
    sphere["height"], sphere.cell_data["number"] = sphere.points[:, 2], np.arange(float(sphere.n_cells))
    sphere.set_active_scalars(None)
    image = wavelet()
    image["low"], image["high"] = np.arange(24.0), np.arange(24.0) + 100
    image.set_active_scalars(None)
    sphere.save(tmp_path / "a.vtp")
    image.save(tmp_path / "a.vti")
    scene = load_scene(tmp_path / "a.vtp")
    assert scene.description.meshes[0].colors is None
    assert any("none is shown of 'height', 'number' (series=NAME chooses one)" in note for note in scene.notes)
    assert any("up is taken as +y, for nothing in .vtp files says it" in note for note in scene.notes)
    for name, said in (("height", "from -0.5 to 0.5"), ("number", "from 0 to 1679")):
        scene = load_scene(tmp_path / "a.vtp", series=name)
        assert any(f"the scalars '{name}' {said} are coloured" in note for note in scene.notes)
        assert not any("none is shown" in note for note in scene.notes)
    assert load_scene(tmp_path / "a.vti", series="high").description.volume.grid.ravel()[0] == 100
    with pytest.raises(LippmannError, match=r"a\.vti: series: 'other'.*the file has 'low', 'high'"):
        load_scene(tmp_path / "a.vti", series="other")


def test_arrays_that_not_all_blocks_have_are_named():
    sphere = pyvista.Sphere()
    sphere["height"] = sphere.points[:, 2]
    both = pyvista.MultiBlock([sphere, pyvista.Cube(center=(2, 0, 0))])
    said = "none of its arrays is active in all of it, so that none is shown of 'height'"
    assert any(note.startswith(said) for note in load_scene(both).notes)
    assert not any("none is shown" in note for note in load_scene(sphere).notes)
    assert not any("none is shown" in note for note in load_scene(pyvista.MultiBlock([sphere, sphere])).notes)


def test_grids_of_other_kinds(tmp_path):
    steps = [np.array([0.0, 1.0, 3.0])] * 3
    grid = pyvista.RectilinearGrid(*steps)
    grid.save(tmp_path / "a.vtr")
    pyvista.StructuredGrid(*np.meshgrid(*steps, indexing="ij")).save(tmp_path / "a.vts")
    for name in ("a.vtr", "a.vts"):
        assert load_scene(tmp_path / name).bounds.tolist() == [[0, 0, 0], [3, 3, 3]]
    pyvista.MultiBlock([grid]).save(tmp_path / "a.vtm")
    with pytest.raises(SceneError, match=r"a\.vtm: .*combine\(\)\.save"):
        load_scene(tmp_path / "a.vtm")


def test_damaged_files_are_refused_in_one_line(tmp_path):
    pyvista.Sphere().save(tmp_path / "a.vtp")
    data = (tmp_path / "a.vtp").read_bytes()
    for name, content in [
        ("a.vtp", data[: len(data) // 3]),
        ("a.vtk", b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 99999999999 float\n0 0 0\n"),
        ("a.vtu", b"<VTKFile type='UnstructuredGrid'></VTKFile>"),
        ("a.vti", b"nothing"),
    ]:
        (tmp_path / name).write_bytes(content)
        with pytest.raises(LippmannError, match=name) as error:
            load_scene(tmp_path / name)
        assert "\n" not in str(error.value)
        assert str(tmp_path) not in str(error.value)


def test_without_the_library_the_line_says_how_to_get_it(tmp_path, monkeypatch):
    (tmp_path / "a.vtp").write_bytes(b"<VTKFile>")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(SceneError, match=r"pyvista is not installed; VTK's files need it"):
        load_scene(tmp_path / "a.vtp")
