"""Temporary names: short, and gone with whoever wrote under them."""

import os
import subprocess
import sys

import pytest

from lippmann.runtime.atomic_write import replacing, replacing_folder
from lippmann.runtime.temporary_names import pattern_of, scratch_folder, temporary_file, temporary_folder

KILLED = """
import os, sys
from pathlib import Path
from lippmann.runtime.atomic_write import replacing, replacing_folder
with (replacing if sys.argv[1] == "file" else replacing_folder)(Path(sys.argv[2])) as temporary:
    (temporary if sys.argv[1] == "file" else temporary / "a").write_bytes(b"half")
    os.kill(os.getpid(), 9)
"""


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_what_a_killed_writer_left_goes_with_the_next(tmp_path, kind):
    place = tmp_path / "p.png"
    for _ in range(2):
        subprocess.run([sys.executable, "-c", KILLED, kind, str(place)], check=False)
    # The second removed what the first had left.
    assert len(os.listdir(tmp_path)) == 1
    others = (".p-0123abcd.part.png", ".p2-00000000000000000000.part.png", "p-0123abcd.part.png", ".p.part.png")
    for name in others:
        (tmp_path / name).write_text("mine")
    if kind == "file":
        with replacing(place) as temporary:
            temporary.write_text("whole")
    else:
        with replacing_folder(place) as temporary:
            (temporary / "a").write_text("whole")
    assert sorted(os.listdir(tmp_path)) == sorted((*others, "p.png"))


def test_two_writers_at_once_leave_each_other_alone(tmp_path):
    with replacing(tmp_path / "p.png") as first:
        first.write_text("1")
        with replacing(tmp_path / "p.png") as second:
            second.write_text("2")
        assert first.read_text() == "1"
    assert (tmp_path / "p.png").read_text() == "1"


def test_a_writer_on_another_machine_is_left_alone(tmp_path):
    ours = temporary_file(tmp_path / "p.png").name
    number = ours.removeprefix(".p-").partition(".")[0]
    machine = "0000" if number[:4] != "0000" else "1111"
    (tmp_path / f".p-{machine}{2**31 - 1:08x}01234567.part.png").write_text("half")
    with replacing(tmp_path / "p.png") as temporary:
        temporary.write_text("whole")
    assert len(os.listdir(tmp_path)) == 2


@pytest.mark.parametrize("stem", ["a" * 251, "ä" * 125, "\U0001f600" * 62])
def test_names_as_long_as_names_may_be_can_be_written(tmp_path, stem):
    place = tmp_path / f"{stem}.png"
    assert len(os.fsencode(place.name)) <= 255
    with replacing(place) as temporary:
        temporary.write_text("x")
        assert pattern_of(place).fullmatch(temporary.name)
    assert os.listdir(tmp_path) == [place.name]
    assert pattern_of(place).fullmatch(temporary_folder(place).name)


def test_folders_of_killed_processes_go_with_the_next(tmp_path):
    code = "import os, sys\nfrom lippmann.runtime.temporary_names import scratch_folder\n"
    code += "with scratch_folder('lippmann-x-', sys.argv[1]) as folder:\n    open(folder + '/f', 'w').close()\n"
    code += "    os.kill(os.getpid(), 9)"
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False)
    (left,) = os.listdir(tmp_path)
    (tmp_path / "lippmann-x-mine").mkdir()
    with scratch_folder("lippmann-x-", str(tmp_path)) as folder, scratch_folder("lippmann-x-", str(tmp_path)) as other:
        assert len({left, "lippmann-x-mine", os.path.basename(folder), os.path.basename(other)}) == 4
        assert sorted(os.listdir(tmp_path)) == sorted({"lippmann-x-mine", *map(os.path.basename, (folder, other))})
    assert os.listdir(tmp_path) == ["lippmann-x-mine"]
