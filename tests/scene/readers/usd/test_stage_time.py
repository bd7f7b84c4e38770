"""Stages in time: time samples, skinned meshes, blend shapes, and variants."""

import numpy as np
import pytest

from lippmann.errors import SceneError, UsageError
from lippmann.scene.readers.load import load_scene
from lippmann.scene.readers.usd.moving_stage import MovingStage
from lippmann.sequences.motion import open_motion

from .conftest import HEAD, triangle

TIMED = HEAD.replace("(\n", "(\n    startTimeCode = 10\n    endTimeCode = 58\n    timeCodesPerSecond = 24\n", 1)

MOVES = """
double3 xformOp:translate.timeSamples = { 10: (0, 0, 0), 58: (4, 0, 0) }
uniform token[] xformOpOrder = ["xformOp:translate"]
"""


@pytest.fixture
def stage(tmp_path):
    def save(body, head=TIMED):
        path = tmp_path / "moving.usda"
        path.write_text(head + body)
        return path

    return save


def place(scene):
    return np.reshape(scene.instances[0].world_from_mesh, (4, 4))[:3, 3].tolist()


def test_time_samples(stage):
    path = stage(triangle(more=MOVES))
    moving = MovingStage(path)
    assert moving.duration == 2
    assert [place(moving.at(seconds))[0] for seconds in (0, 0.5, 2, 9)] == [0, 1, 4, 4]
    rest = load_scene(path).description
    assert place(rest) == [0, 0, 0]
    assert rest.notes == ["time samples are not played without frames=...; the stage is shown at its beginning"]
    assert load_scene(stage(triangle())).description.notes == []


def test_a_motion_of_a_stage(stage):
    motion = open_motion(stage(triangle(more=MOVES)), fps=2)
    assert motion.count == 5
    assert motion.bounds().tolist() == [[0, 0, 0], [5, 1, 0]]
    assert place(motion.scene(1).description) == [1, 0, 0]
    before = motion.content
    assert str(before) != ""


def test_content_tells_stages_apart(stage):
    first = MovingStage(stage(triangle(more=MOVES))).content
    assert MovingStage(stage(triangle(more=MOVES))).content == first
    assert MovingStage(stage(triangle(more=MOVES.replace("4, 0, 0", "5, 0, 0")))).content != first


def test_a_stage_without_time_codes_does_not_move(stage):
    with pytest.raises(SceneError, match="the stage has no range of time codes"):
        MovingStage(stage(triangle(), head="#usda 1.0\n"))
    with pytest.raises(SceneError, match="a USD stage has one timeline"):
        MovingStage(stage(triangle(more=MOVES)), animation="walk")


SKINNED = """
def SkelRoot "rig" {
    double3 xformOp:translate = (0, 0, 1)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Skeleton "bones" (prepend apiSchemas = ["SkelBindingAPI"]) {
        uniform token[] joints = ["a", "b"]
        uniform matrix4d[] bindTransforms = [UNIT, UNIT]
        uniform matrix4d[] restTransforms = [UNIT, UNIT]
        rel skel:animationSource = </rig/walk>
    }
    def SkelAnimation "walk" {
        uniform token[] joints = ["b"]
        float3[] translations.timeSamples = { 10: [(0, 0, 0)], 58: [(0, 8, 0)] }
        quatf[] rotations = [(1, 0, 0, 0)]
        half3[] scales = [(1, 1, 1)]
        uniform token[] blendShapes = ["bulge"]
        float[] blendShapeWeights.timeSamples = { 10: [0], 58: [1] }
    }
    def Mesh "skin" (prepend apiSchemas = ["SkelBindingAPI"]) {
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        uniform token subdivisionScheme = "none"
        int[] primvars:skel:jointIndices = [0, 1, 0, 1, 0, 1] (
            elementSize = 2
            interpolation = "vertex"
        )
        float[] primvars:skel:jointWeights = [1, 0, 0.5, 0.5, 0, 1] (elementSize = 2
            interpolation = "vertex")
        rel skel:skeleton = </rig/bones>
        uniform token[] skel:blendShapes = ["bulge"]
        rel skel:blendShapeTargets = </rig/skin/bulge>
        def BlendShape "bulge" {
            uniform vector3f[] offsets = [(0, 0, 2)]
            uniform int[] pointIndices = [0]
        }
    }
}
"""


def test_skins_and_blend_shapes(stage):
    moving = MovingStage(stage(SKINNED.replace("UNIT", "((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))")))

    def points(seconds):
        scene = moving.at(seconds)
        (mesh,), (instance,) = scene.meshes, scene.instances
        world = np.reshape(instance.world_from_mesh, (4, 4))
        return (mesh.positions[mesh.faces[0]] @ world[:3, :3].T + world[:3, 3]).tolist()

    assert points(0) == [[0, 0, 1], [1, 0, 1], [0, 1, 1]]
    # Half-way: joint b rises by 4, which the second point follows by half; the shape lifts the first one by 1.
    assert points(1) == [[0, 0, 2], [1, 2, 1], [0, 5, 1]]


def test_normals_are_skinned_and_stay_sharp(stage):
    """Joint b turns by a quarter about z: the normal of what it holds turns from x to y; no others are rounded."""
    body = SKINNED.replace("UNIT", "((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))")
    body = body.replace("quatf[] rotations = [(1, 0, 0, 0)]", "quatf[] rotations = [(0.70710678, 0, 0, 0.70710678)]")
    normals = "normal3f[] normals = [(1, 0, 0), (0, 0, 1), (1, 0, 0)] (interpolation = %s)\n        point3f[] points"
    for interpolation in ('"vertex"', '"faceVarying"'):
        scene = MovingStage(stage(body.replace("point3f[] points", normals % interpolation))).at(0)
        (mesh,) = scene.meshes
        assert mesh.normals[mesh.faces[0]] == pytest.approx(np.array([[1, 0, 0], [0, 0, 1], [0, 1, 0]]), abs=1e-5)


VARIANTS = (
    'def Xform "chair" (variants = { string paint = "red" }\nprepend variantSets = "paint") {\nvariantSet "paint" = {\n'
    + '"red" {\n'
    + triangle("r")
    + '}\n"blue" {\n'
    + triangle("b")
    + "}\n}\n}\n"
)


@pytest.mark.parametrize(
    ("variants", "name"),
    [(None, "/chair/r"), ({"paint": "blue"}, "/chair/b"), ({"/chair:paint": "blue"}, "/chair/b")],
)
def test_variants(stage, variants, name):
    scene = load_scene(stage(VARIANTS, "#usda 1.0\n"), variants=variants).description
    assert [mesh.name for mesh in scene.meshes] == [name]


def test_variants_that_are_not_there_are_refused(stage):
    path = stage(VARIANTS, "#usda 1.0\n")
    with pytest.raises(SceneError, match=r"no prim has a variant 'green' of 'paint'; known are paint=blue\|red"):
        load_scene(path, variants={"paint": "green"})
    with pytest.raises(UsageError, match="has no variants"):
        load_scene("teapot", variants={"paint": "green"})


@pytest.mark.parametrize("span", ["startTimeCode = 224\n    endTimeCode = 224", ""])
def test_copies_with_velocities_in_a_stage_of_one_frame(read, span):
    """As Houdini writes a frame: samples for motion blur on both sides of it."""
    body = 'def PointInstancer "i" {\nint[] protoIndices = [0]\nrel prototypes = [</i/m>]\n'
    body += "point3f[] positions.timeSamples = { 223.5: [(0, 0, 0)], 224: [(1, 0, 0)] }\n"
    body += "vector3f[] velocities.timeSamples = { 223.5: [(48, 0, 0)], 224: [(48, 0, 0)] }\n"
    scene = read(body + triangle() + "}", head=HEAD.replace('"Y"', f'"Y"\n    timeCodesPerSecond = 24\n    {span}'))
    assert scene.instances[0].world_from_mesh[:3, 3].tolist() == ([1, 0, 0] if span else [0, 0, 0])
