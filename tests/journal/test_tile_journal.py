"""The journal of a picture in the making: nothing is lost, nothing half is taken for whole."""

from __future__ import annotations

import errno
import json
import random
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import OutputError, PictureError
from lippmann.journal import DamagedTile, TileGrid, TileResult, TileStore, encode, journal_of, tile_journal
from lippmann.journal.tile_journal import sweep_beside
from lippmann.runtime.atomic_write import undo_all

GRID = TileGrid(100, 70, 32)
JOB = {"spp": "4", "scene": "room"}


def tile(index, grid=GRID):
    rows, columns = grid[index].shape
    values = np.random.default_rng(index).integers(0, 256, (rows, columns, 3), dtype=np.uint8)
    return TileResult(index, values, rays={"primary": rows * columns})


@pytest.fixture
def output(tmp_path):
    return tmp_path / "poster.tif"


def opened(output, *, resume=True, job=JOB, grid=GRID):
    return TileStore.open(output, job, grid, resume=resume)


def test_tiles_come_back_in_order_however_they_were_put(output):
    order = list(range(len(GRID)))
    random.Random(1).shuffle(order)
    with opened(output, resume=False) as store:
        assert store.missing() == list(range(len(GRID)))
        with ThreadPoolExecutor(4) as pool:
            list(pool.map(lambda index: store.put(tile(index)), order))
        assert store.missing() == []
        found = list(store.results())
    assert [result.index for result in found] == list(range(len(GRID)))
    assert all(np.array_equal(result.pixels, tile(result.index).pixels) for result in found)


def test_a_second_run_goes_on_where_the_first_stopped(output):
    with opened(output, resume=False) as store:
        for index in (0, 5, 7):
            store.put(tile(index))
    with opened(output) as store:
        assert store.resumed == 3
        assert store.missing() == [index for index in range(len(GRID)) if index not in (0, 5, 7)]
        store.put(tile(5))
        assert len(store.missing()) == len(GRID) - 3


def test_finishing_leaves_nothing(output):
    with opened(output) as store:
        store.put(tile(0))
        store.finish()
    assert list(output.parent.iterdir()) == []


@pytest.fixture
def begun(output):
    """A journal with one tile."""
    with opened(output) as store:
        store.put(tile(0))


def test_an_unfinished_picture_is_not_thrown_away(output, begun):
    with pytest.raises(OutputError, match=r"unfinished.*resume=True, or delete"):
        opened(output, resume=False)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"job": {"spp": "8", "scene": "room"}}, r"spp \(was 4, is 8\)"),
        ({"job": {"spp": "4", "scene": "room", "seed": "1"}}, r"seed \(is new\)"),
        ({"grid": TileGrid(100, 70, 16)}, "grid of tiles"),
    ],
)
def test_another_picture_is_refused_with_what_differs(output, begun, change, said):
    with pytest.raises(PictureError, match=said):
        opened(output, **change)


def test_without_a_tile_there_is_nothing_to_lose(output):
    opened(output).close()
    with opened(output, resume=False, job={"spp": "8"}) as store:
        assert store.missing() == list(range(len(GRID)))
    assert json.loads((journal_of(output) / "job.json").read_text())["fingerprint"] == {"spp": "8"}


def test_what_fails_before_its_first_tile_leaves_nothing(output):
    with pytest.raises(RuntimeError), opened(output):
        raise RuntimeError
    assert list(output.parent.iterdir()) == []


def test_half_files_are_swept_and_foreign_ones_left(output):
    with opened(output) as store:
        store.put(tile(2))
    folder = journal_of(output)
    (folder / ".r0000_c0001-0123abcd0123abcd0123.part.tile").write_bytes(b"half")
    (folder / "notes.txt").write_text("mine")
    with opened(output) as store:
        assert store.resumed == 1
    assert {path.name for path in folder.iterdir()} == {"job.json", "lock", "r0000_c0002.tile", "notes.txt"}


def test_what_a_killed_writer_left_beside_is_swept(output):
    number = "0123abcd0123abcd0123"
    for name in (f".poster-{number}.part.tif", ".poster.tif.parts-0123abcd.old", f".poster.tif-{number}.part"):
        (output.parent / name).write_bytes(b"half")
    others = {"poster.tif", f".poster2-{number}.part.tif", f".poster-{number}.part.png", ".poster.part.tif", "keep.tif"}
    for name in others:
        (output.parent / name).write_bytes(b"whole")
    sweep_beside(output)
    assert {path.name for path in output.parent.iterdir()} == others


def test_one_process_at_a_time(output):
    code = "import sys; from pathlib import Path; from lippmann.journal import *\n"
    code += f"TileStore.open(Path(sys.argv[1]), {JOB!r}, TileGrid(100, 70, 32), resume=True)"
    with opened(output):
        run = subprocess.run([sys.executable, "-c", code, str(output)], capture_output=True, text=True, check=False)
    assert "another process is rendering this picture" in run.stderr
    subprocess.run([sys.executable, "-c", code, str(output)], check=True)


@pytest.mark.parametrize("damage", ["short", "zeros", "flipped", "other", "empty"])
def test_damaged_tiles_are_made_anew(output, damage):
    with opened(output) as store:
        for index in range(len(GRID)):
            store.put(tile(index))
    path = journal_of(output) / (GRID.name(4) + ".tile")
    data = path.read_bytes()
    changed = {
        "short": data[: len(data) // 2],
        "zeros": bytes(len(data)),
        "flipped": data[:-40] + bytes([data[-40] ^ 1]) + data[-39:],
        "other": encode(tile(3)),
        "empty": b"",
    }[damage]
    path.write_bytes(changed)
    with opened(output) as store:
        if damage in ("short", "zeros", "empty"):
            assert store.missing() == [4]
        with pytest.raises(DamagedTile):
            store.get(4)
        assert store.missing() == [4]
        store.put(tile(4))
        assert np.array_equal(store.get(4).pixels, tile(4).pixels)


@pytest.mark.parametrize("text", ["", "[]", "{", '{"fingerprint": 3}', '{"lippmann-journal": 9, "fingerprint": {}}'])
def test_a_folder_that_is_no_journal_is_refused(output, begun, text):
    (journal_of(output) / "job.json").write_text(text)
    with pytest.raises(PictureError, match="no journal"):
        opened(output)


def test_a_full_disk_is_said_and_harms_nothing(output, monkeypatch):
    with opened(output) as store:
        store.put(tile(0))
        write = Path.write_bytes

        def full(path, data):
            write(path, data[: len(data) // 2])
            raise OSError(errno.ENOSPC, "No space left on device", str(path))

        monkeypatch.setattr(Path, "write_bytes", full)
        for index in (0, 1):
            with pytest.raises(OutputError, match="no space is left"):
                store.put(tile(index))
        monkeypatch.undo()
        assert store.missing() == list(range(1, len(GRID)))
        assert np.array_equal(store.get(0).pixels, tile(0).pixels)
    assert not [path for path in journal_of(output).iterdir() if path.name.startswith(".")]


def test_a_copy_taken_at_any_moment_is_a_journal(output, tmp_path):
    """The folder is copied again and again while tiles are put, as a power cut would leave it."""
    copies = []
    with opened(output) as store, ThreadPoolExecutor(1) as pool:
        work = pool.submit(lambda: [store.put(tile(index)) for index in range(len(GRID))])
        while not work.done() or not copies:
            copies.append(tmp_path / f"copy{len(copies)}" / "poster.tif")
            _copy(journal_of(output), journal_of(copies[-1]))
        work.result()
    assert len(copies) > 1
    for copy in copies[:20]:
        with opened(copy) as store:
            for index in set(range(len(GRID))) - set(store.missing()):
                assert np.array_equal(store.get(index).pixels, tile(index).pixels)


def _copy(source: Path, target: Path) -> None:
    target.mkdir(parents=True)
    target.chmod(0o700)  # as "cp -r" would, whatever the umask
    for path in list(source.iterdir()):
        try:
            shutil.copy(path, target / path.name)
        except FileNotFoundError:  # it was renamed meanwhile
            continue


def test_the_job_can_be_read_by_people(output):
    opened(output).close()
    job = json.loads((journal_of(output) / "job.json").read_text())
    assert job["fingerprint"] == JOB
    assert job["grid"] == [100, 70, 32]


def test_a_name_too_long_for_the_journal_is_refused_at_once(tmp_path):
    """Such a picture was rendered whole before its journal could not be put away."""
    longest = 255 - len("..parts-01234567.old")
    with TileStore.open(tmp_path / ("a" * (longest - 4) + ".tif"), JOB, TileGrid(100, 70, 32), resume=False):
        pass
    with pytest.raises(OutputError, match=r"the name is too long for the journal beside it; 1 bytes less fit"):
        TileStore.open(tmp_path / ("a" * (longest - 3) + ".tif"), JOB, TileGrid(100, 70, 32), resume=False)


@pytest.mark.parametrize("struck", ["take_lock", "_is_begun", "replacing"])
def test_a_journal_that_is_interrupted_while_it_is_made_leaves_nothing(output, monkeypatch, struck):
    """Each of the steps is done, and Ctrl-C strikes before the next one."""
    real, calls = getattr(tile_journal, struck), []

    def interrupted(*words, **more):
        calls.append(real(*words, **more))
        if struck == "_is_begun" and len(calls) == 1:
            return calls[0]
        raise KeyboardInterrupt

    monkeypatch.setattr(tile_journal, struck, interrupted)
    with pytest.raises(KeyboardInterrupt):
        opened(output)
    monkeypatch.undo()
    if struck == "take_lock":
        calls[0].close()  # as the end of the process does
    undo_all()
    assert list(output.parent.iterdir()) == []


def test_an_interrupt_while_a_journal_is_put_away_leaves_nothing(output, monkeypatch):
    with opened(output) as store:
        for index in range(len(GRID)):
            store.put(tile(index))
        monkeypatch.setattr(tile_journal, "clear", _struck)
        with pytest.raises(KeyboardInterrupt):
            store.finish()
    monkeypatch.undo()
    undo_all()
    assert list(output.parent.iterdir()) == []


def _struck(*words: object) -> None:
    raise KeyboardInterrupt
