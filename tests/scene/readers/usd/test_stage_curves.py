"""Points and basis curves of stages: balls and rods of the widths that are given."""

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.usd.curves import Curves

from .conftest import HEAD

POINTS = """
def Points "p" {{
    point3f[] points = [(0, 0, 0), (4, 0, 0)]
    {more}
}}
"""
CURVES = """
def BasisCurves "c" {{
    int[] curveVertexCounts = [{count}]
    point3f[] points = {points}
    uniform token type = "{kind}"
    uniform token basis = "{basis}"
    uniform token wrap = "{wrap}"
    {more}
}}
"""
CORNERS = [(0, 0, 0), (1, 2, 0), (3, 2, 0), (4, 0, 0)]


def curves(kind="cubic", basis="bezier", wrap="nonperiodic", more="", points=CORNERS):
    listed = "[" + ", ".join(map(str, points)) + "]"
    return CURVES.format(count=len(points), points=listed, kind=kind, basis=basis, wrap=wrap, more=more)


def radii(mesh, middle):
    return np.linalg.norm(mesh.positions - np.asarray(middle), axis=1)


def test_points_are_balls_of_their_widths_and_colours(read):
    more = (
        "float[] widths = [1, 2]\n color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (interpolation = 'vertex')"
    )
    (mesh,) = read(POINTS.format(more=more)).meshes
    first, second = np.split(np.arange(len(mesh.positions)), 2)
    assert radii(mesh, (0, 0, 0))[first] == pytest.approx(0.5)
    assert radii(mesh, (4, 0, 0))[second] == pytest.approx(1.0)
    assert (mesh.colors[first] == (1, 0, 0)).all()
    assert (mesh.colors[second] == (0, 1, 0)).all()


def test_a_single_width_is_that_of_all(read):
    (mesh,) = read(POINTS.format(more="float[] widths = [0.5]")).meshes
    assert np.ptp(mesh.positions[:, 1]) == pytest.approx(0.5)


@pytest.mark.parametrize(("writer", "width"), [("Blender v5.3.0", 2), ("Blender v5.3.0", 1), ("Houdini", 2)])
def test_widths_of_blender_s_curves_are_none(read, writer, width):
    head = HEAD.replace("(", f'(\n    doc = "{writer}"', 1)
    (mesh,) = read(curves(more=f'float[] widths = [{width}, {width}] (interpolation = "varying")'), head=head).meshes
    is_thin = np.ptp(mesh.positions[:, 2]) < 0.1
    assert is_thin == (writer.startswith("Blender") and width == 2)


def test_points_without_widths_are_as_those_of_other_formats(read):
    scene = read(POINTS.format(more=""))
    assert any("points are drawn as balls" in note for note in scene.notes)
    assert np.ptp(scene.meshes[0].positions[:, 1]) == pytest.approx(2 * 0.01 * 4)


def test_a_bezier_curve_goes_through_its_middle(read):
    (mesh,) = read(curves(more="float[] widths = [0.001]")).meshes
    # Half of the weights 1, 3, 3, 1 over 8.
    assert np.abs(mesh.positions - (2, 1.5, 0)).sum(axis=1).min() < 2e-3
    assert mesh.positions[:, 1].max() < 1.502


def test_widths_at_the_ends_of_segments_taper(read):
    (mesh,) = read(curves("linear", more="float[] widths = [2, 1, 1, 0] (interpolation = 'varying')")).meshes
    assert radii(mesh, CORNERS[0]).min() == pytest.approx(1.0)
    assert radii(mesh, CORNERS[3]).min() == pytest.approx(0.0, abs=1e-6)


def test_pinned_splines_reach_their_ends_and_periodic_ones_close():
    corners = np.array(CORNERS, float)
    pinned = Curves(np.array([4]), "catmullRom", "pinned").sample(corners, "vertex", 8)
    assert pinned[::8] == pytest.approx(corners)
    for basis in ("bspline", "catmullRom"):
        closed = Curves(np.array([4]), basis, "periodic").sample(corners, "vertex", 8)
        assert len(closed) == 4 * 8 + 1
        assert closed[0] == pytest.approx(closed[-1])


def test_curves_of_any_lengths_lie_one_after_the_other():
    two = Curves(np.array([4, 2, 3]), "linear", "nonperiodic")
    values = np.arange(9.0)[:, None]
    assert two.sample(values, "vertex", 1).ravel().tolist() == list(range(9))
    assert two.elements(1).tolist() == [[0, 1], [1, 2], [2, 3], [4, 5], [6, 7], [7, 8]]
    assert two.sample(np.array([[5.0], [6.0], [7.0]]), "uniform", 1).ravel().tolist() == [5] * 4 + [6] * 2 + [7] * 3


def test_values_that_do_not_fit_are_named(read):
    with pytest.raises(SceneError, match="mesh /c has 2 widths, vertex, which do not fit it"):
        read(curves(more="float[] widths = [1, 2]"))
    with pytest.raises(SceneError, match="has 4 points where its curves say 5"):
        read(curves().replace("[4]", "[5]"))
