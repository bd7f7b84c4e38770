"""Clouds of points of the Point Cloud Library: text, binary and packed."""

import struct

import numpy as np
import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.load import load_scene

POINTS = np.array([(0, 0, 0, 0xFF8000), (1, 0, 0, 0x0000FF), (0, 2, 0, 0x00FF00), (0, 0, 3, 0x102030)], np.float64)
PLACES, CODES = POINTS[:, :3].astype("<f4"), POINTS[:, 3].astype("<u4")
HEADER = (
    "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z _ rgb\nSIZE 4 4 4 1 4\nTYPE F F F U {kind}\n"
    "COUNT 1 1 1 3 1\nWIDTH 4\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\nDATA {form}\n"
)


def body_of(form):
    if form == "ascii":
        rows = zip(PLACES.tolist(), CODES.tolist(), strict=True)
        return "".join(f"{' '.join(map(str, place))} 0 0 0 {code}\n" for place, code in rows).encode()
    gap = np.zeros((4, 3), np.uint8)
    if form == "binary":
        return b"".join(PLACES[n].tobytes() + gap[n].tobytes() + CODES[n].tobytes() for n in range(4))
    fields = b"".join([*(PLACES[:, axis].tobytes() for axis in range(3)), gap.tobytes(), CODES.tobytes()])
    # LZF: runs of up to 32 bytes as they are, but for the twelve bytes of 0 of the gap, which refer to the one before.
    first, rest = fields[:49], fields[60:]
    runs = [run[place : place + 32] for run in (first, rest) for place in range(0, len(run), 32)]
    split = -(-len(first) // 32)
    packed = [bytes([len(run) - 1]) + run for run in runs]
    packed.insert(split, bytes([7 << 5, 11 - 9, 0]))
    data = b"".join(packed)
    return struct.pack("<II", len(data), len(fields)) + data


@pytest.mark.parametrize("form", ["ascii", "binary", "binary_compressed"])
def test_places_and_colours(tmp_path, form):
    path = tmp_path / "a.pcd"
    path.write_bytes(HEADER.format(kind="U", form=form).encode() + body_of(form))
    scene = load_scene(path)
    assert "up is taken as +y, for nothing in the data says it (else up=z, or -y of depth cameras)" in scene.notes
    (mesh,) = (mesh for mesh in scene.description.meshes if mesh.fitted)
    corners = mesh.positions.reshape(4, -1, 3)
    assert corners.mean(axis=1) == pytest.approx(PLACES, abs=1e-4)
    reds = mesh.colors.reshape(4, -1, mesh.colors.shape[1])[:, 0, :3]
    assert reds[1].tolist() == [0, 0, 1]
    assert reds[2].tolist() == [0, 1, 0]
    assert reds[0, 0] == 1
    assert reds[0, 1] == pytest.approx(((128 / 255 + 0.055) / 1.055) ** 2.4, abs=1e-4)


def test_colours_as_the_bits_of_floats_and_points_that_are_none(tmp_path):
    places = PLACES.copy()
    places[3] = np.nan
    gap = bytes(3)
    body = b"".join(places[n].tobytes() + gap + CODES[n].tobytes() for n in range(4))
    (tmp_path / "a.pcd").write_bytes(HEADER.format(kind="F", form="binary").encode() + body)
    scene = load_scene(tmp_path / "a.pcd")
    assert "1 points without finite coordinates are left out" in scene.notes


@pytest.mark.parametrize("kind", ["F8", "U8", "I4", "U1"])
def test_colours_of_any_width(tmp_path, kind):
    codes = CODES.view("<f4") if kind == "F8" else CODES
    rows = "".join(f"{' '.join(map(str, place))} {code:.9g}\n" for place, code in zip(PLACES, codes, strict=True))
    head = f"FIELDS x y z rgb\nSIZE 4 4 4 {kind[1]}\nTYPE F F F {kind[0]}\nPOINTS 4\nDATA ascii\n"
    if kind == "U1":
        rows = rows.replace(" 16744448", " 1").replace(" 65280", " 2").replace(" 1056816", " 3")
    (tmp_path / "a.pcd").write_text(head + rows)
    (mesh,) = load_scene(tmp_path / "a.pcd").description.meshes
    colors = mesh.colors.reshape(4, -1, mesh.colors.shape[1])[:, 0, :3]
    assert colors[1].tolist() == [0, 0, 1]
    assert kind == "U1" or colors[2].tolist() == [0, 1, 0]


def test_fewer_points_than_none_are_refused(tmp_path):
    head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS -1\nDATA binary\n"
    (tmp_path / "a.pcd").write_bytes(head.encode() + PLACES.tobytes())
    with pytest.raises(SceneError, match=r"\(-1 points\)"):
        load_scene(tmp_path / "a.pcd")


@pytest.mark.parametrize("form", ["ascii", "binary", "binary_compressed", "packed"])
def test_files_that_are_cut_short_or_of_another_form_are_one_line(tmp_path, form):
    body = body_of("binary" if form == "packed" else form)[:-9]
    (tmp_path / "a.pcd").write_bytes(HEADER.format(kind="U", form=form).encode() + body)
    with pytest.raises(SceneError, match=r"^a\.pcd: is no PCD file that makes sense") as error:
        load_scene(tmp_path / "a.pcd")
    assert "\n" not in str(error.value)
