"""A picture file is opened once, and its header read once, whatever is done with the picture."""

from __future__ import annotations

import collections
import os
import sys

import pytest

from lippmann.image import compose, open_file, open_picture, read_metadata, read_picture, streamed, write_micro_images
from lippmann.metrics import compare
from lippmann.viewer.served_picture import PictureFile
from lippmann.viewing.replay import replay

NAMES = ["a.png", "a.exr", "a.tif", "a.zarr"]

#: Each reads every pixel of the picture at ``path``, and some keep its header.
USES = {
    "read": read_picture,
    "header, then pixels": lambda path: (opened := open_file(path), opened.metadata, opened.decode(), opened.picture()),
    "rows": lambda path: [open_picture(path).rows(0, 12)],
    "replay": lambda path: replay(open_picture(path), size=(8, 8)),
    "compare": lambda path: (lambda picture: compare(picture, picture))(read_picture(path)),
    "view": lambda path: (shown := PictureFile(path), shown.current(), shown.current()),
}

_counting: list[collections.Counter[str]] = []


def _note(event, arguments):
    if event == "open" and _counting and isinstance(arguments[0], (str, bytes, os.PathLike)):
        _counting[-1][os.fspath(arguments[0])] += 1


@pytest.fixture(scope="module")
def hook():
    """Notes the names of all files that Python opens; such a hook cannot be taken away again."""
    sys.addaudithook(_note)


@pytest.fixture
def opens(hook):
    """``opens(call, path)``: how often each file at or below ``path`` is opened by ``call(path)``."""

    def count(call, path):
        _counting.append(collections.Counter())
        try:
            call(path)
        finally:
            found = _counting.pop()
        return {name.removeprefix(str(path)): times for name, times in found.items() if name.startswith(str(path))}

    return count


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("in_pieces", [False, True])
def test_a_file_is_opened_once(opens, tmp_path, display, picture, monkeypatch, name, use, in_pieces):
    if name == "a.zarr":
        pytest.importorskip("zarr")
    path = tmp_path / name
    picture(display("square", lenses=(4, 4), pixels=3)).save(path)
    if in_pieces:
        monkeypatch.setattr(streamed, "LARGE", 0)
    found = opens(USES[use], path)
    if name == "a.zarr":
        # Pieces are files of their own; one whose values are asked for twice is decoded twice.
        assert found.pop("/zarr.json") == 1
        assert max(found.values(), default=0) <= 2
    else:
        assert found == {"": 1}


@pytest.mark.parametrize("name", NAMES)
def test_metadata_alone_opens_a_file_once(opens, tmp_path, display, picture, name):
    if name == "a.zarr":
        pytest.importorskip("zarr")
    picture(display()).save(tmp_path / name)
    assert opens(read_metadata, tmp_path / name) == {"/zarr.json" if name == "a.zarr" else "": 1}


@pytest.mark.parametrize("format", ["png", "exr", "tiff"])
def test_parts_of_a_folder_are_opened_once(opens, tmp_path, display, picture, format):
    folder = tmp_path / "lenses"
    # Files of less than a kilobyte may be pointers of Git LFS, and are looked into before.
    count = write_micro_images(picture(display("square", lenses=(3, 2), pixels=25)), folder, format=format)
    found = opens(compose, folder)
    assert len(found) == count + 1
    assert set(found.values()) == {1}


@pytest.mark.skipif(not os.path.isdir("/proc/self/fd"), reason="the system does not list open files")
def test_a_file_is_closed_with_its_picture(tmp_path, display, picture):
    path = tmp_path / "a.tif"
    picture(display()).save(path)

    def is_open():
        names = [os.path.join("/proc/self/fd", name) for name in os.listdir("/proc/self/fd")]
        return any(os.path.exists(name) and os.path.samefile(name, path) for name in names)

    opened = open_file(path)
    assert is_open()
    del opened
    assert not is_open()
    read_picture(path)
    assert not is_open()
