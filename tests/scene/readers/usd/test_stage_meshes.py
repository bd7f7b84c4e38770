"""Meshes of stages: polygons, values of every interpolation, subsets, places of copies."""

import numpy as np
import pytest

from lippmann.errors import SceneError

from .conftest import triangle


def corners(mesh):
    return mesh.positions[mesh.faces]


def world_corners(scene):
    """Corners ``(n, 3, 3)`` of all triangles where they are placed."""
    found = []
    for instance in scene.instances:
        mesh = scene.meshes[instance.mesh]
        for world in np.reshape(instance.world_from_mesh, (-1, 4, 4)):
            found.append(corners(mesh) @ world[:3, :3].T + world[:3, 3])
    return np.concatenate(found)


def facing(triangles):
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def test_a_triangle(read):
    scene = read(triangle())
    (mesh,) = scene.meshes
    assert corners(mesh).tolist() == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]
    assert mesh.normals is None
    assert scene.notes == []


def test_left_handed_meshes_are_turned_round(read):
    scene = read(triangle("r") + triangle("l", 'uniform token orientation = "leftHanded"'))
    right, left = (facing(corners(mesh))[0, 2] for mesh in scene.meshes)
    assert (right, left) == (1, -1)


def test_polygons_and_holes(read):
    body = """
def Mesh "m" {
    point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, 0.5, 0), (0, 2, 0), (5, 0, 0), (6, 0, 0), (5, 1, 0)]
    int[] faceVertexCounts = [5, 3, 2]
    int[] faceVertexIndices = [0, 1, 2, 3, 4, 5, 6, 7, 0, 1]
    int[] holeIndices = [1]
    uniform token subdivisionScheme = "none"
}
"""
    (mesh,) = read(body).meshes
    triangles = corners(mesh)
    areas = facing(triangles)[:, 2] / 2
    assert (areas > 0).all()
    # The square of side 2 without the notch of 2 x 1.5 / 2.
    assert areas.sum() == pytest.approx(4 - 1.5)
    assert triangles[..., 0].max() == 2


QUADS = """
def Mesh "m" {{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)]
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 1, 4, 5, 2]
    uniform token subdivisionScheme = "none"
    {}
}}
"""


@pytest.mark.parametrize(
    ("interpolation", "values", "expected"),
    [
        ("constant", [(1, 0, 0)], lambda x, y, right: (1, 0, 0)),
        ("uniform", [(1, 0, 0), (0, 1, 0)], lambda x, y, right: (0, 1, 0) if right else (1, 0, 0)),
        ("vertex", [(x, y, 0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (2, 1))], lambda x, y, r: (x, y, 0)),
        (
            "varying",
            [(x, y, 0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (2, 1))],
            lambda x, y, r: (x, y, 0),
        ),
        (
            "faceVarying",
            [(0, x, y) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1), (1, 0), (2, 0), (2, 1), (1, 1))],
            lambda x, y, r: (0, x, y),
        ),
    ],
)
def test_display_colours_of_every_interpolation(read, interpolation, values, expected):
    text = f'color3f[] primvars:displayColor = {values} (interpolation = "{interpolation}")'
    (mesh,) = read(QUADS.format(text)).meshes
    for face in mesh.faces:
        right = mesh.positions[face, 0].max() > 1.5
        for vertex in face:
            x, y, _ = mesh.positions[vertex]
            assert mesh.colors[vertex] == pytest.approx(expected(x, y, right))


def test_indexed_normals_of_faces(read):
    text = (
        'normal3f[] primvars:normals = [(0, 0, 1), (1, 0, 0)] (interpolation = "faceVarying")\n'
        "int[] primvars:normals:indices = [0, 0, 0, 0, 1, 1, 1, 1]"
    )
    (mesh,) = read(QUADS.format(text)).meshes
    for face in mesh.faces:
        right = mesh.positions[face, 0].max() > 1.5
        assert mesh.normals[face] == pytest.approx(np.tile([1, 0, 0] if right else [0, 0, 1], (3, 1)))


def test_values_that_do_not_fit_are_refused(read):
    text = 'normal3f[] normals = [(0, 0, 1), (1, 0, 0)] (interpolation = "vertex")'
    with pytest.raises(SceneError, match=r"^stage\.usda: mesh /m has 2 normals, vertex, which do not fit it$"):
        read(QUADS.format(text))


def test_corners_beyond_the_points_are_refused(read):
    body = QUADS.format("").replace("4, 5, 2]", "4, 50, 2]")
    with pytest.raises(SceneError, match=r"mesh /m uses point 50 of 6"):
        read(body)


def test_subsets_have_their_own_materials(read):
    material = """
def Material "{0}" {{
    token outputs:surface.connect = </{0}/s.outputs:surface>
    def Shader "s" {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = ({1})
        token outputs:surface
    }}
}}
"""
    subset = """
    rel material:binding = </one>
    def GeomSubset "right" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
        rel material:binding = </two>
    }
"""
    body = QUADS.format(subset).replace('"m" {', '"m" (prepend apiSchemas = ["MaterialBindingAPI"]) {', 1)
    scene = read(body + material.format("one", "1, 0, 0") + material.format("two", "0, 0, 1"))
    found = {scene.materials[mesh.material].base_color: mesh.positions[:, 0].max() for mesh in scene.meshes}
    assert found == {(1, 0, 0): 1, (0, 0, 1): 2}


@pytest.mark.parametrize(("quads", "levels"), [(2, 4), (129, 3), (513, 2)])
def test_cages_are_refined_by_default(read, quads, levels):
    """Small ones more than large ones."""
    points = [(x, y, 0) for x in range(quads + 1) for y in range(2)]
    indices = [2 * x + corner for x in range(quads) for corner in (0, 2, 3, 1)]
    counts = f"int[] faceVertexCounts = {[4] * quads}\nint[] faceVertexIndices = {indices}"
    (mesh,) = read(f'def Mesh "m" {{\npoint3f[] points = {points}\n{counts}\n}}').meshes
    assert len(mesh.faces) == quads * 4**levels * 2
    assert mesh.normals == pytest.approx(np.tile([0, 0, 1], (len(mesh.positions), 1)))
    # Points that one face alone uses stay where they are.
    assert mesh.positions.max(axis=0).tolist() == [quads, 1, 0]


def test_units_and_the_up_axis(read):
    head = '#usda 1.0\n(\n    upAxis = "Z"\n    metersPerUnit = 100\n)\n'
    scene = read(triangle(), head=head)
    # x stays, z is up, y leads away from the viewer.
    assert world_corners(scene)[0] == pytest.approx(np.array([[0, 0, 0], [100, 0, 0], [0, 0, -100]]))


def test_hidden_prims_and_guides_are_not_shown(read):
    scene = read(
        triangle("seen")
        + triangle("hidden", 'token visibility = "invisible"')
        + triangle("guide", 'uniform token purpose = "guide"')
    )
    assert [mesh.name for mesh in scene.meshes] == ["/seen"]


def test_the_purpose_of_a_prim_wins_over_that_of_what_holds_it(read):
    scene = read(
        'def Xform "proxies" (\n) {\nuniform token purpose = "proxy"\n'
        + triangle("inherits")
        + triangle("own", 'uniform token purpose = "render"')
        + "}"
    )
    assert [mesh.name for mesh in scene.meshes] == ["/proxies/own"]


def test_the_surface_of_tetrahedra_is_shown(read):
    """Two that share a face, as OpenUSD's own tests have them: six of their eight faces are seen."""
    body = (
        'def TetMesh "t" {\npoint3f[] points = [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2), (0, 0, -2)]\n'
        "int4[] tetVertexIndices = [(0, 1, 2, 3), (0, 2, 1, 4)]\n"
        'color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (interpolation = "uniform")\n'
        "MORE}\n"
    )
    faces = [(0, 1, 3), (0, 2, 4), (0, 3, 2), (0, 4, 1), (1, 2, 3), (2, 1, 4)]
    for more in ("", f"int3[] surfaceFaceVertexIndices = {faces}\n"):
        (mesh,) = read(body.replace("MORE", more)).meshes
        corners = mesh.positions[mesh.faces]
        volume = np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        assert len(mesh.faces) == 6
        assert volume == pytest.approx(8 / 3)  # they face outwards


PRIMITIVES = {
    "Sphere": ("double radius = 2", (4, 4, 4), 4 / 3 * np.pi * 8),
    "Cube": ("double size = 2", (2, 2, 2), 8),
    "Cylinder": ('double height = 3\ndouble radius = 1\nuniform token axis = "X"', (3, 2, 2), 3 * np.pi),
    "Cone": ('double height = 3\ndouble radius = 1\nuniform token axis = "Y"', (2, 3, 2), np.pi),
    "Capsule": ('double height = 1\ndouble radius = 1\nuniform token axis = "Z"', (2, 2, 3), np.pi + 4 / 3 * np.pi),
}


@pytest.mark.parametrize("kind", PRIMITIVES)
def test_primitives_are_closed_and_as_large_as_their_numbers_say(read, kind):
    numbers, size, volume = PRIMITIVES[kind]
    scene = read(f'def {kind} "p" {{\n{numbers}\n}}')
    (mesh,) = scene.meshes
    triangles = world_corners(scene).astype(float)
    assert np.ptp(triangles.reshape(-1, 3), axis=0) == pytest.approx(size, rel=2e-3)
    # The divergence theorem: outward faces only.
    assert np.linalg.det(triangles).sum() / 6 == pytest.approx(volume, rel=5e-3)
    normals = mesh.normals[mesh.faces].mean(axis=1)
    area = facing(triangles)
    sizes = np.linalg.norm(area, axis=1) * np.linalg.norm(normals, axis=1)
    assert (np.einsum("ij,ij->i", area, normals) >= 0.98 * sizes - 1e-9).all()


def test_a_plane_lies_across_its_axis(read):
    (mesh,) = read('def Plane "p" {\ndouble width = 4\ndouble length = 2\nuniform token axis = "Y"\n}').meshes
    assert np.ptp(mesh.positions, axis=0).tolist() == [4, 0, 2]
    assert (facing(corners(mesh))[:, 1] > 0).all()


def test_scenegraph_instances_share_their_mesh(read):
    body = 'def Xform "proto" {\n' + triangle("m") + "}\n"
    for number in range(3):
        body += (
            f'def Xform "copy{number}" (instanceable = true\nprepend references = </proto>) {{\n'
            f"double3 xformOp:translate = ({number + 1}, 0, 0)\n"
            'uniform token[] xformOpOrder = ["xformOp:translate"]\n}\n'
        )
    scene = read(body)
    shared = [instance for instance in scene.instances if np.shape(instance.world_from_mesh) == (3, 4, 4)]
    assert len(shared) == 1
    assert shared[0].world_from_mesh[:, 0, 3].tolist() == [1, 2, 3]
    assert len(scene.meshes) == 2  # the prototype itself, and what its copies share


def test_point_instancers_place_copies(read):
    body = (
        """
def PointInstancer "many" {
    point3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 0, 0)]
    int[] protoIndices = [0, 1, 0, 0]
    float3[] scales = [(1, 1, 1), (2, 2, 2), (1, 1, 1), (3, 3, 3)]
    int64[] invisibleIds = [2]
    rel prototypes = [</many/a>, </many/b>]
    double3 xformOp:translate = (0, 10, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
"""
        + triangle("a")
        + triangle("b", 'double3 xformOp:translate = (0, 0, 5)\nuniform token[] xformOpOrder = ["xformOp:translate"]')
        + "}"
    )
    scene = read(body)
    assert [mesh.name for mesh in scene.meshes] == ["/many/a", "/many/b"]
    first, second = (np.reshape(instance.world_from_mesh, (-1, 4, 4)) for instance in scene.instances)
    assert first[:, :3, 3].tolist() == [[1, 10, 0], [4, 10, 0]]
    assert [matrix[0, 0] for matrix in first] == [1, 3]
    # The prototype's own translation is scaled with its copy.
    assert second[:, :3, 3].tolist() == [[2, 10, 10]]


@pytest.mark.parametrize(("holder", "copies"), [("over", 2), ("class", 0)])
def test_prototypes_below_an_over_are_placed_and_not_shown_by_themselves(read, holder, copies):
    """As UsdImaging populates them; abstract prims are none."""
    body = triangle("seen") + f'{holder} "apart" {{\n' + triangle("a") + "}\n"
    body += 'def PointInstancer "many" {\npoint3f[] positions = [(1, 0, 0), (2, 0, 0)]\nint[] protoIndices = [0, 0]\n'
    scene = read(body + "rel prototypes = </apart/a>\n}\n")
    places = [np.reshape(each.world_from_mesh, (-1, 4, 4))[:, 0, 3].tolist() for each in scene.instances]
    assert places == [[0], [1, 2]][: 1 + copies // 2]
    lost = "/apart/a: a prototype that is abstract or not there; its copies are left out"
    assert scene.notes == ([] if copies else [lost])


def test_colours_at_the_points_of_shapes_by_numbers_are_told_of(read):
    colors = 'color3f[] primvars:displayColor = [(1, 0, 0), (0, 0, 1)] (interpolation = "vertex")'
    scene = read(f'def Cube "c" {{\n{colors}\n}}')
    assert scene.meshes[0].colors[0].tolist() == [1, 0, 0]
    assert scene.notes == ["/c: of its 2 display colours the first is shown"]


def test_copies_have_the_display_colours_that_they_inherit(read):
    copies = "".join(
        f'def Xform "{name}" (instanceable = true\n prepend references = </kept>) {{\n'
        f'color3f[] primvars:displayColor = [{color}] (interpolation = "constant")\n}}\n'
        for name, color in (("red", "(1, 0, 0)"), ("blue", "(0, 0, 1)"))
    )
    scene = read('class "kept" {' + triangle() + "}\n" + copies)
    assert [mesh.colors[0].tolist() for mesh in scene.meshes] == [[1, 0, 0], [0, 0, 1]]


INSTANCER = """
def PointInstancer "many" {{
    point3f[] positions = [{positions}]
    int[] protoIndices = [{kinds}]
    color3f[] primvars:displayColor = [{colors}] (interpolation = "vertex")
    rel prototypes = [</many/a>, </many/b>]
"""


def test_colours_of_copies_are_those_of_prototypes_without_their_own(read):
    head = INSTANCER.format(
        positions="(1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 0, 0)",
        kinds="0, 0, 0, 1",
        colors="(1, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 0)",
    )
    scene = read(head + triangle("a") + triangle("b", "color3f[] primvars:displayColor = [(0, 1, 0)]") + "}")
    shown = {
        tuple(scene.meshes[each.mesh].colors[0].tolist()): np.reshape(each.world_from_mesh, (-1, 4, 4))[
            :, 0, 3
        ].tolist()
        for each in scene.instances
    }
    assert shown == {(1, 0, 0): [1, 3], (0, 0, 1): [2], (0, 1, 0): [4]}
    assert scene.notes == []


def test_many_colours_of_copies_are_rounded(read):
    count = 300
    places = ", ".join(f"({n}, 0, 0)" for n in range(count))
    colors = ", ".join(f"({n / count}, 0.5, 1)" for n in range(count))
    head = INSTANCER.format(positions=places, kinds=", ".join(["0"] * count), colors=colors)
    scene = read(head + triangle("a") + triangle("b") + "}")
    red = {
        round(float(mesh.colors[0, 0]), 1): instance
        for mesh, instance in zip(scene.meshes, scene.instances, strict=True)
    }
    assert sorted(red) == [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    assert sum(len(each.world_from_mesh) for each in red.values()) == count
    assert scene.notes == ["/many: colours of copies are rounded to those of six steps a channel"]


def test_instancers_that_hold_themselves_end(read):
    body = (
        'def PointInstancer "a" {\npoint3f[] positions = [(1, 0, 0)]\nint[] protoIndices = [0]\n'
        "rel prototypes = [</holder>]\n}\n"
        'def Xform "holder" {\ndef PointInstancer "b" {\npoint3f[] positions = [(1, 0, 0)]\nint[] protoIndices = [0]\n'
        "rel prototypes = [</holder>]\n}\n}\n"
    )
    with pytest.raises(SceneError, match="instancers within instancers"):
        read(triangle() + body)


def test_copies_beyond_all_bounds_are_refused(read):
    """Instancers within instancers multiply: sixteen thousand, then as many of each."""
    many = f"point3f[] positions = {[(0, 0, 0)] * 16384}\nint[] protoIndices = {[0] * 16384}\n"
    body = (
        f'def PointInstancer "a" {{\n{many}rel prototypes = [</holder>]\n}}\n'
        f'def Xform "holder" {{\ndef PointInstancer "b" {{\n{many}rel prototypes = [</m>]\n}}\n}}\n'
    )
    with pytest.raises(SceneError, match="places more than 2097152 copies of meshes"):
        read(triangle() + body)


def test_a_cage_without_faces_after_one_that_is_refined(read):
    smooth = triangle().replace('"none"', '"catmullClark"')
    empty = smooth.replace('"m"', '"empty"').replace("[3]", "[]").replace("[0, 1, 2]", "[]")
    assert len(read(smooth + empty).instances) == 1


@pytest.mark.parametrize(
    ("copies", "says"),
    [
        ("int[] protoIndices = [0, 0]\n", "has not one position for each copy"),
        ("int[] protoIndices = [0, 0]\npoint3f[] positions = [(1, 0, 0)]\n", "has not one position for each copy"),
        ("int[] protoIndices = [1]\npoint3f[] positions = [(1, 0, 0)]\n", "has copies of prototypes that it does not"),
    ],
)
def test_copies_without_places_or_prototypes_are_left_out(read, copies, says):
    body = f'def PointInstancer "p" {{\nrel prototypes = [</p/m>]\n{copies}{triangle()}}}\n'
    scene = read(body + triangle("other"))
    assert len(scene.instances) == 1
    assert [note.partition(says)[0] for note in scene.notes] == ["/p: "]


def test_what_is_not_drawn_is_named(read):
    curve = 'def HermiteCurves "c" {\nint[] curveVertexCounts = [2]\npoint3f[] points = [(0, 0, 0), (1, 0, 0)]\n}\n'
    assert read(triangle() + curve).notes == ["1 prim(s) of type HermiteCurves are not drawn"]


def test_schemas_that_change_what_is_shown_are_named(read):
    body = 'def Xform "x" (prepend apiSchemas = ["GeomModelAPI", "ColorSpaceAPI"]) {\n'
    body += 'uniform token model:drawMode = "cards"\nuniform token colorSpace:name = "lin_ap1_scene"\n'
    assert read(body + triangle() + "}").notes == [
        "/x: model:drawMode 'cards' is not honoured: meshes are shown",
        "/x: colours in the space 'lin_ap1_scene' are taken as linear Rec. 709",
    ]
    again = body.replace('"x"', '"z"').replace("lin_ap1_scene", "")
    assert read(body + triangle() + "}\n" + again + "}").notes[0].startswith("/x and 1 more: model:drawMode 'cards'")
    body = body.replace("cards", "default").replace("lin_ap1_scene", "lin_rec709_scene")
    image = 'def Shader "i" (prepend apiSchemas = ["ColorSpaceAPI"]) {\n'  # whose sourceColorSpace says so
    image += 'uniform token colorSpace:name = "srgb_rec709_display"\n}\n'
    assert read(body + triangle() + image + "}").notes == []


@pytest.mark.parametrize(("scheme", "flat"), [("none", True), ("bilinear", True), ("loop", False)])
def test_polygons_that_no_scheme_rounds_are_flat(read, scheme, flat):
    """The limit of bilinear subdivision is the polygons themselves."""
    (mesh,) = read(triangle().replace('"none"', f'"{scheme}"')).meshes
    assert (mesh.normals is None) == flat


def test_a_stage_without_meshes_is_refused(read):
    with pytest.raises(SceneError, match=r"^stage\.usda: the stage shows no meshes; a scene needs some$"):
        read('def Xform "x" {}')


def test_spheres_are_traced_as_balls_whose_size_is_in_their_places(read):
    """Copies share one mesh; spheres that differ share its triangles."""
    body = """
def PointInstancer "many" {
    int[] protoIndices = [0, 0, 0]
    point3f[] positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0)]
    float3[] scales = [(1, 1, 1), (1, 2, 1), (1, 1, 1)]
    rel prototypes = </many/ball>
    def Sphere "ball"
    {
        double radius = 0.25
    }
}
def Sphere "red"
{
    double radius = 3
    color3f[] primvars:displayColor = [(1, 0, 0)]
}
"""
    scene = read(body)
    copied, red = scene.meshes
    assert copied.stands_for == red.stands_for == "ball"
    assert copied.positions is red.positions
    assert np.linalg.norm(copied.positions, axis=1) == pytest.approx(1.0)
    places = scene.instances[0].world_from_mesh
    assert places[:, 0, 3].tolist() == [0, 1, 2]
    assert np.diagonal(places, axis1=1, axis2=2)[:, :3].tolist() == [[0.25] * 3, [0.25, 0.5, 0.25], [0.25] * 3]
    assert scene.instances[1].world_from_mesh[0, 0] == 3
    assert (red.colors == (1, 0, 0)).all()


@pytest.mark.parametrize(
    ("interpolation", "values", "vertices"),
    [("constant", 1, 6), ("vertex", 6, 6), ("uniform", 2, 8), ("faceVarying", 8, 8)],
)
def test_faces_share_the_vertices_whose_values_they_share(read, interpolation, values, vertices):
    colors = ", ".join(f"({number}, 0, 0)" for number in range(values))
    color = f'color3f[] primvars:displayColor = [{colors}] (interpolation = "{interpolation}")'
    (mesh,) = read(QUADS.format(color)).meshes
    assert len(mesh.positions) == vertices
