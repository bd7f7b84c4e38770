"""What a folder's list says may be removed: only what this user's Lippmann wrote, and left as it was."""

import os

import pytest

from lippmann.errors import OutputError
from lippmann.runtime import folder_list
from lippmann.runtime.atomic_write import replacing_folder
from lippmann.runtime.folder_list import CONTENTS_FILE, listed, write_list


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "views"
    with replacing_folder(place) as temporary:
        (temporary / "sub").mkdir()
        (temporary / "a.png").write_text("1")
        (temporary / "sub" / "b \udcff.png").write_text("2")
    return place


def test_what_was_written_is_listed(folder):
    assert listed(folder) == {"a.png", "sub/b \udcff.png"}


def test_a_file_that_was_changed_is_the_users(folder):
    (folder / "a.png").write_text("mine, now")
    assert listed(folder) == {"sub/b \udcff.png"}
    with pytest.raises(OutputError, match=r"the folder holds 'a\.png', which Lippmann did not write, or which was"):
        replacing_folder(folder).__enter__()


@pytest.mark.parametrize("line", ["thesis.pdf", f"{'0' * 64} thesis.pdf", " thesis.pdf"])
def test_a_forged_list_names_nothing(tmp_path, line):
    (tmp_path / "thesis.pdf").write_text("mine")
    (tmp_path / CONTENTS_FILE).write_text(f"{line}\n")
    assert listed(tmp_path) == set()
    with pytest.raises(OutputError, match=r"thesis\.pdf"):
        replacing_folder(tmp_path).__enter__()


def test_codes_of_one_file_are_not_those_of_another(folder):
    text = (folder / CONTENTS_FILE).read_bytes()
    (folder / "thesis.pdf").write_text("1")
    (folder / CONTENTS_FILE).write_bytes(text + text.split(b" ")[0] + b" thesis.pdf\n")
    assert "thesis.pdf" not in listed(folder)


def test_another_users_list_is_foreign(folder, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "other"))
    assert listed(folder) == set()


def test_without_a_key_nothing_is_listed(folder, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    assert listed(folder) == set()
    write_list(folder, ["a.png"])
    assert (folder / CONTENTS_FILE).read_text() == ""


def test_the_key_is_private_and_stays(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    first = folder_list._key()
    assert first == folder_list._key()
    assert os.listdir(tmp_path / "lippmann") == ["key"]
    assert (tmp_path / "lippmann" / "key").stat().st_mode & 0o077 == 0
