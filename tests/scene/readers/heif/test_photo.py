"""HEIF photographs: colours, depth, what is refused."""

import io
import sys

import numpy as np
import pytest
from PIL import Image as Pillow

from lippmann.codecs.icc import convert_codes, rgb_profile
from lippmann.errors import MemoryLimitError, PictureError, SceneError
from lippmann.quilts.files import read_quilt
from lippmann.quilts.photos import read_photos
from lippmann.runtime import machine
from lippmann.scene.readers.heif.photo import read_heif_photo
from lippmann.scene.readers.load import load_scene

pytest.importorskip("pillow_heif", reason="pillow-heif is not installed")

import pillow_heif
from heif_files import gradient, heif

PIXELS, DEPTH = gradient()
P3 = (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290)


@pytest.mark.parametrize("representation", [None, 0, 1])
def test_colours_and_depth(representation):
    image, found = read_heif_photo(heif(PIXELS, DEPTH, representation=representation), "x.heic")
    assert image.pixels.shape == PIXELS.shape
    assert np.abs(image.pixels.astype(int) - PIXELS).mean() < 4  # half the colours, in each direction
    assert np.abs(found.inverse - DEPTH).mean() < 2


def test_a_scene_of_it_comes_nearer_where_the_map_is_brighter(tmp_path):
    path = tmp_path / "x.heic"
    path.write_bytes(heif(PIXELS, DEPTH))
    scene = load_scene(path)
    points = scene.description.meshes[0].positions
    assert np.corrcoef(points[:, 0], points[:, 2])[0, 1] > 0.99


def saved(picture, **options):
    stream = io.BytesIO()
    pillow_heif.from_pillow(picture).save(stream, quality=-1, **options)
    return stream.getvalue()


def test_it_is_upright():
    exif = Pillow.Exif()
    exif[0x112] = 6
    picture = np.zeros((64, 96, 3), np.uint8)
    picture[:32] = 200
    data = saved(Pillow.fromarray(np.rot90(picture).copy()), exif=exif.tobytes())
    image, _ = read_heif_photo(data, "x.heic")
    assert np.abs(image.pixels.astype(int) - picture).max() < 8


@pytest.mark.parametrize(
    "options", [{"icc_profile": rgb_profile(P3)}, {"color_primaries": 12, "transfer_characteristics": 13}]
)
def test_colours_of_p3_become_srgb(options):
    image, _ = read_heif_photo(saved(Pillow.new("RGB", (64, 64), (90, 128, 150)), **options), "x.heic")
    assert image.pixels[32, 32] == pytest.approx((78, 129, 152), abs=2)  # by the matrix of CSS Color 4


def test_colours_beyond_a_display_are_named():
    data = saved(Pillow.new("RGB", (64, 64)), color_primaries=9, transfer_characteristics=16)
    with pytest.raises(SceneError, match=r"x\.heic: its colours are PQ; codes of a standard dynamic range are read"):
        read_heif_photo(data, "x.heic")


def test_another_depth_map_takes_the_place_of_its_own(tmp_path):
    path = tmp_path / "x.heic"
    path.write_bytes(heif(PIXELS))
    with pytest.raises(SceneError, match=r"x\.heic: needs a depth map"):
        load_scene(path)
    np.save(tmp_path / "d.npy", 1.0 / (1.0 + DEPTH))
    assert load_scene(path, depth_map=tmp_path / "d.npy").description.meshes


def test_a_portrait_that_is_asked_for_as_a_pair_says_what_it_is(tmp_path):
    path = tmp_path / "portrait.heic"
    path.write_bytes(heif(np.zeros((64, 64, 3), np.uint8), np.zeros((32, 32), np.uint8)))
    with pytest.raises(PictureError, match=r"portrait\.heic: is a photograph with depth, no .*'lippmann render'"):
        read_quilt(path)


def test_photographs_for_a_print_are_upright_and_of_srgb(tmp_path):
    exif = Pillow.Exif()
    exif[0x112] = 6
    picture = np.full((64, 96, 3), 40, np.uint8)
    picture[:32] = (200, 90, 90)
    for name in ("1.heic", "2.HEIC"):
        turned = Pillow.fromarray(np.rot90(picture).copy())
        (tmp_path / name).write_bytes(saved(turned, exif=exif.tobytes(), icc_profile=rgb_profile(P3)))
    paths = sorted(tmp_path.iterdir())
    view = read_photos(paths, (96, 64), (96.0, 64.0), keeps_profile=False).quilt.view_values(1)
    assert view[10, 48] == pytest.approx(convert_codes(picture[:1, :1], rgb_profile(P3))[0, 0], abs=8)
    assert view[50, 48] == pytest.approx((40, 40, 40), abs=8)
    paths[0].write_bytes(b"no picture")
    with pytest.raises(PictureError, match=r"1\.heic: cannot be "):
        read_photos(paths, (96, 64), (96.0, 64.0))


def test_depth_of_another_kind_is_named():
    with pytest.raises(SceneError, match=r"x\.heic: has depth of representation 2; inverse depth and disparity"):
        read_heif_photo(heif(PIXELS, DEPTH, representation=2), "x.heic")


def test_damaged_files_are_one_line():
    data = heif(PIXELS, DEPTH)
    for bad in (b"no picture", data[:40], data[: len(data) // 2]):
        with pytest.raises(SceneError, match=r"x\.heic: cannot be decoded \(.*; a HEIF picture") as caught:
            read_heif_photo(bad, "x.heic")
        assert "\n" not in str(caught.value)


def test_a_file_none_of_whose_pictures_is_opened_says_so(tmp_path):
    path = tmp_path / "x.heic"
    path.write_bytes(heif(PIXELS).replace(b"hvc1", b"unci"))  # the kind of a picture that is not compressed
    with pytest.raises(SceneError, match=r"x\.heic: cannot be decoded \(libheif opens none of its pictures"):
        read_heif_photo(path.read_bytes(), "x.heic")
    with pytest.raises(PictureError, match=r"x\.heic: cannot be decoded \(libheif opens none of its pictures"):
        read_quilt(path)


def test_it_counts_against_the_memory(monkeypatch):
    monkeypatch.setattr(machine, "_UNSEEN", 0)
    monkeypatch.setattr(machine, "available_memory", lambda: 1000)
    with pytest.raises(MemoryLimitError, match=r"x\.heic: a picture of 64 x 48 pixels takes"):
        read_heif_photo(heif(PIXELS, DEPTH), "x.heic")


def test_the_library_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pillow_heif", None)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(SceneError, match=r"pip install 'lippmann\[heif\]'"):
        read_heif_photo(b"", "x.heic")
