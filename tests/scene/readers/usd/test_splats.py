"""Gaussian splats of stages, as the schemas of UsdVol describe their arrays."""

import numpy as np
import pytest

from lippmann.errors import SceneError

from .conftest import triangle

UsdVol = pytest.importorskip("pxr.UsdVol", reason="usd-core is not installed")
pytestmark = pytest.mark.skipif(not hasattr(UsdVol, "ParticleField"), reason="usd-core before 26 knows no splats")

FIELD = """
def ParticleField3DGaussianSplat "splats" {{
    point3f[] positions = [(1, 2, 3), (4, 5, 6)]
    quatf[] orientations = [(0.5, 0.5, -0.5, 0.5), (2, 0, 0, 0)]
    float3[] scales = [(0.1, 0.2, 0.3), (1, 1, 1)]
    float[] opacities = [0.25, 1]
    uniform int radiance:sphericalHarmonicsDegree = {degree}
    float3[] radiance:sphericalHarmonicsCoefficients = [{coefficients}]
    {more}
}}
"""


def field(degree=1, count=8, more=""):
    coefficients = ", ".join(f"({n}, {n + 0.25}, {n + 0.5})" for n in range(count))
    return FIELD.format(degree=degree, coefficients=coefficients, more=more)


def test_splats_are_read_as_the_schema_has_them(read):
    splats = read(field()).splats
    np.testing.assert_array_equal(splats.centers, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_allclose(splats.scales, [[0.1, 0.2, 0.3], [1, 1, 1]], rtol=1e-6)
    np.testing.assert_array_equal(splats.rotations, [[0.5, -0.5, 0.5, 0.5], [0, 0, 0, 1]])  # w stands first in the file
    np.testing.assert_array_equal(splats.opacities, [0.25, 1])
    # The coefficients of a particle lie side by side.
    np.testing.assert_array_equal(splats.harmonics[1, :, 0], [4, 5, 6, 7])
    np.testing.assert_array_equal(splats.harmonics[0, 2], [2, 2.25, 2.5])


def test_arrays_in_half_precision_count_where_the_plain_one_is_empty(read):
    halves = """
        point3h[] positionsh = [(0.5, 0, 0), (1, 0, 0), (2, 0, 0)]
        float[] opacities = []
        half[] opacitiesh = [0.25, 0.5, 0.75]
        half3[] scalesh = [(1, 2, 4), (1, 2, 4), (1, 2, 4)]
        quath[] orientationsh = [(0, 1, 0, 0), (0, 1, 0, 0), (0, 1, 0, 0)]
        uniform int radiance:sphericalHarmonicsDegree = 0
        half3[] radiance:sphericalHarmonicsCoefficientsh = [(1, 0, -1), (1, 0, -1), (1, 0, -1)]
    """
    splats = read(f'def ParticleField3DGaussianSplat "splats" {{ {halves} }}').splats
    np.testing.assert_array_equal(splats.centers[:, 0], [0.5, 1, 2])
    np.testing.assert_array_equal(splats.opacities, [0.25, 0.5, 0.75])
    np.testing.assert_array_equal(splats.scales[0], [1, 2, 4])
    np.testing.assert_array_equal(splats.rotations[0], [1, 0, 0, 0])
    np.testing.assert_array_equal(splats.harmonics[2], [[1, 0, -1]])
    assert read(field(more="half[] opacitiesh = [0, 0]")).splats.opacities.tolist() == [0.25, 1]


def test_arrays_that_are_too_long_are_cut_and_short_ones_have_the_defaults(read):
    scene = read(field(count=11).replace("[0.25, 1]", "[0.25]").replace("(1, 1, 1)]", "(1, 1, 1), (9, 9, 9)]"))
    assert scene.splats.opacities.tolist() == [1, 1]
    assert scene.splats.scales[1].tolist() == [1, 1, 1]
    assert scene.splats.harmonics[1, :, 0].tolist() == [4, 5, 6, 7]
    assert "/splats: opacities holds 1 of 2 values, and is passed over" in scene.notes
    plain = read('def ParticleField3DGaussianSplat "splats" {\npoint3f[] positions = [(1, 2, 3)]\n}').splats
    assert (plain.scales.tolist(), plain.rotations.tolist()) == ([[1, 1, 1]], [[0, 0, 0, 1]])
    assert plain.harmonics.tolist() == [[[0, 0, 0]]]  # the grey of 0.5, with which all colours begin


def test_discs_stand_beside_meshes_and_follow_their_prims(read):
    disc = """
    def Xform "w" {
        double3 xformOp:translate = (10, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def ParticleField "flat" (prepend apiSchemas = ["ParticleFieldPositionAttributeAPI",
                "ParticleFieldScaleAttributeAPI", "ParticleFieldKernelGaussianSurfletAPI"]) {
            point3f[] positions = [(1, 2, 3)]
            float3[] scales = [(1, 2, 3)]
        }
    }
    def ParticleField "other" (prepend apiSchemas = ["ParticleFieldKernelConstantSurfletAPI"]) {
    }
    """
    head = '#usda 1.0\n(\n    upAxis = "Z"\n    metersPerUnit = 0.01\n)\n'
    scene = read(triangle() + disc, head=head)
    assert len(scene.meshes) == 1
    np.testing.assert_allclose(scene.splats.centers, [[0.11, 0.03, -0.02]], rtol=1e-6)
    np.testing.assert_allclose(scene.splats.scales, [[0.01, 0.02, 0]], rtol=1e-6)
    assert "/other: particles that are no Gaussians are not drawn" in scene.notes


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (field(degree=5), "harmonics of degree 5"),
        (field().replace("(1, 2, 3)", "(nan, 2, 3)").replace("(4, 5, 6)", "(inf, 5, 6)"), "numbers are all finite"),
        ('def ParticleField3DGaussianSplat "splats" { }', "shows no meshes"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_one_line(read, body, said):
    with pytest.raises(SceneError, match=said) as refusal:
        read(body)
    assert "\n" not in str(refusal.value)
