"""Pipes and devices are told from files without being opened."""

import os
import socket
from pathlib import Path

import pytest

from lippmann.errors import PictureError, SceneError
from lippmann.runtime.regular_file import check_kind, other_kind, unreadable


def test_files_and_nothing_are_no_other_kind(tmp_path):
    (tmp_path / "f").write_bytes(b"x")
    assert other_kind(tmp_path / "f") is None
    assert other_kind(tmp_path / "none") is None
    assert other_kind("a\0b") is None
    assert other_kind(tmp_path) == "a folder"
    check_kind(tmp_path, SceneError)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such files")
def test_pipes_devices_and_sockets_are_refused(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "p")
    (tmp_path / "link").symlink_to(tmp_path / "p")
    assert other_kind(tmp_path / "link") == "a pipe"
    assert other_kind("/dev/null") == "a device"
    monkeypatch.chdir(tmp_path)  # the names of sockets are short
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("s")
        with pytest.raises(SceneError, match="is a socket, no file"):
            check_kind(tmp_path / "s", SceneError)


def test_pointers_of_git_lfs_are_refused(tmp_path):
    text = f"version https://git-lfs.github.com/spec/v1\noid sha256:{'0' * 64}\nsize 344\n"
    (tmp_path / "model.glb").write_text(text)
    with pytest.raises(SceneError, match=r"model\.glb: is only a pointer of Git LFS; fetch .* git lfs pull"):
        check_kind(tmp_path / "model.glb", SceneError)
    (tmp_path / "long.obj").write_text(text + "#" * 1024)
    check_kind(tmp_path / "long.obj", SceneError)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("Pictur.png", "no such file; a picture; is 'picture.png' meant?"),
        ("picture.jpg", "no such file; a picture; is 'picture.png' meant?"),
        ("teapot.png", "no such file; a picture; is 'teapot_qs8x6a0.75.png' meant?"),
        ("teapo.png", "no such file; a picture"),
        ("other.tif", "no such file; a picture"),
        ("re.png", "no such file; a picture"),
        ("none/picture.png", "no such file; a picture; there is no folder '{folder}{sep}none'"),
        ("picture.png/a.png", "no such file; a picture; there is no folder '{folder}{sep}picture.png'"),
    ],
)
def test_a_missing_file_is_told_in_one_way(tmp_path, name, said):
    for present in ("picture-preview.png", "picture.png", "e.png", "teapot_qs8x6a0.75.png"):
        (tmp_path / present).write_bytes(b"x")
    path = tmp_path / name
    with pytest.raises((FileNotFoundError, NotADirectoryError)) as caught:
        path.open()
    line = str(unreadable(path, caught.value, PictureError, "a picture"))
    assert line == f"{path}: {said.format(folder=tmp_path, sep=os.sep)}"


@pytest.mark.parametrize("address", ["https://example.com/a/model.glb", "http://example.com/model.glb"])
def test_an_address_is_told_from_a_missing_file(address):
    error = unreadable(Path(address), FileNotFoundError(), SceneError)
    assert str(error) == f"{address}: is an address; files are read; download it first"
