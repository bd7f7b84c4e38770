"""The command line of the add-on: its words are those of Lippmann."""

import os
import sys
from pathlib import Path

import pytest

from lippmann.cli import run

SCENE, WORLD, OUTPUT = Path("scene.glb"), Path("world.exr"), Path("out.png")


@pytest.fixture
def line(addon):
    return addon("command_line")


def test_a_render(line):
    settings = line.Settings("seed-lenticular", quality=35.0, samples=8)
    words = line.command_line("L", "render", settings, SCENE, OUTPUT, world=WORLD, camera="Main", exposure=-0.5)
    assert words == [
        *("L", "render", str(SCENE), "--display", "seed-lenticular", "--exposure", "-0.5", "--camera", "Main"),
        *("--environment", str(WORLD), "--quality", "35", "--spp", "8", "-o", str(OUTPUT)),
    ]


def test_what_is_not_said_is_left_to_the_command(line):
    words = line.command_line("L", "render", line.Settings("d", by_camera=False), SCENE, OUTPUT, camera="Main")
    assert words == ["L", "render", str(SCENE), "--display", "d", "--exposure", "0", "-o", str(OUTPUT)]


def test_a_preview_has_no_quality(line):
    settings = line.Settings("d", quality=35.0, samples=8)
    assert not {"--quality", "--spp"} & set(line.command_line("L", "preview", settings, SCENE, OUTPUT))


@pytest.mark.parametrize("kind", ["preview", "render"])
def test_lippmann_knows_every_option(line, kind, capsys):
    settings = line.Settings("seed-lenticular", quality=30.0, samples=4)
    words = line.command_line("lippmann", kind, settings, SCENE, OUTPUT, world=WORLD, camera="Main", exposure=1.25)
    assert run([*words[1:], "--help"]) == 0  # an unknown option would come before the help
    assert run([*words[1:], "--no-such-option", "--help"]) == 2
    capsys.readouterr()


def test_outputs(line, tmp_path):
    assert line.output_problem(tmp_path / "a.PNG") is None
    assert "must end in .png" in line.output_problem(tmp_path / "a.jpg")
    assert "must end in" in line.output_problem(tmp_path)
    assert "there is no folder" in line.output_problem(tmp_path / "gone" / "a.png")


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "bin" / ("lippmann.exe" if sys.platform == "win32" else "lippmann")
    path.parent.mkdir()
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    return path


def test_the_preferred_command(addon, program):
    find = addon("find_command").find_command
    assert find(str(program)) == str(program)
    assert find(str(program.parent.parent)) == str(program)  # a virtual environment
    assert find(str(program.parent)) == str(program)
    assert find(str(program) + "-gone") is None


@pytest.mark.skipif(os.name == "nt", reason="there, endings make programs")
def test_a_file_that_is_no_program(addon, program):
    program.chmod(0o644)
    assert addon("find_command").find_command(str(program)) is None


def test_the_command_that_is_found(addon, program, monkeypatch, tmp_path):
    find = addon("find_command").find_command
    monkeypatch.setenv("PATH", str(program.parent))
    assert find() == str(program)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(addon("find_command").Path, "home", lambda: tmp_path)
    monkeypatch.setattr(addon("find_command").sys, "platform", "linux")
    assert find() is None
    usual = tmp_path / ".local" / "bin" / program.name
    usual.parent.mkdir(parents=True)
    program.rename(usual)
    assert find() == str(usual)
