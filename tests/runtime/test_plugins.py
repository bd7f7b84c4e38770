"""Readers, displays, exports and integrators of other packages, sound and broken."""

from __future__ import annotations

import importlib.metadata
import sys

import pytest

import lippmann
from lippmann.cli import run
from lippmann.errors import DisplayError, OutputError, SceneError, UsageError
from lippmann.options.scene import SceneOptions
from lippmann.plugins import doors, installed
from lippmann.runtime.plugins import function_of
from lippmann.scene.readers.load import load_scene
from lippmann.sequences.motion import open_motion

SOUND = """
import numpy as np
from lippmann.plugins import *

def read(path, **options):
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32) * float(path.read_text())
    mesh = Mesh("triangle", positions, np.array([[0, 1, 2]], np.uint32), material=0)
    notes = [f"{name}={value}" for name, value in options.items()]
    return SceneDescription(path.stem, [mesh], [Material()], [Instance(0, np.eye(4))], notes=notes)

"""
READER = "READER = Reader(('.tri',), read, {b'3': '.tri'}, ('series',), 'z')"


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Lays a package with one module and its entry point where Python finds it."""
    monkeypatch.syspath_prepend(tmp_path)

    def lay(name, code, entry="readers", target="READER", point="tri"):
        (tmp_path / f"{name}.py").write_text(code)
        info = tmp_path / f"{name}-1.5.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.5\n")
        (info / "entry_points.txt").write_text(f"[lippmann.{entry}]\n{point} = {name}:{target}\n")
        sys.modules.pop(name, None)
        importlib.invalidate_caches()
        forget()

    def forget():
        for door in doors():
            door.__dict__.pop("plugins", None)

    yield lay
    forget()


@pytest.fixture
def save(tmp_path):
    def write(name, text="1"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return write


def test_a_reader_reads_its_files_with_the_options_that_it_takes(install, save):
    install("sound", SOUND + READER)
    scene = load_scene(save("a.tri"), series="2", up="y")
    assert scene.name == "a"
    assert scene.notes[0] == "series=2"
    assert load_scene(save("unnamed", "3")).description.meshes[0].positions.max() == 3
    with pytest.raises(UsageError, match=r"a\.tri has no variants"):
        load_scene(save("a.tri"), variants={"a": "b"})
    assert [(group, each.claims) for group, each in installed()] == [("lippmann.readers", (".tri",))]


def test_a_reader_has_options_of_its_own(install, save, capsys):
    settings = "settings={'scale': 1.0, 'count': 2, 'smooth': False, 'tint': 'red'}"
    install("sound", SOUND + READER.replace("'z')", f"'z', {settings})"))
    asked = {"scale": "2", "count": "3", "smooth": "true", "tint": "blue=green"}
    assert load_scene(save("a.tri"), up="y", reader_options=asked).notes[:4] == (
        "scale=2.0",
        "count=3",
        "smooth=True",
        "tint=blue=green",
    )
    assert load_scene(save("a.tri"), up="y", reader_options={"smooth": False, "scale": 2}).notes[:2] == (
        "smooth=False",
        "scale=2.0",
    )
    for name, value, message in [
        ("scales", "2", r"reader_options: unknown option of the reader of a\.tri 'scales', did you mean 'scale'"),
        ("scale", "x", "reader_options: scale=x; must be a finite number"),
        ("scale", "nan", "reader_options: scale=nan; must be a finite number"),
        ("count", "2.5", "reader_options: count=2.5; must be a whole number"),
        ("smooth", "1", "reader_options: smooth=1; must be true or false"),
    ]:
        with pytest.raises(UsageError, match=message):
            load_scene(save("a.tri"), reader_options={name: value})
    for source in ("teapot", save("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")):
        with pytest.raises(UsageError, match=r"reader_options: .*(teapot is no file|a\.obj has no options)"):
            load_scene(source, reader_options={"scale": "2"})
    assert run(["doctor"]) in (0, 1)
    assert "(lippmann.readers): .tri; options: scale=1.0, count=2, smooth=False, tint=red\n" in capsys.readouterr().out


def test_a_file_that_moves_has_the_options_of_its_reader_and_no_others(install, save):
    code = """
class Moving:
    duration = 1.0
    def __init__(self, path, animation=None, grow=1.0):
        self.path, self.grow, self.content = path, grow, (str(path), grow)
    def at(self, seconds):
        scene = read(self.path)
        scene.meshes[0].positions[:] *= 1 + self.grow * seconds
        return scene

READER = Reader(('.tri',), read, up='y', moving=Moving, settings={'grow': 1.0})
"""
    install("sound", SOUND + code)
    asked = SceneOptions(reader_options={"grow": "3"})
    motion = open_motion(save("a.tri"), fps=2, asked=asked)
    assert [motion.scene(frame).bounds[1][0] for frame in range(3)] == [1.0, 2.5, 4.0]
    with pytest.raises(UsageError, match=r"variants: a\.tri has no variants"):
        open_motion(save("a.tri"), asked=SceneOptions(variants={"a": "b"}))
    with pytest.raises(UsageError, match=r"reader_options: unknown option of the reader of a\.tri 'size'"):
        open_motion(save("a.tri"), asked=SceneOptions(reader_options={"size": "2"}))


@pytest.mark.parametrize(
    ("code", "problem"),
    [
        (
            SOUND + "READER = Reader(('.tri',), read, settings={'up-to': 1})",
            "its option 'up-to' is no word of its own .*",
        ),
        (
            SOUND + "READER = Reader(('.tri',), read, settings={'files': 1})",
            "its option 'files' is no word of its own .*",
        ),
        (
            SOUND + "READER = Reader(('.tri',), read, settings={'a': None})",
            "the default of its option 'a' is no text, .*",
        ),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        (SOUND + "READER = Reader(('.tri',))", "TypeError: .*missing 1 required positional argument: 'read'"),
        (SOUND + "READER = read", r"it names a function, and has to name a lippmann\.plugins\.Reader"),
        (SOUND + "READER = Reader(('.glb',), read)", r"'\.glb' belongs to Lippmann"),
        (SOUND + "READER = Reader(('tri',), read)", "its suffix 'tri' is no dot and letters in lower case"),
        (SOUND, "AttributeError: .*has no attribute 'READER'"),
    ],
)
def test_a_broken_reader_is_one_line_that_names_its_package_and_stops_nothing_else(install, save, code, problem):
    install("broken", code)
    with pytest.raises(
        SceneError, match=rf"a\.tri.*; the plugin tri of broken 1\.5 is broken \({problem}\)$"
    ) as caught:
        load_scene(save("a.tri", "x"))
    assert "\n" not in str(caught.value)
    [(_, plugin)] = installed()
    assert plugin.problem
    assert load_scene(save("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")).name == "a"
    assert load_scene("teapot").name == "teapot"


def test_the_second_of_two_packages_cannot_take_the_suffix_of_the_first(install, save):
    install("first", SOUND + READER, point="a")
    install("second", SOUND + READER, point="b")
    assert load_scene(save("a.tri")).name == "a"
    assert [each.problem for _, each in installed()] == ["", "'.tri' belongs to a of first 1.5"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x", r"a\.tri: the plugin tri of sound 1\.5 failed \(ValueError: could not convert string to float: 'x'\)"),
        ("nan", r"a\.tri: mesh 'triangle' has 3 vertices that are not finite"),
    ],
)
def test_what_a_reader_does_wrong_is_told_of_the_file(install, save, text, message):
    install("sound", SOUND + READER)
    with pytest.raises(SceneError, match=message):
        load_scene(save("a.tri", text))


def test_a_reader_has_to_make_a_description(install, save):
    install("odd", "from lippmann.plugins import Reader\nREADER = Reader(('.tri',), lambda path: {})")
    with pytest.raises(SceneError, match=r"a\.tri: the plugin tri of odd 1\.5 made a dict of it; a reader returns a"):
        load_scene(save("a.tri"))


def test_a_broken_display_is_left_out_and_named(install):
    install("maker", "from lippmann.plugins import *\nD = Displays({'acme': 'gap = 1'})", "displays", "D", "acme")
    assert "acme" not in [display.name for display in lippmann.list_displays()]
    with pytest.raises(
        DisplayError, match=r"unknown display 'acme'.*; the plugin acme of maker 1\.5 is broken \(acme\.t"
    ):
        lippmann.load_display("acme")


def test_a_display_file_of_a_plugin(install, save):
    code = "import lippmann\nfrom lippmann.plugins import *\ndef read(path):\n    return {}[path.stem] if "
    code += "path.stem == 'bad' else lippmann.load_display('mla-square')\nD = Displays(suffixes=('.lens',), read=read)"
    install("maker", code, "displays", "D", "acme")
    assert lippmann.load_display(save("my.lens")).name == "mla-square"
    with pytest.raises(DisplayError, match=r"bad\.lens: the plugin acme of maker 1\.5 failed \(KeyError: 'bad'\)"):
        lippmann.load_display(save("bad.lens"))


def test_broken_integrators_and_exports_are_named_where_their_names_are_asked_for(install, tmp_path):
    install("dim", "1 / 0", "integrators", "X", "dim")
    with pytest.raises(
        UsageError, match=r"integrator: unknown integrator 'dim'.*; the plugin dim of dim 1\.5 is broken"
    ):
        lippmann.render("teapot", integrator="dim")
    install("rolls", "1 / 0", "exports", "X", "roll")
    from lippmann.exchange.layouts import check_target
    from lippmann.viewing.video_file import check_animation_path

    for error, ask in (
        (UsageError, lambda: check_target("roll", tmp_path)),
        (OutputError, lambda: check_animation_path(tmp_path / "a.roll")),
    ):
        with pytest.raises(error, match=r"unknown .*; the plugin roll of rolls 1\.5 is broken \(ZeroDivisionError"):
            ask()


def test_what_is_lippmanns_own_looks_for_no_plugins(monkeypatch, save):
    def never(**_):
        raise AssertionError("the metadata of all packages is read")

    monkeypatch.setattr(importlib.metadata, "entry_points", never)
    for door in doors():
        monkeypatch.delitem(door.__dict__, "plugins", raising=False)
        assert all(door.find(claim).distribution == "" for claim in door.own_claims)
    load_scene("teapot")
    load_scene(save("a.b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"))
    lippmann.load_display("portrait")
    lippmann.load_display("Looking Glass Go")
    lippmann.RenderRequest(integrator="normal")


def test_every_function_of_lippmanns_own_is_there():
    for door in doors():
        for own in door.own.values():
            targets = [getattr(own, name, None) for name in ("read", "moving", "write", "make")]
            assert all(callable(function_of(target)) for target in targets if target is not None)
