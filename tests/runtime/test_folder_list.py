"""What a folder's list says may be removed: only what this user's Lippmann wrote, and left as it was."""

import pytest

from lippmann.errors import OutputError
from lippmann.runtime.atomic_write import replacing_folder
from lippmann.runtime.folder_list import CONTENTS_FILE, read_list


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "views"
    with replacing_folder(place) as temporary:
        (temporary / "sub").mkdir()
        (temporary / "a.png").write_text("1")
        (temporary / "sub" / "b \udcff.png").write_text("2")
    return place


def test_what_was_written_is_listed(folder):
    assert read_list(folder) == {"a.png", "sub/b \udcff.png"}


def test_a_file_that_was_changed_is_the_users(folder):
    (folder / "a.png").write_text("mine, now")
    assert read_list(folder) == {"sub/b \udcff.png"}
    with pytest.raises(OutputError, match=r"the folder holds 'a\.png', which Lippmann did not write, or which was"):
        replacing_folder(folder).__enter__()


def test_codes_of_one_file_are_not_those_of_another(folder):
    text = (folder / CONTENTS_FILE).read_bytes()
    (folder / "thesis.pdf").write_text("1")
    (folder / CONTENTS_FILE).write_bytes(text + text.split(b" ")[0] + b" thesis.pdf\n")
    assert "thesis.pdf" not in read_list(folder)
