"""Files that scene files name: where they may lie, and how pictures are decoded."""

import io

import numpy as np
import pytest
from PIL import Image as Pillow

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import MissingFileError, NamedFiles, decode_image, decode_text, read_bytes, read_image


def find(folder, name, *, anywhere=False, what="texture"):
    return NamedFiles(folder, anywhere).find(name, where="scene.obj:3", what=what)


@pytest.fixture
def folder(tmp_path):
    inner = tmp_path / "scene"
    (inner / "maps").mkdir(parents=True)
    (inner / "maps" / "wood.png").write_bytes(b"x")
    (inner / "Bark.PNG").write_bytes(b"x")
    (tmp_path / "secret.txt").write_bytes(b"x")
    return inner


def test_files_below_the_folder_are_found(folder):
    assert find(folder, "maps/wood.png") == folder / "maps" / "wood.png"
    assert find(folder, "maps\\wood.png") == folder / "maps" / "wood.png"
    assert find(folder, "./maps/../maps/wood.png").samefile(folder / "maps" / "wood.png")


def test_outside_files_need_leave(folder):
    with pytest.raises(SceneError, match=r"scene\.obj:3: texture '\.\./secret\.txt' lies outside"):
        find(folder, "../secret.txt")
    with pytest.raises(SceneError, match="lies outside"):
        find(folder, str(folder.parent / "secret.txt"))
    assert find(folder, "../secret.txt", anywhere=True).samefile(folder.parent / "secret.txt")


def test_a_path_of_another_machine_means_the_file_beside_the_scene(folder):
    assert find(folder, "C:\\Users\\someone\\Bark.PNG") == folder / "Bark.PNG"
    assert find(folder, "/nowhere/Bark.PNG") == folder / "Bark.PNG"
    assert find(folder, "../Bark.PNG") == folder / "Bark.PNG"


def test_a_missing_file_is_named_with_its_likely_meaning(folder):
    with pytest.raises(SceneError, match=r"scene\.obj:3: texture 'bork\.png' not found; is 'Bark\.PNG' meant\?"):
        find(folder, "bork.png")
    with pytest.raises(SceneError, match=r"texture 'maps' not found"):
        find(folder, "maps")
    with pytest.raises(SceneError, match="not found"):
        find(folder, "a" * 5000)


@pytest.mark.parametrize("name", ["bark.png", "textures\\bark.PNG", "C:\\work\\BARK.png", "Maps/leaf.png", "leaf.png"])
def test_the_one_file_that_differs_in_case_or_folder_is_meant(folder, name):
    (folder / "maps").mkdir(exist_ok=True)
    (folder / "maps" / "Leaf.png").touch()
    assert find(folder, name).name.casefold() == name.replace("\\", "/").rpartition("/")[2].casefold()
    (folder / "BARK.PNG").touch()
    (folder / "maps" / "LEAF.png").touch()
    with pytest.raises(SceneError, match=r"not found|lies outside"):
        find(folder, name)


def test_a_scene_file_is_not_the_answer_to_a_missing_asset(folder):
    (folder / "long_name_of_scene.mhd").write_bytes(b"x")
    (folder / "long_name_of_scene.gltf").write_bytes(b"x")
    with pytest.raises(MissingFileError) as caught:
        find(folder, "long_name_of_scene.bin", what="buffer")
    assert str(caught.value) == "scene.obj:3: buffer 'long_name_of_scene.bin' not found"
    with pytest.raises(SceneError, match=r"is 'long_name_of_scene\.gltf' meant\?"):
        read_bytes(folder / "long_name_of_scene.glt")


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(SceneError, match="no such file"):
        read_bytes(tmp_path / "none.obj")
    with pytest.raises(SceneError, match="is a folder"):
        read_bytes(tmp_path)
    (tmp_path / "empty.obj").touch()
    with pytest.raises(SceneError, match=r"empty\.obj: the file is empty"):
        read_bytes(tmp_path / "empty.obj")
    with pytest.raises(SceneError, match="there is no folder"):
        read_bytes(tmp_path / "none" / "x.obj")


def test_text_in_old_and_new_coding():
    assert decode_text("\ufeffé".encode(), "x") == "é"
    assert decode_text("é".encode("latin-1"), "x") == "é"
    assert decode_text("\ufeffv 1 é".encode("utf-16-be"), "x") == "v 1 é"
    assert decode_text("\ufeffv 1 é".encode("utf-16-le"), "x") == "v 1 é"
    assert decode_text(b"f 1 2 3\n\n\0\n", "x") == "f 1 2 3"  # as ZBrush ends an OBJ file
    assert decode_text(b"v 1\rv 2\r", "x") == "v 1\nv 2\n"  # as on the old Mac OS
    with pytest.raises(SceneError, match="is not a text file"):
        decode_text(b"v 1\0\0", "x.obj")
    with pytest.raises(SceneError, match="is no text in UTF-16"):
        decode_text(b"\xff\xfev", "x.obj")


def encoded(picture, kind="PNG"):
    buffer = io.BytesIO()
    picture.save(buffer, kind)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("mode", "channels"), [("L", 1), ("1", 1), ("RGB", 3), ("RGBA", 4), ("LA", 4), ("P", 3), ("CMYK", 3)]
)
def test_every_kind_of_picture_has_one_three_or_four_channels(mode, channels):
    picture = Pillow.new("RGB", (5, 4), (255, 0, 0)).convert(mode)
    image = decode_image(encoded(picture, "TIFF" if mode == "CMYK" else "PNG"), "x", where="f")
    assert image.pixels.shape == (4, 5, channels)
    assert image.pixels.dtype == np.uint8


def test_sixteen_bits_keep_their_precision():
    values = np.array([[0, 1, 32768, 65535]], np.uint16)
    image = decode_image(encoded(Pillow.fromarray(values)), "x", where="f")
    assert image.pixels[0, :, 0] == pytest.approx(values[0] / 65535.0, abs=1e-7)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_the_transparent_grey_of_a_png_is_transparent(dtype):
    file = io.BytesIO()
    Pillow.fromarray(np.array([[10, 85]], dtype)).save(file, "PNG", transparency=85)
    pixels = decode_image(file.getvalue(), "leaf.png", where="f").pixels
    assert pixels.shape == (1, 2, 4)
    assert (pixels[0, :, 3] / pixels.max()).tolist() == [1, 0]
    assert (pixels[0, 1, :3] == pixels[0, 1, 0]).all()


def test_damaged_pictures(tmp_path):
    whole = encoded(Pillow.fromarray(np.random.default_rng(0).integers(0, 255, (64, 64, 3), np.uint8)))
    with pytest.raises(SceneError, match=r"f:7: texture 'x\.png' cannot be decoded"):
        decode_image(whole[: len(whole) // 2], "x.png", where="f:7")
    (tmp_path / "x.png").write_bytes(b"not a picture")
    with pytest.raises(SceneError, match=r"f:7: texture 'x\.png' is not a picture"):
        read_image(tmp_path / "x.png", where="f:7")


def test_links_lead_outside_no_more_than_names_do(folder):
    (folder / "link.txt").symlink_to(folder.parent / "secret.txt")
    (folder / "circle").symlink_to(folder / "circle")
    for name in ("link.txt", "../secret/link.txt", "/elsewhere/link.txt"):
        with pytest.raises(SceneError, match=r"lies outside|not found"):
            find(folder, name)
    with pytest.raises(SceneError, match="not found"):
        find(folder, "circle")
    assert find(folder, "link.txt", anywhere=True).samefile(folder.parent / "secret.txt")
