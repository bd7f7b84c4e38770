"""Light sources and cameras of stages: radiances, areas, directions."""

import math

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from lippmann.scene.scene import Scene

from .conftest import triangle
from .test_stage_materials import png, surface


def test_a_distant_light(read):
    (light,) = read(
        triangle() + 'def DistantLight "sun" {\nfloat inputs:intensity = 1000\nfloat inputs:angle = 2\n}'
    ).lights
    assert light.kind == "directional"
    # Radiance times the projected solid angle of a disk of half-angle 1 degree.
    assert light.color == pytest.approx((1000 * math.pi * math.sin(math.radians(1)) ** 2,) * 3)


def test_a_normalized_distant_light_gives_its_irradiance(read):
    body = 'def DistantLight "sun" {\nfloat inputs:intensity = 3\nbool inputs:normalize = true\n'
    body += "float inputs:exposure = 1\n}"
    assert read(triangle() + body).lights[0].color == pytest.approx((6, 6, 6))


@pytest.mark.parametrize(
    ("mode", "emission", "base"),
    [
        ("materialGlowTintsLight", (0.5, 2, 0), (0.18,) * 3),
        ("independent", (2, 4, 0), (0.18,) * 3),
        ("noMaterialResponse", (2, 4, 0), (0,) * 3),
    ],
)
def test_meshes_that_are_light_sources(read, mode, emission, base):
    """A rectangle of the same light says how bright: both are 2 by 3 and normalized."""
    light = "float inputs:intensity = 24\ncolor3f inputs:color = (0.5, 1, 0)\nbool inputs:normalize = true\n"
    body = 'def Mesh "glow" (prepend apiSchemas = ["MeshLightAPI", "MaterialBindingAPI"]) {\n' + light
    body += (
        "point3f[] points = [(-1, -1.5, 0), (-1, 1.5, 0), (1, 1.5, 0), (1, -1.5, 0)]\nint[] faceVertexCounts = [4]\n"
    )
    body += 'int[] faceVertexIndices = [0, 1, 2, 3]\nuniform token subdivisionScheme = "none"\n'
    body += f'uniform token light:materialSyncMode = "{mode}"\nrel material:binding = </mat>\n}}\n'
    body += f'def RectLight "r" {{\n{light}float inputs:width = 2\nfloat inputs:height = 3\n}}\n'
    scene = read(surface("color3f inputs:emissiveColor = (0.25, 0.5, 1)") + body)
    glowing = {mesh.name: scene.materials[mesh.material] for mesh in scene.meshes}
    assert glowing["/glow"].emission == pytest.approx(emission)
    assert glowing["/glow"].base_color == pytest.approx(base)
    assert glowing["/r"].emission == pytest.approx((2, 4, 0))
    assert scene.physical_lights


def test_a_sphere_light(read):
    body = (
        'def SphereLight "bulb" {\nfloat inputs:intensity = 10\nfloat inputs:radius = 0.5\n'
        "color3f inputs:color = (1, 0.5, 0)\ndouble3 xformOp:translate = (1, 2, 3)\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n}'
    )
    (light,) = read(triangle() + body).lights
    assert light.kind == "point"
    assert light.radius == 0.5
    assert light.color == pytest.approx((10 * math.pi * 0.25, 5 * math.pi * 0.25, 0))
    assert light.world_from_light[:3, 3].tolist() == [1, 2, 3]


def test_a_scaled_sphere_is_larger_and_as_bright(read):
    body = 'def SphereLight "bulb" {\nfloat inputs:intensity = 10\nfloat inputs:radius = 0.5\n'
    body += 'float3 xformOp:scale = (4, 4, 4)\nuniform token[] xformOpOrder = ["xformOp:scale"]\n}'
    (light,) = read(triangle() + body).lights
    assert light.radius == pytest.approx(2)
    assert light.color == pytest.approx((10 * math.pi * 4,) * 3)


def test_a_shaped_light_is_a_spot(read):
    body = (
        'def SphereLight "spot" (prepend apiSchemas = ["ShapingAPI"]) {\nfloat inputs:shaping:cone:angle = 30\n'
        "float inputs:shaping:cone:softness = 0.25\nbool treatAsPoint = true\n}"
    )
    (light,) = read(triangle() + body).lights
    assert (light.kind, light.radius) == ("spot", 0)
    assert (math.degrees(light.outer_angle), math.degrees(light.inner_angle)) == pytest.approx((30, 22.5))


SURFACES = {
    "RectLight": ("float inputs:width = 2\nfloat inputs:height = 3", 6),
    "DiskLight": ("float inputs:radius = 2", math.pi * 4),
    "CylinderLight": ("float inputs:radius = 1\nfloat inputs:length = 3", 2 * math.pi * 3),
}


@pytest.mark.parametrize("kind", SURFACES)
def test_area_lights_glow(read, kind):
    numbers, area = SURFACES[kind]
    scene = read(
        triangle() + f'def {kind} "l" {{\n{numbers}\nfloat inputs:intensity = 5\nbool inputs:normalize = true\n}}'
    )
    mesh = scene.meshes[1]
    corners = mesh.positions[mesh.faces].astype(float)
    vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    assert np.linalg.norm(vectors, axis=1).sum() == pytest.approx(area, rel=2e-3)
    material = scene.materials[mesh.material]
    assert material.emission == pytest.approx((5 / area,) * 3, rel=2e-3)
    assert (material.base_color, material.double_sided) == ((0, 0, 0), False)
    if kind == "CylinderLight":
        outward = corners.mean(axis=1) * (0, 1, 1)
        assert (np.einsum("ij,ij->i", vectors, outward) > 0).all()
    else:
        assert (vectors[:, 2] < 0).all()


def test_a_dome_of_one_colour(read):
    environment = read(
        triangle() + 'def DomeLight "sky" {\nfloat inputs:intensity = 2\ncolor3f inputs:color = (1, 2, 3)\n}'
    ).environment
    assert np.unique(environment.pixels.reshape(-1, 3), axis=0).tolist() == [[2, 4, 6]]


@pytest.mark.parametrize(("up", "kind"), [("Y", "DomeLight"), ("Y", "DomeLight_1"), ("Z", "DomeLight_1")])
def test_a_domes_picture_is_upright_and_its_middle_lies_at_z(read, up, kind):
    """The frame of OpenEXR: the middle at +z, the left of the middle at +x."""
    pixels = np.zeros((4, 8, 3), np.uint8)
    body = triangle() + f'def {kind} "sky" {{\nasset inputs:texture:file = @sky.png@\n}}'
    head = f'#usda 1.0\n(\n    upAxis = "{up}"\n    metersPerUnit = 1\n)\n'
    environment = read(body, head=head, files={"sky.png": png(pixels)}).environment
    turn = environment.world_from_environment[:3, :3]
    # Of an environment: the middle is -z, the right of it +x, up +y.
    assert turn @ [0, 1, 0] == pytest.approx([0, 1, 0])
    if up == "Y":
        assert turn @ [0, 0, -1] == pytest.approx([0, 0, 1])
        assert turn @ [-1, 0, 0] == pytest.approx([1, 0, 0])


def test_cameras(read):
    body = """
def Camera "view" {
    float focalLength = 50
    float horizontalAperture = 36
    float verticalAperture = 24
    float focusDistance = 7
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Camera "flat" {
    token projection = "orthographic"
    float horizontalAperture = 40
    float verticalAperture = 20
}
"""
    head = '#usda 1.0\n(\n    upAxis = "Y"\n    metersPerUnit = 10\n)\n'
    view, flat = read(triangle() + body, head=head).cameras
    assert view.fov_y == pytest.approx(2 * math.atan(12 / 50))
    assert view.aspect == pytest.approx(1.5)
    assert view.focus_distance == pytest.approx(70)
    assert view.world_from_camera[:3, 3] == pytest.approx([0, 0, 50])
    # An aperture is in tenths of a unit, a unit is 10 m.
    assert (flat.height, flat.aspect) == pytest.approx((20, 2))


def test_exposure_and_shift_of_cameras_are_those_of_pxr(read):
    lens = "focalLength = 50\n float horizontalAperture = 36\n float verticalAperture = 24"
    offsets = "float horizontalApertureOffset = 5\n float verticalApertureOffset = -2"
    body = f"""
def Camera "plain" {{
    float {lens}
}}
def Camera "view" {{
    float {lens}
    {offsets}
    float exposure = 2
    float exposure:fStop = 4
    float exposure:iso = 400
    float exposure:time = 0.5
    float exposure:responsivity = 1.5
}}
def Camera "flat" {{
    token projection = "orthographic"
    float {lens}
    {offsets}
}}
def Camera "shut" {{
    float exposure:time = 0
}}
"""
    scene = read(triangle() + body)
    plain, view, flat, shut = scene.cameras
    assert (plain.exposure, plain.shift) == (0.0, (0.0, 0.0))
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString("#usda 1.0\n" + body)
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/view"))
    assert 2**view.exposure == pytest.approx(camera.ComputeLinearExposureScale())
    assert 2**view.exposure == pytest.approx(0.5 * 4 * 1.5 * 4 / 4**2, rel=0.01)
    # The window of its frustum lies at a distance of 1.
    assert view.shift == pytest.approx(tuple(camera.GetCamera(Usd.TimeCode.Default()).frustum.window.GetMidpoint()))
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/flat"))
    assert flat.shift == pytest.approx(tuple(camera.GetCamera(Usd.TimeCode.Default()).frustum.window.GetMidpoint()))
    assert shut.exposure == 0.0
    assert "/shut: an exposure of 0 times the light is passed over" in scene.notes


@pytest.mark.parametrize(
    "name",
    [
        "float inputs:diffuse = 0.5",
        "float inputs:specular = 0",
        "bool inputs:shadow:enable = 0",
        "color3f inputs:shadow:color = (1, 0, 0)",
        "float inputs:shaping:focus = 2",
        "rel light:filters = </m>",
        "rel collection:lightLink:includes = </m>",
        "rel collection:shadowLink:excludes = </m>",
    ],
)
def test_what_a_light_is_asked_for_and_not_given_is_named(read, name):
    apis = 'prepend apiSchemas = ["ShapingAPI", "ShadowAPI"]'
    scene = read(triangle() + f'def SphereLight "lamp" ({apis}) {{\n{name}\n}}')
    assert f"/lamp: {name.split()[1]} not honoured" in scene.notes
    usual = "float inputs:diffuse = 1\nbool inputs:shadow:enable = 1\nasset inputs:shaping:ies:file = @@"
    assert not read(triangle() + f'def SphereLight "lamp" ({apis}) {{\n{usual}\n}}').notes


def test_clipping_planes_of_a_camera_are_named(read):
    scene = read(triangle() + 'def Camera "eye" {\nfloat4[] clippingPlanes = [(0, 0, 1, 5)]\n}')
    assert "/eye: clippingPlanes not honoured" in scene.notes


def test_suns_that_blender_wrote_are_told_of(read):
    head = '#usda 1.0\n(\n    doc = "Blender v5.0.1"\n    upAxis = "Z"\n    metersPerUnit = 1\n)\n'
    said = "Blender v5.0.1 writes suns at a quarter of the strength of its other lights"
    sun = 'def DistantLight "sun" {\n}'
    assert said in read(triangle() + sun, head=head).notes
    assert said not in read(triangle() + 'def SphereLight "lamp" {\n}', head=head).notes
    assert said not in read(triangle() + sun).notes


def test_lights_that_are_not_read_are_named(read):
    scene = read(triangle() + 'def PortalLight "p" {}')
    assert scene.notes == ["light sources of type PortalLight are not read"]


@pytest.mark.parametrize("kind", ["RectLight", "DiskLight", "CylinderLight", "SphereLight"])
def test_a_light_of_the_schemas_own_intensity_lights_the_scene(read, kind):
    """Its radiance is 1, as bright as a label; the studio stays away all the same."""
    scene = Scene("dim", read(triangle() + f'def {kind} "l" {{\n}}'))
    assert scene.has_lights
    assert not scene.in_studio
