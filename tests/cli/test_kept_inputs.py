"""What a command reads it does not write over, under whatever name."""

import os
import shutil
from pathlib import Path

import pytest

from lippmann.cli.shared.command_options import check_outputs
from lippmann.errors import OutputError


@pytest.fixture
def picture(picture, tmp_path):
    """A copy of the small picture."""
    return Path(shutil.copy(picture, tmp_path / "p.png"))


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("replay", "{}", "-o", "{}"),
        ("refocus", "{}", "-o", "{}"),
        ("view", "{}", "--export", "{}"),
        ("marks", "{}", "-o", "{}"),
        ("compare", "{}", "{}", "--map", "{}"),
        ("render", "{}", "-o", "{}"),
        ("interlace", "{}", "{}", "--lpi", "60", "--ppi", "600", "--size", "2x2in", "-o", "{}"),
    ],
    ids=lambda words: words[0],
)
def test_a_picture_is_kept(lippmann, picture, words):
    before = picture.read_bytes()
    done = lippmann(*(word.format(picture) for word in words))
    assert done.code == 2
    assert done.err.splitlines()[-1].endswith(f"is '{picture}', which is read; choose another name")
    assert picture.read_bytes() == before


@pytest.mark.slow
def test_links_are_the_same_file(lippmann, picture, tmp_path):
    os.link(picture, tmp_path / "hard.png")
    (tmp_path / "soft.png").symlink_to(picture)
    for name in ("hard.png", "soft.png"):
        done = lippmann("replay", picture, "-o", tmp_path / name)
        assert done.code == 2
        assert "which is read" in done.err


def test_other_files_and_plain_words_are_free(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a", "b"):
        (tmp_path / name).write_bytes(b"")
    check_outputs([(("--output",), "a"), (("scene",), "b"), (("--spp",), 4), (("--display",), None), (("x",), "a\0")])
    with pytest.raises(OutputError):
        check_outputs([(("--output", "-o"), "a"), (("photos",), ["b", tmp_path / "a"])])
