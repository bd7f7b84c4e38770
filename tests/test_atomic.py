import errno
import os
import stat
from pathlib import Path

import pytest

from lippmann import atomic
from lippmann.errors import OutputError


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_file_appears_whole_at_the_end(tmp_path):
    place = tmp_path / "picture.png"
    with atomic.replacing(place) as temporary:
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
        with atomic.replacing(place) as temporary:
            temporary.write_bytes(b"new")
            raise failure

    with pytest.raises(type(failure)):
        write()
    assert place.read_bytes() == b"old"
    assert names(tmp_path) == ["picture.png"]


def test_full_disk_is_one_line_about_the_output(tmp_path):
    place = tmp_path / "picture.png"
    with pytest.raises(OutputError, match="no space") as raised, atomic.replacing(place) as temporary:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(temporary))
    assert str(raised.value).startswith(f"{place}: ")
    assert "\n" not in str(raised.value)
    assert ".part" not in str(raised.value)
    assert names(tmp_path) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="/dev/full, the disk that is always full, is Linux's")
def test_full_disk_met_by_the_writer_itself(tmp_path):
    with (
        pytest.raises(OutputError, match="no space"),
        atomic.replacing(tmp_path / "picture.png"),
        open("/dev/full", "wb", buffering=0) as full,
    ):
        full.write(b"x")
    assert names(tmp_path) == []


def test_error_about_another_file_passes_through(tmp_path):
    with pytest.raises(FileNotFoundError), atomic.replacing(tmp_path / "picture.png"):
        (tmp_path / "texture.png").read_bytes()
    assert names(tmp_path) == []


def test_missing_folder_is_named_with_the_command_that_makes_it(tmp_path):
    place = tmp_path / "no" / "picture.png"
    with pytest.raises(OutputError, match="mkdir -p") as raised, atomic.replacing(place):
        pass
    assert str(tmp_path / "no") in raised.value.what


@pytest.mark.parametrize("use", [atomic.replacing, atomic.check_writable])
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
            atomic.check_writable(tmp_path / "picture.png")
    finally:
        tmp_path.chmod(0o755)


def test_permission_denied_by_the_system(tmp_path, monkeypatch):
    def denied(*_):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(os, "open", denied)
    with pytest.raises(OutputError, match="permission"):
        atomic.check_writable(tmp_path / "picture.png")


def test_permissions_are_the_usual_ones_or_those_of_the_old_file(tmp_path):
    place = tmp_path / "picture.png"
    mask = os.umask(0o027)
    try:
        with atomic.replacing(place) as temporary:
            temporary.write_bytes(b"1")
        assert stat.S_IMODE(place.stat().st_mode) == 0o640
        place.chmod(0o604)
        with atomic.replacing(place) as temporary:
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
    with atomic.replacing(link) as temporary:
        temporary.write_bytes(b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


def test_relative_path_survives_a_change_of_folder(tmp_path, monkeypatch):
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path)
    with atomic.replacing(Path("picture.png")) as temporary:
        temporary.write_bytes(b"1")
        monkeypatch.chdir(tmp_path / "elsewhere")
    assert (tmp_path / "picture.png").read_bytes() == b"1"


def write_folder(place: Path, files: dict[str, str]) -> None:
    with atomic.replacing_folder(place) as temporary:
        for name, content in files.items():
            (temporary / name).parent.mkdir(exist_ok=True)
            (temporary / name).write_text(content)


def test_folder_is_replaced_as_a_whole(tmp_path):
    place = tmp_path / "views"
    write_folder(place, {"a.png": "1", "b.png": "2", "sub/c.png": "3"})
    write_folder(place, {"a.png": "4"})
    assert names(place) == [atomic.CONTENTS_FILE, "a.png"]
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
        atomic.check_folder_writable(place)
    assert names(place) == [atomic.CONTENTS_FILE, "a.png", "notes.txt"]
    assert names(tmp_path) == ["views"]


def test_file_put_into_the_folder_meanwhile_is_not_lost(tmp_path):
    place = tmp_path / "views"
    place.mkdir()

    def write():
        with atomic.replacing_folder(place) as temporary:
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
        with atomic.replacing_folder(place) as temporary:
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


def test_file_in_the_place_of_a_folder(tmp_path):
    (tmp_path / "views").write_text("mine")
    with pytest.raises(OutputError, match="this is a file"):
        write_folder(tmp_path / "views", {"a.png": "1"})
    assert (tmp_path / "views").read_text() == "mine"


def test_check_leaves_nothing(tmp_path):
    (tmp_path / "old.png").write_text("kept")
    atomic.check_writable(tmp_path / "new.png")
    atomic.check_writable(tmp_path / "old.png")
    atomic.check_folder_writable(tmp_path / "views")
    assert names(tmp_path) == ["old.png"]
    assert (tmp_path / "old.png").read_text() == "kept"
