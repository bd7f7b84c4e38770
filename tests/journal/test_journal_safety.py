"""What a journal takes for its own: nothing else is read as a tile, changed or removed."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import LippmannError, PictureError
from lippmann.journal import DamagedTile, FrameJournal, TileGrid, TileResult, TileStore, encode, journal_of
from lippmann.journal.tile_journal import sweep_beside

GRID = TileGrid(64, 32, 32)
JOB = {"spp": "4"}


def tile(index: int) -> TileResult:
    return TileResult(index, np.full((32, 32, 3), index, np.uint8))


def opened(output: Path, *, resume: bool = True) -> TileStore:
    return TileStore.open(output, JOB, GRID, resume=resume)


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


@pytest.fixture
def output(tmp_path):
    (tmp_path / "out").mkdir()
    return tmp_path / "out" / "poster.tif"


@pytest.fixture
def folder(output):
    """A journal with its first tile, closed."""
    with opened(output) as store:
        store.put(tile(0))
    return journal_of(output)


@pytest.fixture
def precious(tmp_path):
    """A file of the user's elsewhere, that must stay as it is."""
    path = tmp_path / "precious.txt"
    path.write_text("mine")
    yield path
    assert path.read_text() == "mine"


# ---- The folder ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("resume", [False, True])
@pytest.mark.parametrize("target", ["empty", "journal", "nowhere"])
def test_a_folder_that_is_a_link_is_refused(output, tmp_path, resume, target):
    elsewhere = tmp_path / "elsewhere"
    if target == "journal":
        elsewhere.mkdir()
        with opened(elsewhere / "poster.tif") as store:
            store.put(tile(0))
        elsewhere = journal_of(elsewhere / "poster.tif")
    elif target == "empty":
        elsewhere.mkdir()
    journal_of(output).symlink_to(elsewhere)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(PictureError, match=r"poster\.tif\.parts: .*it is a symbolic link; .*choose another name"):
        opened(output, resume=resume)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_link_in_the_place_of_a_tile_is_replaced_and_its_target_stays(output, folder, precious):
    (folder / "r0000_c0001.tile").symlink_to(precious)
    with opened(output) as store:
        assert store.missing() == [1]
        store.put(tile(1))
        assert store.missing() == []
        assert np.array_equal(store.get(1).pixels, tile(1).pixels)
    assert not (folder / "r0000_c0001.tile").is_symlink()


def test_a_tile_is_not_read_through_a_link(output, folder, tmp_path):
    other = tmp_path / "other.tile"
    other.write_bytes(encode(tile(1)))
    (folder / "r0000_c0001.tile").symlink_to(other)
    with opened(output) as store:
        assert store.resumed == 1
        with pytest.raises(DamagedTile, match="not found"):
            store.get(1)
        assert other.read_bytes() == encode(tile(1))
        store.put(tile(1))
        assert np.array_equal(store.get(1).pixels, tile(1).pixels)


def test_a_frame_journal_is_not_made_through_a_link(tmp_path):
    (tmp_path / "out.journal").symlink_to(tmp_path / "nowhere")
    with pytest.raises(PictureError, match="it is a symbolic link"):
        FrameJournal.open(tmp_path / "out.journal", JOB, resume=False)
    assert not (tmp_path / "nowhere").exists()


def test_a_job_and_a_lock_are_not_written_through_links(output, folder, tmp_path):
    (folder / "lock").unlink()
    (folder / "lock").symlink_to(tmp_path / "nowhere")
    with pytest.raises(PictureError, match="its lock is a symbolic link"):
        opened(output)
    (folder / "lock").unlink()
    (folder / "job.json").unlink()
    (folder / "job.json").symlink_to(tmp_path / "nowhere")
    with pytest.raises(PictureError, match=r"holds 'job\.json' and no"):
        opened(output)
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize("resume", [False, True])
def test_a_file_in_the_place_of_the_folder_is_refused_and_stays(output, resume):
    journal_of(output).write_text("mine")
    with pytest.raises(PictureError, match=r"it is no folder; .*choose another name") as raised:
        opened(output, resume=resume)
    assert "delete" not in str(raised.value)
    assert journal_of(output).read_text() == "mine"


# ---- Files in it -----------------------------------------------------------------------------------------------------


def test_what_is_no_file_is_no_tile(output, folder):
    os.mkfifo(folder / "r0000_c0001.tile")  # opening one for reading waits for a writer, for ever
    with opened(output) as store:
        assert store.missing() == [1]
        with pytest.raises(DamagedTile, match="not found"):
            store.get(1)
        store.put(tile(1))
        assert store.missing() == []


# ---- The journal of a sequence ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("resume", [False, True])
@pytest.mark.parametrize("text", ["my notes", "my notes\n", '{"frames": 3}\n', "[1]"])
def test_a_file_that_is_no_frame_journal_is_never_emptied(tmp_path, resume, text):
    path = tmp_path / "out.journal"
    path.write_text(text)
    with pytest.raises(PictureError, match=r"no journal of an unfinished sequence: .*choose another name") as raised:
        FrameJournal.open(path, JOB, resume=resume)
    assert path.read_text() == text
    assert "delete" not in str(raised.value)


# ---- What is the user's ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("resume", [False, True])
@pytest.mark.parametrize(
    "content",
    [
        {"notes.txt": "mine"},
        {"lock": "mine"},
        {"job.json": '{"jobs": ["mine"]}'},
        {"job.json": "mine"},
        {"floor.tile": "mine"},
        {"r0000_c0000.tile": "mine"},
        {".keep-0123abcd0123abcd0123.part.txt": "mine"},
        {"lock": "", "plan/monday.txt": "mine"},
    ],
)
def test_a_folder_that_is_no_journal_is_refused_and_stays(output, resume, content):
    folder = journal_of(output)
    for name, text in content.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    folder.chmod(0o755)
    with pytest.raises(PictureError, match=r"no journal of an unfinished picture: .*choose another name") as raised:
        opened(output, resume=resume)
    assert "delete" not in str(raised.value)
    found = {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*") if path.is_file()}
    assert found == content


def test_what_a_run_killed_before_its_job_leaves_is_begun_anew(output):
    folder = journal_of(output)
    folder.mkdir(mode=0o700)
    (folder / "lock").touch()
    (folder / ".job-0123abcd0123abcd0123.part.json").write_text('{"finger')
    with opened(output, resume=False) as store:
        store.put(tile(0))
    assert names(folder) == {"lock", "job.json", "r0000_c0000.tile"}


def test_an_empty_folder_is_taken(output):
    journal_of(output).mkdir()
    journal_of(output).chmod(0o755)
    with opened(output, resume=False) as store:
        assert store.missing() == [0, 1]
        assert store.finish() == ()
    assert names(output.parent) == set()


def test_finishing_removes_the_journals_own_files_and_no_others(output, folder, precious):
    mine = {"notes.txt", "r0000_c0002.tile", "plan", "link", "r0000_c0001.tile"}
    with opened(output) as store:
        store.put(tile(1))
        (folder / "notes.txt").write_text("mine")
        (folder / "r0000_c0002.tile").write_text("there is no such tile")
        (folder / "plan").mkdir()
        (folder / "plan" / "r0000_c0000.tile").write_text("mine")
        (folder / "link").symlink_to(precious)
        (folder / "r0000_c0001.tile").unlink()
        (folder / "r0000_c0001.tile").mkdir()
        (folder / ".r0000_c0001-0123abcd0123abcd0123.part.tile").write_bytes(b"half")
        (note,) = store.finish()
    assert names(folder) == mine
    assert (folder / "plan" / "r0000_c0000.tile").read_text() == "mine"
    assert names(output.parent) == {folder.name}
    assert note == "the folder poster.tif.parts stays: it holds 'link', which is no part of the journal, and 4 more"


def test_what_comes_while_the_journal_is_removed_stays(output, folder, monkeypatch):
    """A file that is put into the folder between the look and the removal."""
    rename = os.rename

    def busy(source, target):
        if Path(source) == folder:
            (folder / "late.txt").write_text("mine")
        rename(source, target)

    monkeypatch.setattr(os, "rename", busy)
    with opened(output) as store:
        assert "late.txt" in store.finish()[0]
    assert names(output.parent) == {folder.name}
    assert names(folder) == {"late.txt"}


def test_deleting_is_advised_of_journals_with_nothing_else_in_them(output, folder):
    with pytest.raises(LippmannError, match="or delete"):
        opened(output, resume=False)
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(LippmannError, match="or move") as raised:
        opened(output, resume=False)
    assert "delete" not in str(raised.value)
    with pytest.raises(PictureError, match="or move") as raised:
        TileStore.open(output, {"spp": "8"}, GRID, resume=True)
    assert "delete" not in str(raised.value)


def test_names_and_values_from_the_disk_reach_no_terminal_as_commands(output, folder):
    job = json.loads((folder / "job.json").read_text())
    job["fingerprint"] = {"spp": "\x1b]0;gone\x07", "a\x1b[2J": "1"}
    (folder / "job.json").write_text(json.dumps(job))
    with pytest.raises(PictureError) as raised:
        opened(output)
    assert str(raised.value).isprintable()
    (folder / "job.json").unlink()
    (folder / "r0000_c0000.tile").rename(folder / "\x1b[2J")
    with pytest.raises(PictureError) as raised:
        opened(output)
    assert str(raised.value).isprintable()


# ---- What killed runs leave beside the output ------------------------------------------------------------------------

LEFT = (
    ".poster-0123abcd0123abcd0123.part.tif",
    ".poster.tif-0123abcd0123abcd0123.part",
    ".poster.tif-0123abcd0123abcd0123.old",
    ".poster.tif.parts-0123abcd.old",
)


def test_leavings_in_folders_are_removed(output):
    for name in LEFT[1:]:
        (output.parent / name).mkdir()
        (output.parent / name / "r0000_c0000.tile").touch()
        (output.parent / name / "job.json").touch()
    (output.parent / LEFT[1] / "c" / "0").mkdir(parents=True)
    (output.parent / LEFT[1] / "c" / "0" / "1").touch()
    sweep_beside(output)
    assert names(output.parent) == set()


def test_what_is_not_the_journals_stays_in_one_that_was_half_removed(output):
    old = output.parent / LEFT[3]
    old.mkdir()
    (old / "r0000_c0000.tile").touch()
    (old / "notes.txt").write_text("mine")
    sweep_beside(output)
    assert names(old) == {"notes.txt"}


def test_half_written_names_in_the_journal_lead_nowhere(output, folder, precious):
    kept = precious.with_name("kept")
    kept.mkdir()
    (kept / "file").touch()
    for number, target in enumerate((kept, precious)):
        (folder / f".r0000_c0001-0123abcd0123abcd012{number}.part.tile").symlink_to(target)
    (folder / ".draft-0123abcd0123abcd0123.part.txt").write_text("mine")
    opened(output).close()
    assert names(folder) == {"job.json", "lock", "r0000_c0000.tile", ".draft-0123abcd0123abcd0123.part.txt"}
    assert names(kept) == {"file"}


# ---- Tiles that somebody made up -------------------------------------------------------------------------------------


def test_a_tile_that_would_fill_the_memory_is_damaged(output, folder):
    """Zeros take 30 000 times as much memory as disk."""
    import tracemalloc

    much = TileResult(1, tile(1).pixels, sums={"values": np.zeros(1 << 27, np.uint8)})
    data = encode(much)
    assert len(data) < 1 << 20
    (folder / "r0000_c0001.tile").write_bytes(data)
    del much
    with opened(output) as store:
        tracemalloc.start()
        try:
            with pytest.raises(DamagedTile, match="larger than its pixels need"):
                store.get(1)
            assert tracemalloc.get_traced_memory()[1] < 1 << 25
        finally:
            tracemalloc.stop()
        assert store.missing() == [1]


def test_a_tile_that_is_too_long_is_not_even_read(output, folder):
    path = folder / "r0000_c0001.tile"
    path.write_bytes(encode(tile(1)))
    head, _ = path.read_bytes()[:20], os.truncate(path, 1 << 40)  # a hole takes no room on the disk
    length = (1 << 40) - len(head) - 32
    with path.open("r+b") as file:
        file.write(head[:8] + (0).to_bytes(4, "little") + length.to_bytes(8, "little"))
    with opened(output) as store:
        assert store.missing() == [1]
        with pytest.raises(DamagedTile, match="larger than its pixels need"):
            store.get(1)
