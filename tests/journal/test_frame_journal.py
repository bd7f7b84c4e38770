"""The journal of a sequence: what it keeps, what it refuses, and what damage does to it."""

from __future__ import annotations

import json
import multiprocessing
import sys

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lippmann.errors import LippmannError, OutputError, PictureError
from lippmann.journal.frame_journal import FrameJournal

OF = {"spp": "4", "the scene": "0" * 64}


@pytest.fixture
def begun(tmp_path):
    """A journal of three frames, closed, and where their files lie."""
    path = tmp_path / "out.journal"
    files = [tmp_path / f"{number}.png" for number in range(3)]
    with FrameJournal.open(path, OF, resume=False) as journal:
        for number, file in enumerate(files):
            file.write_bytes(b"frame %d" % number)
            journal.add(number, file)
    return path, files


def held(path, files, fingerprint=OF):
    with FrameJournal.open(path, fingerprint, resume=True) as journal:
        return [number for number, file in enumerate(files) if journal.holds(number, file)]


def test_finished_frames_are_held(begun):
    path, files = begun
    assert held(path, files) == [0, 1, 2]
    with FrameJournal.open(path, OF, resume=True) as journal:
        assert 2 in journal
        assert 3 not in journal
        journal.add(3, files[0])
    assert held(path, [*files, files[0]]) == [0, 1, 2, 3]


def test_a_frame_that_is_gone_or_another_is_not_held(begun):
    path, files = begun
    files[0].unlink()
    files[1].write_bytes(b"frame 2")
    assert held(path, files) == [2]


def test_a_frame_may_be_a_folder(begun, tmp_path):
    path, _ = begun
    folder = tmp_path / "a.zarr"
    (folder / "c").mkdir(parents=True)
    (folder / "c" / "0").write_bytes(b"values")
    with FrameJournal.open(path, OF, resume=True) as journal:
        journal.add(3, folder)
        assert journal.holds(3, folder)
        (folder / "c" / "0").rename(folder / "c" / "1")
        assert not journal.holds(3, folder)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"spp": "8"}, r"the unfinished sequence is another one: spp \(was 4, is 8\)"),
        ({"the scene": "1" * 64}, "another one: the scene;"),
        ({"seed": "1"}, r"seed \(is new\)"),
    ],
)
def test_another_sequence_is_refused_and_the_journal_stays(begun, changed, said):
    path, files = begun
    before = path.read_bytes()
    with pytest.raises(PictureError, match=said):
        held(path, files, OF | changed)
    assert path.read_bytes() == before


def test_without_resuming_it_begins_anew(begun):
    path, files = begun
    with FrameJournal.open(path, OF | {"spp": "8"}, resume=False) as journal:
        assert not journal.holds(0, files[0])
        journal.add(1, files[1])
    assert held(path, files, OF | {"spp": "8"}) == [1]


def test_what_failed_before_its_first_frame_leaves_nothing(tmp_path):
    path = tmp_path / "out.journal"
    with pytest.raises(KeyError), FrameJournal.open(path, OF, resume=True):
        raise KeyError
    assert not path.exists()


def test_finished_journals_go(begun):
    with FrameJournal.open(begun[0], OF, resume=True) as journal:
        journal.finish()
    assert not begun[0].exists()


def test_a_journal_cut_short_anywhere_holds_the_lines_that_are_whole(begun):
    path, files = begun
    data = path.read_bytes()
    ends = [place + 1 for place, letter in enumerate(data) if letter == 10]
    for length in (*range(0, len(data), 37), *ends, *(end - 1 for end in ends)):
        path.write_bytes(data[:length])
        whole = sum(length >= end for end in ends) - 1
        assert held(path, files) == list(range(max(0, whole)))
        # It goes on behind the last whole line.
        with FrameJournal.open(path, OF, resume=True) as journal:
            journal.add(2, files[2])
        assert 2 in held(path, files)


@pytest.mark.parametrize(
    "head", [b"[]", b"{}", b"\xff", b'{"lippmann-frames": 2, "fingerprint": {}}', b'{"lippmann-frames": 1}']
)
def test_what_is_no_journal_is_said_to_be_none(tmp_path, head):
    path = tmp_path / "out.journal"
    path.write_bytes(head + b"\n")
    with pytest.raises(PictureError, match=r"no journal of an unfinished sequence: .*choose another name"):
        FrameJournal.open(path, OF, resume=True)


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(
    line=st.dictionaries(
        st.sampled_from(["frame", "sum"]),
        st.none()
        | st.booleans()
        | st.integers()
        | st.text(max_size=4)
        | st.dictionaries(st.text(max_size=2), st.none()),
    )
)
def test_lines_of_others_end_it(begun, line):
    path, files = begun
    data = path.read_bytes()
    head, first, _ = data.split(b"\n", 2)
    path.write_bytes(b"\n".join((head, first, json.dumps(line).encode(), b"")))
    try:
        assert held(path, files) == [0]
    finally:
        path.write_bytes(data)


def _hold(path, found):
    try:
        FrameJournal.open(path, OF, resume=True)
        found.put("")
    except LippmannError as error:
        found.put(str(error))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such locks there")
def test_only_one_process_at_a_time(begun):
    context = multiprocessing.get_context("spawn")
    found = context.Queue()
    with FrameJournal.open(begun[0], OF, resume=True):
        process = context.Process(target=_hold, args=(begun[0], found))
        process.start()
        assert "another process is rendering this picture" in found.get(timeout=60)
        process.join()


def test_places_that_cannot_be_written_are_named(tmp_path):
    with pytest.raises(OutputError, match="cannot be written"):
        FrameJournal.open(tmp_path / "nowhere" / "out.journal", OF, resume=False)
