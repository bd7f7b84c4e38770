"""LAS and LAZ files as clouds of points."""

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.load import load_scene

PLACES = np.array([(0, 0, 0), (4, 0, 0), (0, 4, 0), (0, 0, 9), (50, 0, 0), (0, 60, 0)], np.float64)
CODES = np.array([(255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255), (1, 1, 1), (2, 2, 2)], np.uint16)


@pytest.fixture
def save(tmp_path):
    laspy = pytest.importorskip("laspy")
    pytest.importorskip("lazrs")

    def write(name, codes):
        las = laspy.create(point_format=2, file_version="1.2")
        las.header.scales = [0.001] * 3
        las.header.offsets = [600_000.0, 5_000_000.0, 0.0]
        las.x, las.y, las.z = (PLACES + las.header.offsets).T
        las.red, las.green, las.blue = codes.T
        las.classification = [2, 2, 6, 6, 18, 2]
        las.withheld = [0, 0, 0, 0, 0, 1]
        las.write(tmp_path / name)
        return tmp_path / name

    return write


@pytest.mark.parametrize(("name", "times"), [("a.las", 1), ("a.laz", 257)])
def test_places_and_colours_of_points_that_are_no_noise(save, name, times):
    """Codes of 8 and of 16 bits, z up."""
    scene = load_scene(save(name, CODES * np.uint16(times)))
    (mesh,) = (mesh for mesh in scene.description.meshes if mesh.fitted)
    corners = mesh.positions.reshape(4, -1, 3).mean(axis=1)
    assert corners - corners[0] == pytest.approx(PLACES[:4], abs=2e-3)
    assert mesh.colors.reshape(4, -1, mesh.colors.shape[1])[:, 0, :3] == pytest.approx(CODES[:4] / 255)
    assert "2 points that the file marks as noise or withheld are left out" in scene.notes
    assert any("up is taken as +z, as surveying has it" in note for note in scene.notes)


def test_colours_that_are_not_set_are_none(save):
    scene = load_scene(save("a.laz", 0 * CODES))
    assert all(mesh.colors is None for mesh in scene.description.meshes)


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
@pytest.mark.parametrize(
    ("left", "says"), [(60, "it ends within its header"), (150, ""), (300, ""), (-1, ""), (-20, "")]
)
def test_one_line_says_that_a_file_is_cut_short(save, name, left, says):
    path = save(name, CODES)
    path.write_bytes(path.read_bytes()[:left])
    with pytest.raises(SceneError, match=rf"^a\.la[sz]: is no scan that is understood \({says}[^\n]*\); LAS or LAZ$"):
        load_scene(path)


def test_a_header_that_counts_more_records_than_there_are(save):
    path = save("a.las", CODES)
    data = bytearray(path.read_bytes())
    data[100:104] = (1 << 24).to_bytes(4, "little")
    path.write_bytes(data)
    with pytest.raises(SceneError, match="its header counts 16777216 records"):
        load_scene(path)


def test_a_scan_of_more_points_than_are_shown(save, monkeypatch):
    pytest.importorskip("laspy")
    from lippmann.scene.readers.lidar import child

    path = save("a.las", CODES)
    monkeypatch.setattr(child, "MOST_POINTS", 3)
    found = child._read({"path": str(path)})
    assert found["positions"][:, :2] == pytest.approx(PLACES[[0, 2], :2] + [600_000.0, 5_000_000.0])
    assert "one of 2 points is shown" in found["notes"].tolist()


def test_without_the_library_one_line_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setattr("lippmann.runtime.optional_import.importlib.util.find_spec", lambda name: None)
    (tmp_path / "a.las").write_bytes(b"LASF")
    with pytest.raises(SceneError, match=r"laspy is not installed; .* pip install 'lippmann\[lidar\]'"):
        load_scene(tmp_path / "a.las")
