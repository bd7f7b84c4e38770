"""The Blender that is installed: where it is looked for, and which versions will do."""

import os
import sys

import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.blend import find_blender as finding
from lippmann.scene.readers.blend.find_blender import VARIABLE, blender_version, find_blender

pytestmark = pytest.mark.skipif(os.name == "nt", reason="the fake programs are scripts of a shell")


@pytest.mark.parametrize(
    ("said", "version"),
    [
        ("Blender 4.2.0 LTS", (4, 2)),
        ("warning: no display\nBlender 5.0.1\n  build date", (5, 0)),
        ("Blender", None),
        ("GNU bash, version 5.2", None),
        ("not Blender 4.2", None),
    ],
)
def test_the_version_that_a_program_tells(fake_blender, said, version):
    assert blender_version(str(fake_blender(version=said))) == version


def test_what_is_no_program(tmp_path):
    plain = tmp_path / "plain"
    plain.write_text("text")
    assert blender_version(str(plain)) is None
    assert blender_version(str(tmp_path)) is None
    assert blender_version(str(tmp_path / "gone")) is None


def test_the_environment_comes_first(fake_blender):
    named = fake_blender()
    assert find_blender("a.blend") == str(named)


def test_the_search_path_then_the_usual_places(no_blender, fake_blender, monkeypatch):
    program = fake_blender()
    elsewhere = fake_blender(name="elsewhere")
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setattr(finding, "_usual_places", lambda: [str(elsewhere)])
    assert find_blender("a.blend") == str(elsewhere)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.defpath}")
    assert find_blender("a.blend") == str(program)


def test_an_old_one_is_passed_over(no_blender, fake_blender, monkeypatch):
    old, new = fake_blender(version="Blender 4.1.1", name="old"), fake_blender(version="Blender 4.2.9", name="new")
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setattr(finding, "_usual_places", lambda: [str(old), str(new)])
    assert find_blender("a.blend") == str(new)
    monkeypatch.setattr(finding, "_usual_places", lambda: [str(old)])
    with pytest.raises(SceneError, match=r"^a\.blend: Blender 4\.1 is too old; 4\.2 or newer is needed; install"):
        find_blender("a.blend")
    monkeypatch.setattr(finding, "_has_module", lambda: True)
    assert find_blender("a.blend") is None


def test_none_at_all(no_blender):
    with pytest.raises(SceneError, match=r"^a\.blend: needs Blender, .* install Blender from blender\.org, or export"):
        find_blender("a.blend")


def test_an_environment_that_names_something_else(fake_blender, monkeypatch):
    fake_blender(version="Blender 3.6.0")
    with pytest.raises(SceneError, match=r"^a\.blend: Blender 3\.6 is too old"):
        find_blender("a.blend")
    monkeypatch.setenv(VARIABLE, sys.executable)
    with pytest.raises(SceneError, match=r"^a\.blend: LIPPMANN_BLENDER is '.*', which is no Blender"):
        find_blender("a.blend")


@pytest.mark.parametrize(("system", "ending"), [("darwin", "Blender"), ("win32", "blender.exe"), ("linux", "blender")])
def test_usual_places(monkeypatch, tmp_path, system, ending):
    monkeypatch.setattr(finding.sys, "platform", system)
    monkeypatch.setenv("PROGRAMFILES", str(tmp_path))
    for name in ("Blender 4.2", "Blender 4.10", "Blender 5.0"):
        (tmp_path / "Blender Foundation" / name).mkdir(parents=True)
    places = list(finding._usual_places())
    assert all(place.endswith(ending) for place in places)
    if system == "win32":
        assert ["5.0" in places[0], "4.10" in places[1], "4.2" in places[2]] == [True] * 3
