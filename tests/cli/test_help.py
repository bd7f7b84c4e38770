"""Help: in groups, at 80 columns, with examples that are commands."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
import typer

from lippmann.cli.app import COMMANDS, GROUPS, app_of, make_app
from lippmann.cli.shared.command_options import OPTION_GROUPS
from lippmann.cli.shared.examples import EXAMPLES
from lippmann.cli.shared.scene_source import output_of


@cache
def commands(command=None, words=()):
    """All commands by their words."""
    command = command or typer.main.get_command(make_app())
    found = {}
    for name, each in getattr(command, "commands", {}).items():
        if hasattr(each, "commands"):
            found |= commands(each, (*words, name))
        else:
            found[" ".join((*words, name))] = each
    return found


def test_help_may_be_a_word(lippmann):
    assert lippmann("help").out == lippmann("--help").out
    assert lippmann("help", "quilt", "sizes").out == lippmann("quilt", "sizes", "--help").out


@pytest.mark.slow
@pytest.mark.parametrize("name", commands())
def test_each_command_has_two_examples_that_parse(name):
    assert len(EXAMPLES[name]) == 2
    for line in EXAMPLES[name]:
        program, *words = shlex.split(line)
        own = name.split()
        assert [program, *words[: len(own)]] == ["lippmann", *own]
        context = commands()[name].make_context(name, list(words[len(own) :]))
        assert context.params


def test_no_example_is_of_something_else():
    assert set(EXAMPLES) == {*commands(), "lippmann"}


LARGE = ("render", "quilt render", "plan", "preview")


@pytest.mark.parametrize("name", LARGE)
def test_every_option_of_the_large_commands_has_a_group(name):
    options = [each for each in commands()[name].params if each.param_type_name == "option"]
    without = {each.opts[0] for each in options if each.rich_help_panel not in OPTION_GROUPS}
    assert without == {"--help-all"}


@pytest.mark.slow
@pytest.mark.parametrize("name", LARGE)
def test_the_first_help_shows_what_most_need_and_the_other_all(lippmann, name):
    first, whole = (lippmann(*name.split(), flag) for flag in ("--help", "--help-all"))
    assert (first.code, whole.code) == (0, 0)
    named = [set(re.findall(r"^  (?:-\w, )?(--[\w-]+)", done.out, flags=re.MULTILINE)) for done in (first, whole)]
    assert named[0] < named[1]
    options = [each.opts for each in commands()[name].params if each.param_type_name == "option"]
    assert all(named[1] & set(spellings) for spellings in options if any(each.startswith("--") for each in spellings))
    assert {"--display", "--effort", "--turn", "--help-all"} <= named[0]
    assert len(named[0]) <= 29


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [(), ("--help",), ("render", "--help"), ("render", "--help-all"), ("quilt", "--help"), ("plan", "--help-all")],
)
def test_help_is_well_formed(lippmann, words):
    done = lippmann(*words)
    assert (done.code, done.err) == (0, "")
    lines = done.out.splitlines()
    assert lines[0].startswith("Usage: lippmann")
    is_example = False
    for line in lines:
        is_example = is_example or line == "Examples:"
        assert is_example or len(line) <= 80, line
    titles = [line[:-1] for line in lines if line.endswith(":") and not line.startswith(" ")]
    if words == ("render", "--help-all"):
        assert titles == [*OPTION_GROUPS, "Examples"]
    if not words:
        assert titles == ["Options", *GROUPS, "Examples"]


def test_names_are_completed(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tea.glb").write_bytes(b"")
    (tmp_path / "tea.txt").write_bytes(b"")
    from lippmann.cli.shared.completion import complete_displays, complete_scenes

    assert complete_scenes("tea") == ["teapot", "tea.glb"]
    assert "panel-4k" in complete_displays("panel")
    code = "from lippmann.cli import main; main()"
    words = {"_LIPPMANN_COMPLETE": "complete_bash", "COMP_WORDS": "lippmann render tea", "COMP_CWORD": "2"}
    import os

    done = subprocess.run([sys.executable, "-c", code], env=os.environ | words, capture_output=True, text=True)
    assert "teapot" in done.stdout.split()


class TestOutputsThatNobodyNamed:
    @pytest.mark.slow
    def test_they_are_named_after_the_scene(self, lippmann, engine, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        words = ("render", "teapot", "--spp", 1, "--integrator", "albedo")
        first = lippmann(*words)
        assert (first.code, (tmp_path / "teapot.png").exists()) == (0, True)
        assert first.out.startswith("teapot.png: ")
        assert lippmann(*words).code == 0  # over its own picture
        assert lippmann("replay", "teapot.png").code == 0
        assert (tmp_path / "teapot-seen.png").exists()
        assert lippmann("preview", "teapot", "--spp", 1, "--pixels", "32x32", "--integrator", "albedo").code == 0
        assert (tmp_path / "teapot-preview.png").exists()

    def test_nothing_of_anybody_elses_is_overwritten(self, lippmann, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        (tmp_path / "teapot.png").write_bytes(b"a texture")
        done = lippmann("render", "teapot", "--spp", 1)
        assert done.code == 2
        said = "teapot.png: exists, and is no picture that Lippmann wrote; name another file: -o FILE"
        assert done.err == f"lippmann: {said}\n"
        assert (tmp_path / "teapot.png").read_bytes() == b"a texture"

    def test_the_picture_of_a_photograph_has_a_name_of_its_own(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        Path("photo.png").write_bytes(b"a photograph")
        assert output_of(None, "photo.png", ".png") == Path("photo-native.png")
        assert output_of(None, "elsewhere/photo.png", "-seen.png") == Path("photo-seen.png")

    def test_a_folders_name_has_no_ending_but_that_of_a_picture(self, tmp_path):
        for name, expected in (("cup_qs8x6a0.75-views", "cup_qs8x6a0.75-views-native.png"), ("a.zarr", "a-native.png")):
            (tmp_path / name).mkdir()
            assert output_of(None, tmp_path / name, "-native.png") == Path(expected)


def test_a_picture_is_opened_once_it_is_written(lippmann, engine, tmp_path, monkeypatch):
    from lippmann.cli.commands import view

    opened = []
    monkeypatch.setattr(view, "view", lambda path, **_: opened.append((path, path.exists())))
    out = tmp_path / "a.png"
    assert lippmann("render", "teapot", "--spp", 1, "--integrator", "albedo", "--open", "-o", out).code == 0
    assert opened == [(out, True)]
    refused = lippmann("render", "teapot", "--turntable", 4, "--open", "-o", tmp_path / "f")
    assert (refused.code, refused.err.startswith("lippmann: --open: shows a picture or a film; ")) == (2, True)


def test_the_first_help_tells_of_each_command_what_its_own_does():
    whole, outline = (typer.main.get_command(app).commands for app in (make_app(), app_of(["--help"])))
    assert {name: each.help.strip().split("\n")[0] for name, each in whole.items()} == {
        name: each.help for name, each in outline.items()
    }


def test_a_group_tells_of_each_command_its_whole_line(lippmann):
    for group in ("quilt", "calibrate"):
        assert "..." not in lippmann(group, "--help").out.partition("Commands:")[2]


def test_a_command_comes_without_the_others_and_a_wrong_word_with_all(monkeypatch):
    assert list(typer.main.get_command(app_of(["render", "--help"])).commands) == ["render"]
    assert set(typer.main.get_command(app_of(["rendre"])).commands) == set(COMMANDS)
    monkeypatch.setenv("_LIPPMANN_COMPLETE", "complete_bash")
    assert app_of([]) is make_app()
