"""DICOM series: the order and distance of slices, which series, and what is refused."""

import io
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


def test_values_stay_whichever_way_viewers_show_them(tmp_path):
    """MONOCHROME1 says only how the last grey-scale step ends (PS3.3 C.7.6.3.1.2)."""
    for word in ("MONOCHROME1", "MONOCHROME2"):
        save_series(tmp_path / word, [0, 3], PhotometricInterpretation=word)
    scene = load_scene(tmp_path / "MONOCHROME1")
    volume, other = scene.description.volume, load_scene(tmp_path / "MONOCHROME2").description.volume
    assert (volume.grid == other.grid).all()
    assert volume.slope == 1
    assert "viewers show its low values bright (MONOCHROME1): here, high values are dense" in scene.notes


def save_frames(path, **values):
    """Three frames of one file, which hold 0, 10 and 20; the first lies at (-7, -9, 5)."""
    frames = np.repeat([0, 10, 20], 20).reshape(3, 4, 5)
    common = {"NumberOfFrames": 3, "ImagePositionPatient": [-7, -9, 5], "RescaleSlope": None, "RescaleIntercept": None}
    save_slice(path, frames, **{**common, **values})
    return load_scene(path)


ROW_DOWN, BACK = [1, 0, 0, 0, 0, -1], [0, 1, 0]  # a coronal plane, whose normal leads to the back


@pytest.mark.parametrize(
    ("values", "matrix_step", "first"),
    [
        ({"GridFrameOffsetVector": [0, 4, 8]}, [0, 0, 4], [-7, -9, 5]),
        ({"GridFrameOffsetVector": [0, -4, -8]}, [0, 0, 4], [-7, -9, -3]),
        ({"GridFrameOffsetVector": [5, 9, 13]}, [0, 0, 4], [-7, -9, 5]),
        ({"GridFrameOffsetVector": [5, 1, -3]}, [0, 0, 4], [-7, -9, -3]),
        ({"GridFrameOffsetVector": [0, 4, 8], "ImageOrientationPatient": ROW_DOWN}, [0, 4, 0], [-7, -9, 5]),
        ({"SpacingBetweenSlices": 2.5}, [0, 0, 2.5], [-7, -9, 5]),
        ({"SpacingBetweenSlices": 2.5, "SliceVector": [3, 2, 1]}, [0, 0, 2.5], [-7, -9, 5]),
    ],
)
def test_frames_lie_where_one_number_says(tmp_path, values, matrix_step, first):
    volume = save_frames(tmp_path / "a.dcm", **values).description.volume
    assert volume.size == (5, 4, 3)
    left, back, head = volume.world_from_voxel[:3, 2]
    assert [left, -head, back] == pytest.approx(matrix_step)  # the patient is seen from the front, head up
    x, y, z = volume.world_from_voxel[:3, 3]
    assert [x, -z, y] == pytest.approx(first)
    falls = first[2] == -3 or "SliceVector" in values
    assert volume.grid[:, 0, 0].tolist() == ([20, 10, 0] if falls else [0, 10, 20])


def test_doses_are_scaled(tmp_path):
    volume = save_frames(tmp_path / "a.dcm", GridFrameOffsetVector=[0, 3, 6], DoseGridScaling="1e-3").description.volume
    assert volume.slope == 1e-3


def test_a_tomogram_of_nuclear_medicine_lies_as_its_detector(tmp_path):
    import pydicom

    detector = pydicom.Dataset()
    detector.ImagePositionPatient, detector.ImageOrientationPatient = [-7, -9, 5], [1, 0, 0, 0, 1, 0]
    own = {"ImagePositionPatient": None, "ImageOrientationPatient": None, "DetectorInformationSequence": [detector]}
    volume = save_frames(tmp_path / "a.dcm", SpacingBetweenSlices=3, SliceVector=[1, 2, 3], **own).description.volume
    assert volume.size == (5, 4, 3)
    assert volume.world_from_voxel.tolist() == [[1, 0, 0, -7], [0, 0, 3, 5], [0, -2, 0, 9], [0, 0, 0, 1]]


def group(**sequences):
    """A functional group: sequences of one item each, by name and value."""
    import pydicom

    made = pydicom.Dataset()
    for sequence, (name, value) in sequences.items():
        item = pydicom.Dataset()
        setattr(item, name, value)
        setattr(made, sequence, [item])
    return made


def test_frames_of_enhanced_files_lie_by_their_groups(tmp_path):
    plain = {"ImagePositionPatient": None, "ImageOrientationPatient": None, "PixelSpacing": None}
    shared = group(
        PlaneOrientationSequence=("ImageOrientationPatient", [1, 0, 0, 0, 1, 0]),
        PixelMeasuresSequence=("PixelSpacing", [2, 1]),
    )
    own = [group(PlanePositionSequence=("ImagePositionPatient", [-7, -9, 4 * k])) for k in (2, 1, 0)]
    sequences = {"SharedFunctionalGroupsSequence": [shared], "PerFrameFunctionalGroupsSequence": own}
    volume = save_frames(tmp_path / "a.dcm", **plain, **sequences).description.volume
    assert volume.grid[:, 0, 0].tolist() == [20, 10, 0]
    assert volume.world_from_voxel.tolist() == [[1, 0, 0, -7], [0, 0, 4, 0], [0, -2, 0, 9], [0, 0, 0, 1]]


def test_frames_of_ultrasound_lie_in_the_volume_of_the_probe(tmp_path):
    plain = {"ImagePositionPatient": None, "ImageOrientationPatient": None}
    shared = group(PlaneOrientationVolumeSequence=("ImageOrientationVolume", [1, 0, 0, 0, 1, 0]))
    own = [group(PlanePositionVolumeSequence=("ImagePositionVolume", [0, 0, 2 * k])) for k in (0, 1, 2)]
    sequences = {"SharedFunctionalGroupsSequence": [shared], "PerFrameFunctionalGroupsSequence": own}
    volume = save_frames(tmp_path / "a.dcm", **plain, **sequences).description.volume
    assert volume.spacing.tolist() == [1, 2, 2]
    assert volume.grid[:, 0, 0].tolist() == [0, 10, 20]


def test_frames_that_are_moments_are_noted(tmp_path):
    scene = save_frames(tmp_path / "a.dcm", FrameIncrementPointer=0x00181063, FrameTime=40)
    assert "its frames are moments (FrameTime): they are shown as slices" in scene.notes


@pytest.mark.parametrize(
    ("values", "spacing"),
    [
        ({"ImagerPixelSpacing": [4, 3]}, [3, 4]),
        ({"NominalScannedPixelSpacing": [4, 3]}, [3, 4]),
        ({"PixelAspectRatio": [3, 2]}, [1, 1.5]),
    ],
)
def test_sizes_of_pixels_are_told_in_several_ways(tmp_path, values, spacing):
    save_series(tmp_path / "ct", [0, 3], PixelSpacing=None, **values)
    scene = load_scene(tmp_path / "ct")
    assert scene.description.volume.spacing.tolist()[:2] == spacing
    assert not any("size of pixels" in note for note in scene.notes)


@pytest.mark.parametrize(("padding", "limit"), [(900, None), (800, 1000), (1000, 800)])
def test_padding_is_as_low_as_the_lowest_value(tmp_path, padding, limit):
    pixels = np.full((4, 5), 40)
    pixels[0], pixels[1] = 900, -50
    more = {"PixelPaddingValue": padding, "PixelPaddingRangeLimit": limit}
    save_slice(tmp_path / "a.dcm", pixels, ImagePositionPatient=[0, 0, 0], **more)
    assert load_scene(tmp_path / "a.dcm").description.volume.grid[0, :, 0].tolist() == [-50, -50, 40, 40]


def test_a_table_of_the_modality(tmp_path):
    import pydicom

    table = pydicom.Dataset()
    table.LUTDescriptor, table.ModalityLUTType = [3, 0, 16], "US"
    table.add_new(0x00283006, "US", [100, 300, 200])
    plain = {"RescaleSlope": None, "RescaleIntercept": None, "PixelRepresentation": 0}
    pixels = np.tile([[0], [1], [2], [2]], (1, 5))
    save_slice(tmp_path / "a.dcm", pixels, ImagePositionPatient=[0, 0, 0], ModalityLUTSequence=[table], **plain)
    assert load_scene(tmp_path / "a.dcm").description.volume.grid[0, :, 0].tolist() == [100, 300, 200, 200]
    for tag in ("LUTDescriptor", "LUTData"):  # as LEADTOOLS writes it
        table[tag].value = None
    save_slice(tmp_path / "a.dcm", pixels, ImagePositionPatient=[0, 0, 0], ModalityLUTSequence=[table], **plain)
    assert load_scene(tmp_path / "a.dcm").description.volume.grid[0, :, 0].tolist() == [0, 1, 2, 2]


@pytest.mark.parametrize("stored", [12, 16])
def test_bits_beyond_those_stored_do_not_count(tmp_path, stored):
    pixels = np.full((4, 5), 0x1005)
    bits = {"BitsStored": stored, "HighBit": stored - 1, "PixelRepresentation": 0}
    save_slice(tmp_path / "a.dcm", pixels, ImagePositionPatient=[0, 0, 0], **bits)
    assert load_scene(tmp_path / "a.dcm").description.volume.grid[0, 0, 0] == (5 if stored == 12 else 0x1005)


def test_missing_and_doubled_slices_are_told(tmp_path):
    save_series(tmp_path / "ct", [0, 3, 6, 12, 15])
    scene = load_scene(tmp_path / "ct")
    assert "1 slice is missing: between 6 and 12 mm; 6 are interpolated from 5" in scene.notes
    assert scene.description.volume.grid[:, 1, 0].tolist() == [0, 30, 60, 90, 120, 150]
    assert scene.description.volume.spacing[2] == pytest.approx(3)
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


def test_slices_without_the_mark_are_read_beside_others(tmp_path):
    folder = tmp_path / "ct"
    save_series(folder, range(0, 18, 3))
    expected = load_scene(folder).description.volume.grid
    for path in sorted(folder.iterdir())[1::2]:
        save_bare(path)
    for path in (folder, folder / "a-1", folder / "a-2"):
        scene = load_scene(path)
        assert not any("left out" in note for note in scene.notes)
        assert np.array_equal(scene.description.volume.grid, expected)


def save_bare(path):
    """Write a file as before 2000: the data set alone, without the mark and what goes with it."""
    import pydicom

    data, whole = pydicom.dcmread(path), io.BytesIO()
    pydicom.dcmwrite(whole, pydicom.Dataset(data), implicit_vr=True, little_endian=True, enforce_file_format=False)
    path.write_bytes(whole.getvalue())


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


def test_a_named_file_that_shows_nothing_is_not_replaced_by_its_neighbours(tmp_path):
    save_series(tmp_path, [0, 3], SeriesInstanceUID="1.1")
    tiles = {"NumberOfFrames": 3, "TotalPixelMatrixColumns": 15, "TotalPixelMatrixRows": 4}
    save_slice(tmp_path / "slide.dcm", np.zeros((3, 4, 5)), SeriesInstanceUID="1.2", **tiles)
    with pytest.raises(
        SceneError, match=r"slide\.dcm: holds tiles of a microscope's slide, which is no volume; series"
    ):
        load_scene(tmp_path / "slide.dcm")
    color = {"SamplesPerPixel": 3, "PhotometricInterpretation": "RGB", "PlanarConfiguration": 0}
    save_slice(tmp_path / "colour.dcm", np.zeros((4, 5)), SeriesInstanceUID="1.3", **color)
    with pytest.raises(SceneError, match=r"colour\.dcm: holds colour pictures alone"):
        load_scene(tmp_path / "colour.dcm")
    assert load_scene(tmp_path / "colour.dcm", series="1.1").description.volume.size[2] == 2
    assert load_scene(tmp_path).description.volume.size[2] == 2


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


def compress(path):
    """The file's pixels as those of high-throughput JPEG 2000, which nothing installed decodes."""
    import pydicom
    from pydicom.encaps import encapsulate

    data = pydicom.dcmread(path)
    data.PixelData = encapsulate([b"\xff\xd8\xff\xd9"])
    data["PixelData"].is_undefined_length = True
    data["PixelData"].VR = "OB"
    data.file_meta.TransferSyntaxUID = pydicom.uid.HTJ2K
    data.save_as(path)


@pytest.mark.parametrize("syntax", ["JPEGLossless", "JPEGLosslessSV1", "JPEGLSLossless"])
@pytest.mark.parametrize("lowest", [0, -1024])
def test_lossless_jpeg_as_archives_of_clinics_keep_it(tmp_path, syntax, lowest):
    import imagecodecs
    import pydicom
    from pydicom.encaps import encapsulate

    pixels = np.arange(lowest, lowest + 20, dtype=np.int16).reshape(4, 5)
    path = tmp_path / "a.dcm"
    save_slice(path, pixels, BitsStored=12, HighBit=11, PixelRepresentation=int(lowest < 0))
    data, codes = pydicom.dcmread(path), pixels.astype(np.uint16) & 4095
    if syntax == "JPEGLSLossless":
        coded = imagecodecs.jpegls_encode(codes)
    else:
        coded = imagecodecs.jpeg8_encode(codes, lossless=True, bitspersample=12)
    data.PixelData = encapsulate([coded])
    data["PixelData"].is_undefined_length = True
    data.file_meta.TransferSyntaxUID = getattr(pydicom.uid, syntax)
    data.save_as(path)
    assert (load_scene(path).description.volume.grid[0] == pixels).all()


def test_an_unknown_compression_is_named(tmp_path):
    save_series(tmp_path / "ls", [0])
    compress(next((tmp_path / "ls").iterdir()))
    with pytest.raises(SceneError, match=r"ls: (its pixels are compressed as|cannot be read)"):
        load_scene(tmp_path / "ls")


def test_a_slice_of_an_unknown_compression_is_left_out_of_its_series(tmp_path):
    save_series(tmp_path / "ct", [0, 3, 6, 9])
    read = pytest.importorskip("pydicom").dcmread
    path = next(each for each in (tmp_path / "ct").iterdir() if read(each).ImagePositionPatient[2] == 3)
    compress(path)
    scene = load_scene(tmp_path / "ct")
    assert scene.description.volume.grid[:, 1, 0].tolist() == [0, 30, 60, 90]
    assert any(
        "1 of 4 files is left out: 1 compressed as High-Throughput JPEG 2000" in each and path.name in each
        for each in scene.notes
    )


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
