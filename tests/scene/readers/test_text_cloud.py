"""Clouds of points as rows of numbers."""

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.load import load_scene
from lippmann.scene.readers.text_cloud import read_text_cloud

PLACES = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)]
CODES = [(255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255)]
NORMALS = [(0.6, 0.8, 0), (0, 0.6, 0.8), (0, 0, 1), (1, 0, 0)]


def rows(*columns, between=" "):
    listed = ([str(number) for part in row for number in part] for row in zip(PLACES, *columns, strict=True))
    return "\n".join(between.join(row) for row in listed) + "\n"


@pytest.fixture
def read(tmp_path):
    def read(text, name="a.xyz"):
        (tmp_path / name).write_text(text)
        return load_scene(tmp_path / name).description

    return read


INTENSITY = [(-800,), (12,), (7,), (900,)]


@pytest.mark.parametrize(
    ("text", "name", "colored", "unread"),
    [
        (rows(), "a.xyz", False, 0),
        (rows(CODES), "a.xyz", True, 0),
        (rows(CODES, between=", "), "a.asc", True, 0),
        (rows(CODES, NORMALS), "a.asc", True, 0),
        (rows(NORMALS, CODES), "a.xyz", True, 0),
        (rows(NORMALS), "a.asc", False, 0),
        ("4\n" + rows(INTENSITY, CODES), "a.pts", True, 1),
        ("4\n" + rows([(50,)] * 4, CODES), "a.pts", True, 1),
        ("//X Y Z R G B\n" + rows(CODES), "a.xyz", True, 0),
        ("X,Y,Z,Intensity\n" + rows(INTENSITY, between=","), "a.asc", False, 1),
    ],
)
def test_columns(read, text, name, colored, unread):
    scene = read(text, name)
    (mesh,) = scene.meshes
    assert len(mesh.positions) == len(PLACES) * mesh.points
    if colored:
        assert np.unique(mesh.colors[:, :3], axis=0).tolist() == [[0, 0, 1], [0, 1, 0], [1, 0, 0], [1, 1, 1]]
    else:
        assert mesh.colors is None
    assert any("surveying has it" in note for note in scene.notes)
    assert sum(f"{unread} of " in note for note in scene.notes) == min(unread, 1)


def test_names_above_the_rows_say_where_places_stand(read):
    rows = "".join(f"{n},{z},{x},{y}\n" for n, (x, y, z) in enumerate(PLACES, 7))
    scene = read(f'"id","Z","X","Y"\n{rows}', "a.csv")
    (mesh,) = scene.meshes
    middles = mesh.positions.reshape(-1, mesh.points, 3).mean(axis=1)
    assert middles == pytest.approx(np.array(PLACES, float), abs=1e-5)
    assert "1 of 4 columns are not shown" in scene.notes


def test_z_is_up(tmp_path):
    path = tmp_path / "a.pts"
    path.write_text(rows())
    assert load_scene(path).bounds[1] == pytest.approx([1, 3, 0], abs=0.1)


@pytest.mark.parametrize(
    ("text", "line"),
    [("nothing\n", "its rows are x, y, z"), ("1 2 3\n4 5\n", "cut short"), ("1 2 3\n4 5 six\n", "decimal commas")],
)
def test_what_is_no_cloud(tmp_path, text, line):
    path = tmp_path / "a.asc"
    path.write_text(text)
    with pytest.raises(SceneError, match=r"^a\.asc: is no cloud of points") as caught:
        read_text_cloud(path)
    assert line in str(caught.value)


def test_land_is_shown_from_above(tmp_path):
    (tmp_path / "a.xyz").write_text("0 0 0\n90 0 1\n90 50 2\n0 50 9\n")
    scene = load_scene(tmp_path / "a.xyz")
    assert "land is shown from above, as a map with +y on top (else up=z)" in scene.notes
    assert (scene.description.instances[0].world_from_mesh == np.eye(4)).all()
    assert (load_scene(tmp_path / "a.xyz", up="z").description.instances[0].world_from_mesh != np.eye(4)).any()
