"""NumPy's arrays and Mitsuba's grids as volumes."""

import struct

import numpy as np
import pytest

from lippmann.errors import LippmannError, SceneError, UsageError
from lippmann.scene.readers.load import load_scene

GRID = np.random.default_rng(0).uniform(0, 1, (4, 3, 2)).astype(np.float32)


def test_arrays_lie_with_slice_0_in_front_and_row_0_on_top(tmp_path):
    np.save(tmp_path / "a.npy", GRID)
    volume = load_scene(tmp_path / "a.npy").description.volume
    assert (volume.grid == GRID).all()
    assert volume.world_from_voxel.tolist() == np.diag([1.0, -1, -1, 1]).tolist()
    np.save(tmp_path / "f.npy", np.asfortranarray(GRID))
    assert (load_scene(tmp_path / "f.npy").description.volume.grid == GRID).all()
    turned = load_scene(tmp_path / "a.npy", up="z").description.volume
    assert (turned.world_from_voxel @ [0, 0, -1, 0]).tolist() == [0, 1, 0, 0]


@pytest.mark.parametrize("kind", ["bool", "int8", "uint8", ">i2", "uint16", "int32", "float16", ">f8", "uint64"])
def test_numbers_of_every_kind(tmp_path, kind):
    values = (np.arange(24).reshape(4, 3, 2) % 2).astype(kind)
    np.save(tmp_path / "a.npy", values)
    assert (load_scene(tmp_path / "a.npy").description.volume.grid == values).all()


def test_archives_tell_spacing_and_name(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", density=GRID, spacing=[3.0, 2.0, 1.0])
    assert load_scene(tmp_path / "a.npz").description.volume.spacing.tolist() == [1, 2, 3]
    np.savez(tmp_path / "b.npz", a=GRID, b=GRID[1:])
    with pytest.raises(SceneError, match="holds a, b; one array is shown; choose it with series"):
        load_scene(tmp_path / "b.npz")
    assert load_scene(tmp_path / "b.npz", series="b").description.volume.size == (2, 3, 3)
    with pytest.raises(UsageError, match="known are a, b"):
        load_scene(tmp_path / "b.npz", series="c")


def test_arrays_that_show_nothing_are_refused_in_one_line(tmp_path):
    path = tmp_path / "a.npy"
    for values, said in [
        (np.zeros((3, 3)), r"its array is \(3, 3\)"),
        (np.zeros((2, 2, 2, 3)), r"its array is \(2, 2, 2, 3\)"),
        (np.zeros((2, 2, 2), complex), "is of complex128"),
        (np.zeros((0, 2, 2)), r"its grid is \(0, 2, 2\)"),
        (np.array([[["a"]]]), "is of <U1"),
    ]:
        np.save(path, values)
        with pytest.raises(LippmannError, match=said) as error:
            load_scene(path)
        assert "\n" not in str(error.value)
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': (65535, 65535, 65535)}\n"
    path.write_bytes(b"\x93NUMPY\x01\0" + struct.pack("<H", len(header)) + header.encode())
    with pytest.raises(LippmannError, match="of memory"):
        load_scene(path)
    np.save(path, GRID)
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(SceneError, match="holds 95 of 96 bytes"):
        load_scene(path)


def test_values_that_are_all_one_or_no_numbers(tmp_path):
    np.save(tmp_path / "a.npy", np.full((3, 3, 3), 7.0))
    low, *_, high = load_scene(tmp_path / "a.npy").description.volume.transfer.values
    assert low < high == 7
    np.save(tmp_path / "a.npy", np.full((3, 3, 3), np.nan))
    assert any("no voxel is a finite number" in note for note in load_scene(tmp_path / "a.npy").notes)


def save_grid(path, size=(2, 3, 4), version=3, encoding=1, channels=1, box=(0, 0, 0, 2, 6, 12), data=GRID):
    path.write_bytes(struct.pack("<3sB5i6f", b"VOL", version, encoding, *size, channels, *box) + data.tobytes())


def test_grids_of_mitsuba(tmp_path):
    path = tmp_path / "a.vol"
    save_grid(path)
    volume = load_scene(path).description.volume
    assert (volume.grid == GRID).all()
    assert volume.world_from_voxel.tolist() == [[1, 0, 0, 0.5], [0, 2, 0, 1], [0, 0, 3, 1.5], [0, 0, 0, 1]]
    for change, said in [
        ({"version": 2}, "version 2"),
        ({"encoding": 2}, "encoding 2"),
        ({"channels": 3}, "3 numbers a voxel"),
        ({"size": (65535, 65535, 65535)}, "bytes of voxels"),
        ({"size": (-2, 3, -4)}, "1 or more along each axis"),
        ({"box": (0, 0, 0, 0, 1, 1)}, "no extent"),
        ({"box": (0, 0, 0, np.nan, 1, 1)}, "no extent"),
    ]:
        save_grid(path, **change)
        with pytest.raises(LippmannError, match=said):
            load_scene(path)
    path.write_bytes(b"VOX")
    with pytest.raises(SceneError, match="is no grid of Mitsuba's"):
        load_scene(path)
