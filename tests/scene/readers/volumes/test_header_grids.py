"""NRRD and MetaImage files as volumes."""

import bz2
import gzip
import zlib

import numpy as np
import pytest

from lippmann.errors import MemoryLimitError, SceneError
from lippmann.scene.readers.load import load_scene

GRID = np.random.default_rng(0).integers(-5, 900, (4, 3, 2)).astype(np.int16)  # z, y, x
#: Voxels 1 x 2 x 3 mm apart, from (10, 20, 30) mm to a patient's left, back and head on, as the world has it.
PLACES = [[1, 0, 0, 10], [0, 0, 3, 30], [0, -2, 0, -20], [0, 0, 0, 1]]
NRRD = (
    "NRRD0005\n# by hand: a test\ntype: {kind}\ndimension: 3\nspace: {space}\nsizes: 2 3 4\n"
    "space directions: {steps}\nkinds: domain domain domain\nendian: {endian}\nencoding: {encoding}\n"
    "space origin: {origin}\nkey:=value\n{more}\n"
)
LPS = {"space": "left-posterior-superior", "steps": "(1,0,0) (0,2,0) (0,0,3)", "origin": "(10,20,30)"}
RAS = {"space": "RAS", "steps": "(-1,0,0) (0,-2,0) (0,0,3)", "origin": "(-10, -20, 30)"}
META = (
    "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = {packed}\n"
    "TransformMatrix = {turn}\nOffset = 10 20 30\nElementSpacing = {spacing}\nDimSize = 2 3 4\n"
    "ElementType = MET_SHORT\nElementDataFile = {file}\n"
)


def volume_of(path):
    return load_scene(path).description.volume


@pytest.mark.parametrize("axes", [LPS, RAS])
@pytest.mark.parametrize(("kind", "endian", "dtype"), [("short", "little", "<i2"), ("long long int", "big", ">i8")])
@pytest.mark.parametrize(
    ("encoding", "pack"), [("raw", bytes), ("gzip", gzip.compress), ("bzip2", bz2.compress), ("ascii", None)]
)
def test_nrrd_lies_as_its_directions_say(tmp_path, axes, kind, endian, dtype, encoding, pack):
    header = NRRD.format(kind=kind, endian=endian, encoding=encoding, more="", **axes)
    text = " ".join(map(str, GRID.ravel().tolist())).encode()
    (tmp_path / "a.nrrd").write_bytes(header.encode() + (pack(GRID.astype(dtype).tobytes()) if pack else text))
    volume = volume_of(tmp_path / "a.nrrd")
    assert (volume.grid == GRID).all()
    assert volume.world_from_voxel == pytest.approx(np.array(PLACES))


def test_voxels_in_a_file_of_their_own(tmp_path):
    header = NRRD.format(kind="int16", endian="little", encoding="raw", more="data file: a.raw\nbyte skip: 5", **LPS)
    (tmp_path / "a.nhdr").write_text(header)
    (tmp_path / "a.raw").write_bytes(b"12345" + GRID.tobytes())
    assert (volume_of(tmp_path / "a.nhdr").grid == GRID).all()
    (tmp_path / "a.nhdr").write_text(header.replace("skip: 5", "skip: -1"))
    assert (volume_of(tmp_path / "a.nhdr").grid == GRID).all()


def test_bytes_before_packed_voxels_are_unpacked_within_the_memory_alone(tmp_path):
    more = f"byte skip: {10**15}\n"
    header = NRRD.format(kind="int16", endian="little", encoding="gzip", more=more, **LPS).encode()
    (tmp_path / "a.nrrd").write_bytes(header + b"\n" + gzip.compress(bytes(100)))
    with pytest.raises(MemoryLimitError, match="bytes before the voxels"):
        load_scene(tmp_path / "a.nrrd")


@pytest.mark.parametrize(("encoding", "pack"), [("raw", bytes), ("gzip", gzip.compress)])
def test_lines_and_then_bytes_before_the_voxels_are_skipped(tmp_path, encoding, pack):
    more = "line skip: 2\nbyte skip: 3\n"
    header = NRRD.format(kind="int16", endian="little", encoding=encoding, more=more, **LPS).encode()
    body = b"a title\nand more\n" + pack(b"123" + GRID.tobytes())
    (tmp_path / "a.nrrd").write_bytes(header + body)
    assert (volume_of(tmp_path / "a.nrrd").grid == GRID).all()
    (tmp_path / "a.nhdr").write_bytes(header.replace(b"line skip", b"data file: a.raw\nline skip"))
    (tmp_path / "a.raw").write_bytes(body)
    assert (volume_of(tmp_path / "a.nhdr").grid == GRID).all()
    (tmp_path / "a.raw").write_bytes(b"a title\n")
    with pytest.raises(SceneError, match=r"has no 2 lines before its voxels"):
        volume_of(tmp_path / "a.nhdr")


def test_nrrd_without_a_patient_has_slice_0_in_front(tmp_path):
    header = "NRRD0004\ntype: int16\ndimension: 3\nsizes: 2 3 4\nspacings: 1 2 3\nencoding: raw\nendian: little\n\n"
    (tmp_path / "a.nrrd").write_bytes(header.encode() + GRID.tobytes())
    scene = load_scene(tmp_path / "a.nrrd")
    assert scene.description.volume.world_from_voxel.tolist() == np.diag([1.0, -2, -3, 1]).tolist()
    assert "nothing says how a patient lies: slice 0 is in front, its row 0 on top" in scene.notes


@pytest.mark.parametrize("packed", [True, False])
@pytest.mark.parametrize("file", ["LOCAL", "a.zraw"])
def test_metaimages_lie_as_a_patient(tmp_path, packed, file):
    body = zlib.compress(GRID.tobytes()) if packed else GRID.tobytes()
    header = META.format(packed=packed, file=file, turn="1 0 0 0 1 0 0 0 1", spacing="1 2 3").encode()
    (tmp_path / "a.mha").write_bytes(header + body if file == "LOCAL" else header)
    (tmp_path / "a.zraw").write_bytes(body)
    volume = volume_of(tmp_path / "a.mha")
    assert (volume.grid == GRID).all()
    assert volume.world_from_voxel == pytest.approx(np.array(PLACES))


def test_rows_of_a_metaimage_s_matrix_are_directions(tmp_path):
    """Axis 0 toward the back, axis 1 toward the head, axis 2 toward the left: a sagittal series."""
    header = META.format(packed=False, file="LOCAL", turn="0 1 0 0 0 1 1 0 0", spacing="2 3 1")
    (tmp_path / "a.mha").write_bytes(header.encode() + GRID.tobytes())
    steps = volume_of(tmp_path / "a.mha").world_from_voxel[:3, :3]
    assert steps.T.tolist() == [[0, 0, -2], [0, 3, 0], [1, 0, 0]]


@pytest.mark.parametrize(
    "names", ["data file: slice%02d.raw 1 4 1 2", "data file: LIST\nslice01.raw\nslice02.raw\nslice03.raw\nslice04.raw"]
)
def test_a_file_for_each_slice(tmp_path, names):
    header = NRRD.format(kind="short", endian="little", encoding="raw", more="", **LPS).rstrip()
    (tmp_path / "a.nhdr").write_text(f"{header}\n{names}\n")
    for number, part in enumerate(GRID, 1):
        (tmp_path / f"slice{number:02}.raw").write_bytes(part.tobytes())
    (tmp_path / "b.nrrd").write_bytes(f"{header}\n\n".encode() + GRID.tobytes())
    assert (volume_of(tmp_path / "a.nhdr").grid == volume_of(tmp_path / "b.nrrd").grid).all()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("short", "block"), "has a header without sense"),
        (("encoding: raw", "encoding: hex"), "encoding hex; raw, text, gzip and bzip2 are read"),
        (("encoding: raw", "encoding: ascii"), "holds voxels that are no numbers"),
        (("sizes: 2 3 4", "sizes: 3 2 2 2"), "one number a voxel on three axes"),
        (
            (
                "sizes: 2 3 4\nspace directions: (1,0,0) (0,2,0) (0,0,3)",
                "sizes: 2 3 2 2\nspace directions: " + "(1,0,0,0) (0,2,0,0) (0,0,3,0) (0,0,0,1)",
            ),
            "has .2, 3, 2, 2. values",
        ),
        (("kinds: domain", "kinds: vector"), "2 values a voxel, vector; one is read"),
        (("sizes: 2 3 4", "sizes: 2 3 5"), "holds 48 of 60 bytes of voxels"),
        (("(0,0,3)", "(0,2,0)"), "its voxels have no extent"),
        (("key:=value", "data file: LIST"), "names 0 files of voxels"),
        (("key:=value", "data file: a%d.raw 1 5 1"), "names 5 files of voxels; each holds as many of them"),
        (("key:=value", "data file: a%d.raw 1 4 1"), "file of voxels 'a1.raw' not found"),
        (("key:=value", "data file: ../b.raw"), "allow_outside"),
    ],
)
def test_what_is_not_shown_is_refused_in_one_line(tmp_path, change, said):
    header = NRRD.format(kind="short", endian="little", encoding="raw", more="", **LPS).replace(*change)
    (tmp_path / "a.nrrd").write_bytes(header.encode() + GRID.tobytes())
    with pytest.raises(SceneError, match=said) as error:
        load_scene(tmp_path / "a.nrrd")
    assert "\n" not in str(error.value)
