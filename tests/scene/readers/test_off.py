"""OFF meshes, text."""

import numpy as np
import pytest

from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.scene.readers.off import read_off

SQUARE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
CORNERS = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


@pytest.fixture
def read(tmp_path):
    def read(text):
        path = tmp_path / "gem.off"
        path.write_text(text, encoding="latin-1")
        return read_off(path)

    return read


@pytest.mark.parametrize(
    "text",
    [
        f"OFF\n4 1 4\n{CORNERS}4 0 1 2 3\n",
        f"# by hand, é\n\nOFF # text\n4 1\n\n{CORNERS.replace('1 1', '+1 1e0')}4 0 1 2 3 # a square\n",
        f"OFF4 1 0\r\n{CORNERS}4 0 1 2 3\n",  # as in ModelNet
        f"OFF\n4 1 0\n{CORNERS}4 0 \n1 2\n 3\n",  # as libigl writes long rows
        f"OFF\n4 1 0\n{CORNERS}4 0 1 2 3 7\n",  # the number of a colour in a map
    ],
)
def test_polygons(read, text):
    scene = read(text)
    (mesh,) = scene.meshes
    assert mesh.positions.tolist() == [list(map(float, corner)) for corner in SQUARE]
    assert len(mesh.faces) == 2
    assert mesh.normals is None
    assert mesh.colors is None
    assert scene.notes == []


def test_what_vertices_have_is_told_by_the_first_word(read):
    rest = "0 0 2 0 127 255 255 0.25 0.75\n"
    (mesh,) = read(f"STCNOFF\n3 1 0\n0 0 0 {rest}1 0 0 {rest}1 1 0 {rest}3 0 1 2").meshes
    assert (mesh.normals == (0, 0, 1)).all()
    assert np.allclose(mesh.colors, (0, decode_srgb(np.array(127 / 255)), 1))
    assert np.allclose(mesh.uvs[0], (0.25, 0.25))  # v runs upwards


@pytest.mark.parametrize("color", ["255 0 0", "255 0 0 255", "1.0 0 0", "1. 0. 0. 1.", "1 0 0 1"])
@pytest.mark.parametrize("key", ["COFF", "OFF"])  # not all programs change the first word
def test_colors_of_vertices(read, key, color):
    (mesh,) = read(f"{key}\n3 1 0\n0 0 0 {color}\n1 0 0 {color}\n0 1 0 {color}\n3 0 1 2\n").meshes
    assert (mesh.colors == (1, 0, 0)).all()


@pytest.mark.parametrize(("red", "half"), [("255 0 0", "0 255 0 51"), ("1.0 0 0", "0 1.0 0 .2")])
def test_colors_of_faces(read, red, half):
    (mesh,) = read(f"OFF\n4 3 0\n{CORNERS}3 0 1 2 {red}\n3 0 2 3 {half}\n3 1 2 3\n").meshes
    expected = ((1, 0, 0, 1), (0, 1, 0, 0.2), (0.7, 0.7, 0.7, 1))
    assert np.allclose(mesh.colors, np.repeat(expected, 3, axis=0))


def test_points_without_faces(read):
    assert all(mesh.points for mesh in read(f"OFF\n4 0 0\n{CORNERS}").meshes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (CORNERS, "gem.off: is no OFF file; it begins with OFF, or a word such as COFF or NOFF"),
        ("OFFER\n", "gem.off: is no OFF file; it begins with OFF, or a word such as COFF or NOFF"),
        ("OFF", "gem.off: does not say how many vertices and faces it has; OFF is followed by both"),
        (f"OFF\n4 -1\n{CORNERS}", "gem.off: does not say how many vertices and faces it has; OFF is followed by both"),
        ("OFF BINARY\n\0\0", "gem.off: is a binary OFF file; text is read; save it as text"),
        ("4OFF\n1 0 0\n0 0 0 1", "gem.off: is a file of 4OFF; vertices have x, y and z"),
        (f"OFF\n5 0 0\n{CORNERS}", "gem.off: ends after 4 of 5 entries of 'vertex'; is it cut short?"),
        (f"OFF\n4 1 0\n{CORNERS}4 0 1 2", "gem.off: entry 0 of 'face' has too few numbers; is the file cut short?"),
        (f"OFF\n4 1 0\n{CORNERS}3 0 1 4", "gem.off: a face uses vertex 4; the file has 0 to 3"),
        ("NOFF\n1 0 0\n0 0 0\n", "gem.off: entry 0 of 'vertex' has too few numbers; is the file cut short?"),
        ("OFF\n0 0 0\n", "gem.off: holds no vertices"),
    ],
)
def test_damage_is_refused(read, text, message):
    with pytest.raises(SceneError) as caught:
        read(text)
    assert str(caught.value) == message
