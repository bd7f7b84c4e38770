"""DICOM series: the order and distance of slices, which series, and what is refused."""

import sys
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import SceneError, UsageError
from lippmann.scene.readers.load import load_scene

sys.path.insert(0, str(Path(__file__).parent))
from volume_files import save_series, save_slice

pytest.importorskip("pydicom", reason="pydicom is not installed")


def test_slices_lie_by_their_places(tmp_path):
    save_series(tmp_path / "ct", [0, 3, 6, 9])
    scene = load_scene(tmp_path / "ct")
    volume = scene.description.volume
    assert volume.grid[:, 1, 0].tolist() == [0, 30, 60, 90]
    assert (volume.grid[:, 0] == volume.grid[:, 1] + 1).all()
    # Left is to the right, the head up, the back away from the viewer.
    assert volume.world_from_voxel.tolist() == [[1, 0, 0, -7], [0, 0, 3, 0], [0, -2, 0, 9], [0, 0, 0, 1]]
    assert scene.name == "ct"
    assert volume.transfer.name.startswith("ct-")
    one = load_scene(next((tmp_path / "ct").iterdir()))
    assert (one.description.volume.grid == volume.grid).all()


def test_rescaled_values(tmp_path):
    save_series(tmp_path / "ct", [0, 3, 6], RescaleSlope=2, RescaleIntercept=-1024)
    volume = load_scene(tmp_path / "ct").description.volume
    assert (volume.slope, volume.intercept, volume.grid.dtype) == (2.0, -1024.0, np.int16)
    save_slice(tmp_path / "ct" / "z", np.full((4, 5), 7), ImagePositionPatient=[-7, -9, 9], RescaleSlope=3)
    volume = load_scene(tmp_path / "ct").description.volume
    assert volume.grid[:, 1, 0].tolist() == [-1024, 2 * 30 - 1024, 2 * 60 - 1024, 21]


def test_dark_is_bright_where_the_file_says_so(tmp_path):
    save_series(tmp_path / "mr", [0, 3], PhotometricInterpretation="MONOCHROME1", Modality="MR")
    volume = load_scene(tmp_path / "mr").description.volume
    values = volume.grid * volume.slope + volume.intercept
    assert values[0, 1, 0] > values[1, 1, 0]


def test_missing_and_doubled_slices_are_told(tmp_path):
    save_series(tmp_path / "ct", [0, 3, 6, 12, 15])
    scene = load_scene(tmp_path / "ct")
    assert "1 slice is missing: between 6 and 12 mm; 6 are interpolated from 5" in scene.notes
    assert scene.description.volume.grid[:, 1, 0].tolist() == [0, 30, 60, 90, 120, 150]
    save_slice(tmp_path / "ct" / "again", np.full((4, 5), 500), ImagePositionPatient=[-7, -9, 6], InstanceNumber=99)
    scene = load_scene(tmp_path / "ct")
    assert "1 slices lie where others lie, and are left out" in scene.notes
    assert scene.description.volume.grid[2, 1, 0] == 60


def test_files_that_are_no_slices_are_counted(tmp_path):
    folder = tmp_path / "ct"
    save_series(folder, range(0, 36, 3))
    empty, cut, half, html, link = sorted(folder.iterdir())[1:6]
    empty.write_bytes(b"")
    cut.write_bytes(cut.read_bytes()[:250])
    half.write_bytes(half.read_bytes()[:-5])
    html.write_text("<html>not found</html>")
    link.unlink()
    link.symlink_to("nowhere")
    (folder / ".DS_Store").write_bytes(b"x")
    gaps = "5 slices are missing: between 0 and 9, 9 and 15, 18 and 27 mm; 12 are interpolated from 7"
    line = "5 of 13 files are left out: 1 empty ('a-1'), 2 damaged ('a-10'), 1 no DICOM ('a-2'), 1 link ('a-3')"
    for path in (folder, folder / "a-0"):  # as a folder, and as one of its files
        scene = load_scene(path)
        assert line in scene.notes
        assert gaps in scene.notes


@pytest.mark.parametrize("size", [140, 200, 250, 400])
def test_a_file_cut_anywhere_in_its_header_is_counted(tmp_path, size):
    save_series(tmp_path / "ct", [0, 3, 6])
    path = tmp_path / "ct" / "a-1"
    path.write_bytes(path.read_bytes()[:size])
    assert "1 of 3 files is left out: 1 damaged ('a-1')" in load_scene(tmp_path / "ct").notes


def test_reports_and_directories_are_not_missed(tmp_path):
    save_series(tmp_path / "ct", [0, 3, 6])
    path = tmp_path / "ct" / "report"
    save_slice(path, np.zeros((4, 5)), Rows=None, Columns=None)
    path.write_bytes(path.read_bytes().replace(b"1.2.840.10008.5.1.4.1.1.2\0", b"1.2.840.10008.1.3.10\0\0\0\0\0\0"))
    assert not any("left out" in note for note in load_scene(tmp_path / "ct").notes)


def test_files_without_places_tell_which_numbers_are_missing(tmp_path):
    for number in (1, 2, 5):
        path = tmp_path / "old" / str(number)
        path.parent.mkdir(exist_ok=True)
        save_slice(path, np.full((4, 5), number), InstanceNumber=number)
    assert "2 slices are missing: between 2 and 5 numbers" in load_scene(tmp_path / "old").notes


def test_one_slice_is_as_thick_as_it_says(tmp_path):
    save_series(tmp_path / "ct", [4])
    volume = load_scene(tmp_path / "ct").description.volume
    assert (volume.size, volume.spacing.tolist()) == ((5, 4, 1), [1, 2, 3])


def test_a_tilted_gantry_shears_the_stack(tmp_path):
    folder = tmp_path / "ct"
    folder.mkdir()
    for number in range(3):
        place = [0, number, 3 * number]
        save_slice(folder / str(number), np.full((4, 5), number), ImagePositionPatient=place)
    volume = load_scene(folder).description.volume
    assert volume.world_from_voxel[:3, 2] == pytest.approx([0, 3, -1])


def test_several_series(tmp_path):
    save_series(tmp_path / "all", [0, 3, 6], SeriesInstanceUID="1.1", SeriesDescription="bone")
    save_series(tmp_path / "all", [0, 3], SeriesInstanceUID="1.2", SeriesDescription="lung")
    scene = load_scene(tmp_path / "all")
    assert scene.description.volume.size[2] == 3
    assert any("1 'bone' (3), 2 'lung' (2)" in note for note in scene.notes)
    for name in ("2", "lung", "1.2"):
        assert load_scene(tmp_path / "all", series=name).description.volume.size[2] == 2
    with pytest.raises(UsageError, match=r"1 'bone' \(3\), 2 'lung' \(2\)"):
        load_scene(tmp_path / "all", series="4")


def test_files_without_places_are_taken_in_the_order_of_their_numbers(tmp_path):
    save_series(tmp_path / "old", range(3), ImagePositionPatient=None, PixelSpacing=None)
    notes = load_scene(tmp_path / "old").notes
    assert any("places are not told" in note for note in notes)
    assert not any("missing" in note for note in notes)
    assert any("size of pixels is not told" in note for note in notes)


def test_what_shows_nothing_is_refused_in_one_line(tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(SceneError, match="is a folder, not a scene file"):
        load_scene(tmp_path / "empty")
    save_series(tmp_path / "cut", [0])
    (path,) = (tmp_path / "cut").iterdir()
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(SceneError, match="cut: cannot be read"):
        load_scene(tmp_path / "cut")
    save_series(tmp_path / "color", [0], SamplesPerPixel=3, PhotometricInterpretation="RGB", PlanarConfiguration=0)
    with pytest.raises(SceneError, match="holds colour pictures alone"):
        load_scene(tmp_path / "color")
    (tmp_path / "a.dcm").write_bytes(b"\0" * 128 + b"DICM" + b"\xff" * 50)
    with pytest.raises(SceneError, match=r"a\.dcm: "):
        load_scene(tmp_path / "a.dcm")
    save_series(tmp_path / "huge", [0], Rows=65535, Columns=65535)
    with pytest.raises(SceneError, match="huge: "):
        load_scene(tmp_path / "huge")


def test_an_unknown_compression_is_named(tmp_path):
    import pydicom
    from pydicom.encaps import encapsulate

    save_series(tmp_path / "ls", [0])
    (path,) = (tmp_path / "ls").iterdir()
    data = pydicom.dcmread(path)
    data.PixelData = encapsulate([b"\xff\xd8\xff\xd9"])
    data["PixelData"].is_undefined_length = True
    data["PixelData"].VR = "OB"
    data.file_meta.TransferSyntaxUID = (
        pydicom.uid.JPEGXL if hasattr(pydicom.uid, "JPEGXL") else "1.2.840.10008.1.2.4.80"
    )
    data.save_as(path)
    with pytest.raises(SceneError, match=r"ls: (its pixels are compressed as|cannot be read)"):
        load_scene(tmp_path / "ls")


def test_links_in_a_folder_are_left_alone(tmp_path):
    save_series(tmp_path / "ct", [0, 3])
    save_series(tmp_path / "other", [6])
    (tmp_path / "ct" / "link").symlink_to(next((tmp_path / "other").iterdir()))
    assert load_scene(tmp_path / "ct").description.volume.size[2] == 2


def test_the_library_s_own_test_files():
    folder = Path(pytest.importorskip("pydicom").__file__).parent / "data" / "test_files"
    if not (folder / "CT_small.dcm").exists():
        pytest.skip("pydicom came without its test files")
    volume = load_scene(folder / "CT_small.dcm").description.volume
    assert volume.size == (128, 128, 1)
    assert volume.spacing == pytest.approx([0.661468, 0.661468, 5.0])
