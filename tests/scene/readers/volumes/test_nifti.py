"""NIfTI files: orientation, scale, several volumes, and what is refused."""

import gzip
import sys
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import LippmannError, SceneError, UsageError
from lippmann.runtime.machine import limit_inputs
from lippmann.scene.readers.load import load_scene

sys.path.insert(0, str(Path(__file__).parent))
from volume_files import save_nifti

pytest.importorskip("nibabel", reason="nibabel is not installed")

GRID = np.arange(24, dtype=np.int16).reshape(4, 3, 2)  # x, y, z


def volume_of(path, **options):
    return load_scene(path, **options).description.volume


@pytest.mark.parametrize(("name", "version"), [("a.nii", 1), ("a.nii.gz", 1), ("a.nii", 2)])
def test_axes_lead_to_a_patient_seen_from_the_front_head_up(tmp_path, name, version):
    affine = np.array([[-2.0, 0, 0, 10], [0, 3, 0, -20], [0, 0, 4, 30], [0, 0, 0, 1]])  # toward left, front, head
    save_nifti(tmp_path / name, GRID, affine, version=version)
    volume = volume_of(tmp_path / name)
    assert (volume.grid == GRID.transpose(2, 1, 0)).all()
    assert volume.spacing.tolist() == [2, 3, 4]
    # Left of the patient is to the right, the front toward the viewer, the head up.
    assert volume.world_from_voxel.tolist() == [[2, 0, 0, -10], [0, 0, 4, 30], [0, 3, 0, -20], [0, 0, 0, 1]]


def test_a_volume_that_does_not_say_how_the_patient_lies_says_what_is_assumed(tmp_path):
    import nibabel

    image = nibabel.Nifti1Image(GRID, None)
    for name, code in (("bare.nii", 0), ("placed.nii", 1)):
        image.header["sform_code"], image.header["qform_code"] = 0, code
        nibabel.save(image, tmp_path / name)
    scenes = [load_scene(tmp_path / name) for name in ("bare.nii", "placed.nii")]
    assert [any("how the patient lies" in note for note in scene.notes) for scene in scenes] == [True, False]
    assert scenes[0].description.volume.world_from_voxel[:3, :3].tolist() == [[1, 0, 0], [0, 0, 1], [0, 1, 0]]


def test_scale_of_values_and_units_of_length(tmp_path):
    import nibabel

    affine = np.eye(4)
    affine[:3, 3] = 5, 6, 7
    image = nibabel.Nifti1Image(GRID, affine)
    image.header.set_slope_inter(2.0, -1000.0)
    image.header.set_xyzt_units("micron")
    nibabel.save(image, tmp_path / "a.nii")
    data = bytearray((tmp_path / "a.nii").read_bytes())
    data[112:120] = np.float32([2.0, -1000.0]).tobytes()  # the library folds them into the voxels
    (tmp_path / "a.nii").write_bytes(data)
    volume = volume_of(tmp_path / "a.nii")
    assert (volume.slope, volume.intercept) == (2.0, -1000.0)
    assert volume.spacing == pytest.approx([1e-3] * 3)
    assert volume.world_from_voxel[:3, 3] == pytest.approx([-5e-3, 7e-3, 6e-3])
    data[112:116] = np.float32([-2.0]).tobytes()
    (tmp_path / "a.nii").write_bytes(data)
    volume = volume_of(tmp_path / "a.nii")
    assert (volume.grid * volume.slope + volume.intercept).max() == pytest.approx(-1000)


def test_several_volumes(tmp_path):
    grid = np.stack([GRID, GRID + np.int16(100)], axis=3)
    save_nifti(tmp_path / "a.nii.gz", grid)
    scene = load_scene(tmp_path / "a.nii.gz")
    assert "volume 1 of 2 (series)" in scene.notes
    assert volume_of(tmp_path / "a.nii.gz", series="2").grid.min() == 100
    for wrong in ("0", "3", "x"):
        with pytest.raises(UsageError, match="the file has volumes 1 to 2"):
            load_scene(tmp_path / "a.nii.gz", series=wrong)


def test_values_that_are_no_numbers_count_as_the_lowest(tmp_path):
    grid = GRID.astype(np.float64)
    grid[0, 0, 0], grid[1, 0, 0] = np.nan, np.inf
    save_nifti(tmp_path / "a.nii", grid)
    scene = load_scene(tmp_path / "a.nii")
    assert "2 voxels are no finite numbers, and count as the lowest value" in scene.notes
    assert scene.description.volume.grid[0, 0, 0] == 1


def broken(tmp_path, change):
    save_nifti(tmp_path / "a.nii", GRID)
    data = bytearray((tmp_path / "a.nii").read_bytes())
    change(data)
    (tmp_path / "a.nii").write_bytes(data)
    return tmp_path / "a.nii"


def test_damaged_files_are_refused_in_one_line(tmp_path):
    def sized(data):
        data[40:48] = np.int16([3, 32767, 32767, 32767]).tobytes()

    for change, said in [
        (lambda data: data.__delitem__(slice(360, None)), "of 48 bytes of voxels"),
        (lambda data: data.__setitem__(slice(0, 4), b"\0\0\0\1"), "is no NIfTI file"),
        (lambda data: data.__setitem__(slice(70, 72), np.int16([128]).tobytes()), "its voxels are colours"),
        (lambda data: data.__setitem__(slice(70, 72), np.int16([32]).tobytes()), "its voxels are complex64"),
        (lambda data: data.__setitem__(slice(70, 72), np.int16([77]).tobytes()), "has a damaged header"),
        (lambda data: data.__setitem__(slice(108, 112), np.float32([1e9]).tobytes()), "begin at byte 1000000000"),
        (sized, "of memory"),
    ]:
        with pytest.raises(LippmannError, match=said) as error:
            load_scene(broken(tmp_path, change))
        assert "\n" not in str(error.value)
    (tmp_path / "b.nii.gz").write_bytes(gzip.compress(b"x" * 4000)[:-9])
    with pytest.raises(SceneError, match=r"is no NIfTI file|cannot be unpacked"):
        load_scene(tmp_path / "b.nii.gz")


def test_what_unpacks_to_more_than_the_memory_is_refused(tmp_path):
    save_nifti(tmp_path / "a.nii.gz", np.zeros((300, 300, 300), np.int16))
    assert (tmp_path / "a.nii.gz").stat().st_size < 1 << 20
    with limit_inputs(40 << 20), pytest.raises(LippmannError, match="300 x 300 x 300 voxels"):
        load_scene(tmp_path / "a.nii.gz")


def test_without_the_library_the_line_says_how_to_get_it(tmp_path, monkeypatch):
    save_nifti(tmp_path / "a.nii", GRID)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(SceneError, match=r"nibabel is not installed; NIfTI files need it; pip install 'lippmann\[vol"):
        load_scene(tmp_path / "a.nii")
