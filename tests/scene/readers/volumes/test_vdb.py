"""OpenVDB files, as openvdb 10 writes them: grids, their place, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import MemoryLimitError, SceneError, UsageError
from lippmann.runtime import machine
from lippmann.scene.readers.load import load_scene
from lippmann.scene.readers.volumes import vdb
from lippmann.scene.readers.volumes.vdb import read_vdb
from lippmann.scene.readers.volumes.vdb_module import find_module

needs_openvdb = pytest.mark.skipif(find_module() is None, reason="OpenVDB's Python module is not installed")

HERE = Path(__file__).parent
X, Y, Z = np.mgrid[0:9, 0:7, 0:5]
#: What the files were written from, as ``[z, y, x]``.
VALUES = (1 + X + 10 * Y + 100 * Z).T.astype(np.float32)


def volume(name="grids.vdb", **options):
    return read_vdb(HERE / name, **options).volume


@needs_openvdb
def test_the_density_is_shown_of_several_grids():
    description = read_vdb(HERE / "grids.vdb")
    found = description.volume
    np.testing.assert_array_equal(found.grid * found.slope + found.intercept, VALUES)
    # x' = 0.5 x + 1, y' = 0.25 y + 2, z' = 2 z + 3, and the first voxel is number (-2, 3, 4).
    expected = np.diag([0.5, 0.25, 2.0, 1.0])
    expected[:3, 3] = 0.5 * -2 + 1, 0.25 * 3 + 2, 2.0 * 4 + 3
    np.testing.assert_allclose(found.world_from_voxel, expected)
    assert "the grid 'density' of density, mask, temperature, turned" in description.notes


@needs_openvdb
def test_a_grid_is_chosen_by_its_name():
    np.testing.assert_array_equal(volume(series="temperature").grid, VALUES[:3, :3, :3])
    # openvdb puts voxel (1, 2, 3) of this one at (0.8, 2.2, 3.9).
    np.testing.assert_allclose(volume(series="turned").world_from_voxel @ [1, 2, 3, 1], [0.8, 2.2, 3.9, 1])
    with pytest.raises(UsageError, match=r"series: 'mask'; the file has density, temperature, turned"):
        volume(series="mask")


@needs_openvdb
def test_up_is_told(tmp_path):
    plain, turned = (load_scene(HERE / "grids.vdb", up=up).description.volume.world_from_voxel for up in ("y", "z"))
    np.testing.assert_allclose(turned[1], plain[2])


@needs_openvdb
@pytest.mark.parametrize(
    ("name", "rule"),
    [
        ("level_set.vdb", r"the grid 'ball' is a level set"),
        ("mask.vdb", r"its grids \(mask\) hold no single numbers"),
    ],
)
def test_what_is_not_read_is_named(name, rule):
    with pytest.raises(SceneError, match=rf"{name}: {rule}"):
        volume(name)


@needs_openvdb
def test_damaged_files_are_one_line(tmp_path):
    data = (HERE / "grids.vdb").read_bytes()
    for bad in (data[: len(data) // 2], data[:60], b" BDV\0\0\0\0" + bytes(100)):
        path = tmp_path / "x.vdb"
        path.write_bytes(bad)
        with pytest.raises(
            SceneError, match=r"^x\.vdb: (cannot be read \(.*OpenVDB file|its grids \(none\))"
        ) as caught:
            read_vdb(path)
        assert "\n" not in str(caught.value)


@needs_openvdb
def test_it_counts_against_the_memory(monkeypatch):
    monkeypatch.setattr(machine, "_UNSEEN", 0)
    monkeypatch.setattr(machine, "available_memory", lambda: 1000)
    with pytest.raises((SceneError, MemoryLimitError), match="memory"):
        volume()


@needs_openvdb
def test_constant_regions_are_there():
    """openvdb stores them as one value each."""
    assert (volume("tiles.vdb").grid == 0.5).all()
    assert volume("tiles.vdb").grid.shape == (10, 10, 10)


def test_the_module_is_named(monkeypatch):
    monkeypatch.setattr(vdb, "find_module", lambda: None)
    with pytest.raises(SceneError, match=r"grids\.vdb: OpenVDB's Python module is not installed; Blender's wheel"):
        volume()


def test_what_is_no_such_file_is_said(tmp_path):
    path = tmp_path / "x.vdb"
    path.write_bytes(b"something else")
    with pytest.raises(SceneError, match=r"x\.vdb: is no OpenVDB file"):
        read_vdb(path)
