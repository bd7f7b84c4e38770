"""HEIF photographs: colours, depth, what is refused."""

import sys

import numpy as np
import pytest

from lippmann.errors import MemoryLimitError, SceneError
from lippmann.runtime import input_memory
from lippmann.scene.readers.heif_photo import read_heif_photo
from lippmann.scene.readers.load import load_scene

pytest.importorskip("pillow_heif", reason="pillow-heif is not installed")

from heif_files import gradient, heif

PIXELS, DEPTH = gradient()


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


def test_another_depth_map_takes_the_place_of_its_own(tmp_path):
    path = tmp_path / "x.heic"
    path.write_bytes(heif(PIXELS))
    with pytest.raises(SceneError, match=r"x\.heic: needs a depth map"):
        load_scene(path)
    np.save(tmp_path / "d.npy", 1.0 / (1.0 + DEPTH))
    assert load_scene(path, depth_map=tmp_path / "d.npy").description.meshes


def test_depth_of_another_kind_is_named():
    with pytest.raises(SceneError, match=r"x\.heic: has depth of representation 2; inverse depth and disparity"):
        read_heif_photo(heif(PIXELS, DEPTH, representation=2), "x.heic")


def test_damaged_files_are_one_line():
    data = heif(PIXELS, DEPTH)
    for bad in (b"no picture", data[:40], data[: len(data) // 2]):
        with pytest.raises(SceneError, match=r"x\.heic: cannot be decoded \(.*; a HEIF picture") as caught:
            read_heif_photo(bad, "x.heic")
        assert "\n" not in str(caught.value)


def test_it_counts_against_the_memory(monkeypatch):
    monkeypatch.setattr(input_memory, "_UNSEEN", 0)
    monkeypatch.setattr(input_memory.machine, "available_memory", lambda: 1000)
    with pytest.raises(MemoryLimitError, match=r"x\.heic: a picture of 64 x 48 pixels takes"):
        read_heif_photo(heif(PIXELS, DEPTH), "x.heic")


def test_the_library_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pillow_heif", None)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(SceneError, match=r"pip install 'lippmann\[heif\]'"):
        read_heif_photo(b"", "x.heic")
