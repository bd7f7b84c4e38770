import errno
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from lippmann.errors import OutputError
from lippmann.runtime import atomic_write
from lippmann.runtime.atomic_write import (
    Unfinished,
    pattern_of,
    replacing,
    replacing_folder,
    scratch_folder,
    temporary_file,
    temporary_folder,
    undo_all,
    undone,
)

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
    code = "import os, sys\nfrom lippmann.runtime.atomic_write import scratch_folder\n"
    code += "with scratch_folder('lippmann-x-', sys.argv[1]) as folder:\n    open(folder + '/f', 'w').close()\n"
    code += "    os.kill(os.getpid(), 9)"
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False)
    (left,) = os.listdir(tmp_path)
    (tmp_path / "lippmann-x-mine").mkdir()
    with scratch_folder("lippmann-x-", str(tmp_path)) as folder, scratch_folder("lippmann-x-", str(tmp_path)) as other:
        assert len({left, "lippmann-x-mine", os.path.basename(folder), os.path.basename(other)}) == 4
        assert sorted(os.listdir(tmp_path)) == sorted({"lippmann-x-mine", *map(os.path.basename, (folder, other))})
    assert os.listdir(tmp_path) == ["lippmann-x-mine"]


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_file_appears_whole_at_the_end(tmp_path):
    place = tmp_path / "picture.png"
    with atomic_write.replacing(place) as temporary:
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".png"
        temporary.write_bytes(b"half")
        assert not place.exists()
        temporary.write_bytes(b"whole")
    assert place.read_bytes() == b"whole"
    assert names(tmp_path) == ["picture.png"]


@pytest.mark.parametrize("failure", [ValueError("writer"), KeyboardInterrupt(), SystemExit(3)])
def test_failure_leaves_the_old_file_and_nothing_else(tmp_path, failure):
    place = tmp_path / "picture.png"
    place.write_bytes(b"old")

    def write():
        with atomic_write.replacing(place) as temporary:
            temporary.write_bytes(b"new")
            raise failure

    with pytest.raises(type(failure)):
        write()
    assert place.read_bytes() == b"old"
    assert names(tmp_path) == ["picture.png"]


def test_full_disk_is_one_line_about_the_output(tmp_path):
    place = tmp_path / "picture.png"
    with pytest.raises(OutputError, match="no space") as raised, atomic_write.replacing(place) as temporary:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(temporary))
    assert str(raised.value).startswith(f"{place}: ")
    assert "\n" not in str(raised.value)
    assert ".part" not in str(raised.value)
    assert names(tmp_path) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="/dev/full, the disk that is always full, is Linux's")
def test_full_disk_met_by_the_writer_itself(tmp_path):
    with (
        pytest.raises(OutputError, match="no space"),
        atomic_write.replacing(tmp_path / "picture.png"),
        open("/dev/full", "wb", buffering=0) as full,
    ):
        full.write(b"x")
    assert names(tmp_path) == []


def test_error_about_another_file_passes_through(tmp_path):
    with pytest.raises(FileNotFoundError), atomic_write.replacing(tmp_path / "picture.png"):
        (tmp_path / "texture.png").read_bytes()
    assert names(tmp_path) == []


def test_missing_folder_is_named_with_the_command_that_makes_it(tmp_path):
    place = tmp_path / "no" / "picture.png"
    with pytest.raises(OutputError, match="mkdir -p") as raised, atomic_write.replacing(place):
        pass
    assert str(tmp_path / "no") in raised.value.what


@pytest.mark.parametrize("use", [atomic_write.replacing, atomic_write.check_writable])
def test_places_where_no_file_can_be(tmp_path, use):
    def attempt(path):
        result = use(path)
        if result is not None:
            with result:
                pass

    (tmp_path / "file").write_bytes(b"kept")
    with pytest.raises(OutputError, match="this is a folder"):
        attempt(tmp_path)
    with pytest.raises(OutputError, match="is not a folder"):
        attempt(tmp_path / "file" / "picture.png")
    with pytest.raises(OutputError, match="too long"):
        attempt(tmp_path / ("x" * 300 + ".png"))
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OutputError, match="not a regular file"):
        attempt(tmp_path / "pipe")
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(OutputError):
        attempt(tmp_path / "loop")
    assert names(tmp_path) == ["file", "loop", "pipe"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_permission_denied(tmp_path):
    tmp_path.chmod(0o555)
    try:
        with pytest.raises(OutputError, match="permission"):
            atomic_write.check_writable(tmp_path / "picture.png")
    finally:
        tmp_path.chmod(0o755)


def test_a_folder_that_takes_no_files_is_not_called_removed(tmp_path, monkeypatch):
    def refuse(*_: object, **__: object) -> None:
        raise FileNotFoundError(errno.ENOENT, "No such file or directory")  # what /proc answers

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(OutputError, match="cannot be written: its folder takes no files; choose another place"):
        atomic_write.check_writable(tmp_path / "x.png")


def test_permission_denied_by_the_system(tmp_path, monkeypatch):
    def denied(*_):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(os, "open", denied)
    with pytest.raises(OutputError, match="permission"):
        atomic_write.check_writable(tmp_path / "picture.png")


def test_permissions_are_the_usual_ones_or_those_of_the_old_file(tmp_path):
    place = tmp_path / "picture.png"
    mask = os.umask(0o027)
    try:
        with atomic_write.replacing(place) as temporary:
            temporary.write_bytes(b"1")
        assert stat.S_IMODE(place.stat().st_mode) == 0o640
        place.chmod(0o604)
        with atomic_write.replacing(place) as temporary:
            temporary.write_bytes(b"2")
        assert stat.S_IMODE(place.stat().st_mode) == 0o604
    finally:
        os.umask(mask)


def test_link_stays_and_its_target_is_replaced(tmp_path):
    (tmp_path / "real").mkdir()
    target = tmp_path / "real" / "picture.png"
    target.write_bytes(b"old")
    link = tmp_path / "link.png"
    link.symlink_to(target)
    with atomic_write.replacing(link) as temporary:
        temporary.write_bytes(b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


def test_relative_path_survives_a_change_of_folder(tmp_path, monkeypatch):
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path)
    with atomic_write.replacing(Path("picture.png")) as temporary:
        temporary.write_bytes(b"1")
        monkeypatch.chdir(tmp_path / "elsewhere")
    assert (tmp_path / "picture.png").read_bytes() == b"1"


def write_folder(place: Path, files: dict[str, str]) -> None:
    with atomic_write.replacing_folder(place) as temporary:
        for name, content in files.items():
            (temporary / name).parent.mkdir(exist_ok=True)
            (temporary / name).write_text(content)


def test_folder_is_replaced_as_a_whole(tmp_path):
    place = tmp_path / "views"
    write_folder(place, {"a.png": "1", "b.png": "2", "sub/c.png": "3"})
    write_folder(place, {"a.png": "4"})
    assert names(place) == [atomic_write.CONTENTS_FILE, "a.png"]
    assert (place / "a.png").read_text() == "4"
    assert names(tmp_path) == ["views"]


def test_empty_folder_is_taken(tmp_path):
    (tmp_path / "views").mkdir()
    write_folder(tmp_path / "views", {"a.png": "1"})
    assert (tmp_path / "views" / "a.png").read_text() == "1"


def test_files_of_the_user_are_never_lost(tmp_path):
    place = tmp_path / "views"
    write_folder(place, {"a.png": "1"})
    (place / "notes.txt").write_text("mine")
    with pytest.raises(OutputError, match=r"notes\.txt"):
        write_folder(place, {"b.png": "2"})
    with pytest.raises(OutputError, match=r"notes\.txt"):
        atomic_write.check_folder_writable(place)
    assert names(place) == [atomic_write.CONTENTS_FILE, "a.png", "notes.txt"]
    assert names(tmp_path) == ["views"]


def test_file_put_into_the_folder_meanwhile_is_not_lost(tmp_path):
    place = tmp_path / "views"
    place.mkdir()

    def write():
        with atomic_write.replacing_folder(place) as temporary:
            (temporary / "a.png").write_text("1")
            (place / "notes.txt").write_text("mine")

    with pytest.raises(OutputError, match=r"notes\.txt"):
        write()
    assert names(place) == ["notes.txt"]
    assert names(tmp_path) == ["views"]


@pytest.mark.parametrize("failure", [OSError(errno.ENOSPC, "full"), KeyboardInterrupt()])
def test_failure_leaves_the_old_folder(tmp_path, failure):
    place = tmp_path / "views"
    write_folder(place, {"a.png": "1"})

    def write():
        with atomic_write.replacing_folder(place) as temporary:
            (temporary / "a.png").write_text("2")
            raise failure

    with pytest.raises((OutputError, KeyboardInterrupt)):
        write()
    assert (place / "a.png").read_text() == "1"
    assert names(tmp_path) == ["views"]


def test_failure_of_the_exchange_puts_the_old_folder_back(tmp_path, monkeypatch):
    place = tmp_path / "views"
    write_folder(place, {"a.png": "1"})
    rename = os.rename

    def second_fails(source, target, calls=[]):  # noqa: B006 - counts its calls
        calls.append(source)
        if len(calls) == 2:
            raise OSError(errno.EIO, "broken")
        rename(source, target)

    monkeypatch.setattr(os, "rename", second_fails)
    with pytest.raises(OutputError, match="broken"):
        write_folder(place, {"a.png": "2"})
    assert (place / "a.png").read_text() == "1"
    assert names(tmp_path) == ["views"]


def test_a_link_to_a_folder_in_a_folder_is_the_users(tmp_path):
    place = tmp_path / "views"
    (tmp_path / "pictures").mkdir()
    write_folder(place, {"a.png": "1"})
    (place / "link").symlink_to(tmp_path / "pictures")
    with pytest.raises(OutputError, match="the folder holds 'link'"):
        write_folder(place, {"a.png": "2"})
    assert names(place) == [atomic_write.CONTENTS_FILE, "a.png", "link"]


@pytest.mark.parametrize("plant", ["symlink_to", "mkfifo"])
def test_the_list_of_a_folder_is_a_file(tmp_path, plant):
    """Somebody else could say by a link that the user's files are Lippmann's."""
    place = tmp_path / "views"
    place.mkdir()
    (place / "thesis.pdf").write_text("mine")
    (tmp_path / "list").write_text("thesis.pdf\n")
    if plant == "symlink_to":
        (place / atomic_write.CONTENTS_FILE).symlink_to(tmp_path / "list")
    else:
        os.mkfifo(place / atomic_write.CONTENTS_FILE)
    with pytest.raises(OutputError, match=r"the folder holds 'thesis\.pdf'"):
        write_folder(place, {"a.png": "1"})
    assert (place / "thesis.pdf").read_text() == "mine"


def test_names_in_a_folder_reach_no_terminal_as_commands(tmp_path):
    (tmp_path / "views").mkdir()
    (tmp_path / "views" / "\x1b[2J").touch()
    with pytest.raises(OutputError) as raised:
        write_folder(tmp_path / "views", {"a.png": "1"})
    assert str(raised.value).isprintable()


def test_what_replaces_a_private_picture_is_private_from_the_first(tmp_path, monkeypatch):
    """Whoever opened the file before its permissions were changed could read it later."""
    place = tmp_path / "picture.png"
    place.touch(mode=0o600)
    made, opened = [], os.open

    def watched(path, flags, mode=0o777):
        descriptor = opened(path, flags, mode)
        if flags & os.O_CREAT:
            made.append(stat.S_IMODE(os.fstat(descriptor).st_mode))
        return descriptor

    monkeypatch.setattr(os, "open", watched)
    with atomic_write.replacing(place):
        pass
    assert made == [0o600]


def test_nobody_is_told_to_delete_what_is_his_own(tmp_path):
    (tmp_path / "views").mkdir()
    (tmp_path / "views" / "notes.txt").touch()
    with pytest.raises(OutputError, match="choose a new folder, or move your files out of this one"):
        write_folder(tmp_path / "views", {"a.png": "1"})


def test_file_in_the_place_of_a_folder(tmp_path):
    (tmp_path / "views").write_text("mine")
    with pytest.raises(OutputError, match="this is a file"):
        write_folder(tmp_path / "views", {"a.png": "1"})
    assert (tmp_path / "views").read_text() == "mine"


def test_check_leaves_nothing(tmp_path):
    (tmp_path / "old.png").write_text("kept")
    atomic_write.check_writable(tmp_path / "new.png")
    atomic_write.check_writable(tmp_path / "old.png")
    atomic_write.check_folder_writable(tmp_path / "views")
    assert names(tmp_path) == ["old.png"]
    assert (tmp_path / "old.png").read_text() == "kept"


def test_a_library_that_quotes_the_system_is_understood(tmp_path):
    with pytest.raises(OutputError, match="cannot be written: no space is left on the disk; free some space"):  # noqa: SIM117
        with atomic_write.replacing(tmp_path / "x.exr"):
            raise OSError('Failed to write pixel data to image file "x.part.exr". No space left on device.')
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def none_begun(monkeypatch):
    monkeypatch.setattr(atomic_write, "_undos", {})
    yield None
    assert not atomic_write._undos


def test_a_block_is_undone_at_its_end(tmp_path, none_begun):
    place = tmp_path / "half"
    with undone(lambda: place.unlink(missing_ok=True)):
        place.touch()
    assert not place.exists()


def test_an_interrupt_in_the_very_end_is_made_good(tmp_path, none_begun):
    place, tries = tmp_path / "half", []

    def undo() -> None:
        tries.append(1)
        if len(tries) == 1:
            raise KeyboardInterrupt
        place.unlink(missing_ok=True)

    with pytest.raises(KeyboardInterrupt), undone(undo):
        place.touch()
    assert place.exists()
    undo_all()
    assert not place.exists()


def test_one_that_cannot_be_undone_does_not_keep_the_others(tmp_path, none_begun):
    place = tmp_path / "half"
    place.touch()
    Unfinished(place.unlink)
    Unfinished((tmp_path / "missing").unlink)
    settled = Unfinished(tmp_path.rmdir)
    settled.settle()
    undo_all()
    assert list(tmp_path.iterdir()) == []
