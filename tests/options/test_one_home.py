"""An option is said once: command line, Python, studio, its files and a picture's metadata have it from there."""

from __future__ import annotations

import inspect
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Literal, get_args, get_origin

import numpy as np
import pytest

import lippmann
from lippmann.cli.shared.command_options import with_options
from lippmann.errors import UsageError
from lippmann.options.forms import LEFT_OUT
from lippmann.options.light import LightOptions
from lippmann.options.option import default_of, kinds_of, options_of
from lippmann.options.outputs import AccessOptions
from lippmann.options.placement import PlacementOptions
from lippmann.options.prints import PrintOptions
from lippmann.options.quality import MachineKeywords, MachineOptions, QualityOptions, RenderKeywords
from lippmann.options.scene import LoadKeywords, SceneOptions
from lippmann.options.texts import from_plain, settings_of, to_plain, toml_of
from lippmann.studio_app.command_line import words_of_state
from lippmann.studio_app.state import StudioState
from lippmann.studio_app.state_toml import state_of_text, text_of_state

CLASSES = (SceneOptions, AccessOptions, PlacementOptions, LightOptions, QualityOptions, MachineOptions)
OPTIONS = [(kind, each, its) for kind in CLASSES for each, its in options_of(kind)]
#: Values of tuples, of which not every one will do.
TUPLES = {"background": (0.25, 0.5, 0.0), "window": (-10.0, 20.5), "crop": (-1.0, -2.0, -3.5, 1.0, 2.0, 3.0)}

each_option = pytest.mark.parametrize(("kind", "each", "its"), OPTIONS, ids=[each.name for _, each, _ in OPTIONS])


def sample(each, its):
    """A value that is not the default."""
    if each.name in ("variants", "reader_options"):
        return {"shading": "red"}
    if its.words is not None:
        return Path("a file.exr") if its.words == Path | None else "fire"
    default, kinds = default_of(each), kinds_of(each.type)
    words = [word for kind in kinds if get_origin(kind) is Literal for word in get_args(kind) if word != default]
    if float in kinds:
        return min(max(its.low, 0.5), its.high)
    if int in kinds:
        return 2048 if each.name == "memory" else 2
    if bool in kinds:
        return not default
    parts = next((get_args(kind) for kind in kinds if get_origin(kind) is tuple), None)
    if parts is not None:
        return TUPLES.get(each.name, (12.5, -7.0, 3.0)[: len(parts)])
    return words[-1] if words else "a name"


def words_of(each, its, value):
    """The words that ask for a value."""
    flag = its.flag_of(each.name)
    if isinstance(value, bool):
        return [flag]
    if each.name == "memory":
        return [flag, f"{value >> 10}K"]
    if isinstance(value, dict):
        return [flag, *(f"{name}={choice}" for name, choice in value.items())]
    return [flag, ",".join(map(str, value)) if isinstance(value, tuple) else str(value)]


class Asked(Exception):  # noqa: N818
    """Ends a render with what was asked for."""


@pytest.fixture
def asked_by(monkeypatch):
    """What a call asks for: scene options, light, access, display, request; nothing is loaded or rendered."""
    from lippmann.rendering import picture
    from lippmann.scene.readers import load

    seen = []
    scene = load.load_scene("teapot")

    def read_scene(source, asked, light=None, *, allow_outside=False):
        seen.append((source, asked, light or LightOptions(), allow_outside))
        return scene

    def render_picture(scene, display, request, progress):
        raise Asked(display, request)

    monkeypatch.setattr(load, "read_scene", read_scene)
    monkeypatch.setattr(picture, "render_picture", render_picture)

    def ask(call):
        seen.clear()
        with pytest.raises(Asked) as caught:
            call()
        return *seen[0], *caught.value.args

    return ask


@each_option
def test_both_doors_ask_for_the_same(kind, each, its, asked_by, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    value = sample(each, its)
    words = ["render", "teapot", *words_of(each, its, value)]

    def command():
        from lippmann.cli import app

        app.app_of(words)(words, prog_name="lippmann", standalone_mode=False)

    given = {home: {} for home in CLASSES}
    given[kind][each.name] = value
    if each.name == "layers":  # which only a file for data holds
        words += ["-o", "a.exr"]
        given[QualityOptions]["tone_map"] = "none"
    by_command, by_call = asked_by(command), asked_by(lambda: call(given))
    assert by_command == by_call
    assert by_command != asked_by(lambda: call({home: {} for home in CLASSES}))


#: Two values of each option of a print.
PRINT = {
    "lpi": ("75", "60"),
    "print_lpi": ("60.1", "60.2"),
    "ppi": ("720", "600"),
    "size": ("80x50mm", "60x45mm"),
    "viewing_distance": ("700mm", "600mm"),
    "thickness": ("0.7mm", "0.8mm"),
    "index": ("1.5", "1.6"),
    "field": ("40", "41"),
}


@pytest.mark.parametrize("name", [each.name for each, _ in options_of(PrintOptions)])
def test_both_doors_ask_for_the_same_print(name, asked_by, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    value, other = PRINT[name]
    asked = {"lpi": "60", "ppi": "600", "size": "60x45mm", name: value}
    if name == "print_lpi":
        del asked["lpi"]
    if name == "index":
        asked["thickness"] = "0.7mm"
    flags = [word for key, value in asked.items() for word in (f"--{key.replace('_', '-')}", value)]
    words = ["render", "teapot", "-d", "print", *flags, "--bleed", "3mm", "--threads", "2"]

    def command():
        from lippmann.cli import app

        app.app_of(words)(words, prog_name="lippmann", standalone_mode=False)

    def by_call(**changes):
        short = ",".join(f"{key.replace('_', '-')}={value}" for key, value in (asked | changes).items())
        display = lippmann.load_display(f"print:{short}")
        return asked_by(lambda: lippmann.render("teapot", display, bleed=3.0, threads=2))[1:]

    by_command = asked_by(command)[1:]
    assert by_command == by_call()
    assert by_command != by_call(**{name: other})


def call(given):
    """What the command does, by the library; its keywords by their class."""
    from lippmann.api import render
    from lippmann.scene.readers.load import load_scene

    scene = load_scene("teapot", light=given[LightOptions], **given[SceneOptions], **given[AccessOptions])
    render(scene, placement=given[PlacementOptions], **given[QualityOptions], **given[MachineOptions])


@each_option
def test_an_option_is_checked_and_explained(kind, each, its):
    assert its.help.endswith(".")
    assert its.group
    if its.high < float("inf") and each.name != "memory":
        for value in (its.low - 1, its.high * 2 if its.high < 1e300 else float("nan")):
            with pytest.raises(UsageError) as caught:
                kind(**{each.name: value})
            assert caught.value.parameter == each.name
    kind(**{each.name: default_of(each)})


def test_numbers_of_numpy_are_taken_as_plain_ones():
    asked = QualityOptions(spp=np.int64(4), seed=np.uint32(3), quality=np.float32(30))
    assert [type(value) for value in (asked.spp, asked.seed, asked.quality)] == [int, int, float]
    assert settings_of(asked) == settings_of(QualityOptions(spp=4, seed=3, quality=30.0))
    for wrong in (True, np.float32(4), np.int64(0)):
        with pytest.raises(UsageError, match=r"spp: .* whole number from 1"):
            QualityOptions(spp=wrong)


@pytest.mark.parametrize(
    ("function", "kinds", "left_out"),
    [
        (lippmann.load_scene, (SceneOptions, AccessOptions), ()),
        (lippmann.render, (QualityOptions, MachineOptions), ()),
        (lippmann.render_to_file, (QualityOptions, MachineOptions), LEFT_OUT["tiles"]),
        (lippmann.render_quilt, (QualityOptions, MachineOptions), LEFT_OUT["quilt"]),
        (lippmann.plan, (QualityOptions, MachineOptions), LEFT_OUT["forecast"]),
        (lippmann.preview, (QualityOptions, MachineOptions), LEFT_OUT["preview"]),
        (lippmann.render_turntable, (QualityOptions, MachineOptions), ()),
    ],
)
def test_calls_say_their_keywords(function, kinds, left_out):
    signature, described = inspect.signature(function), inspect.getdoc(function)
    chosen = [(each, its) for kind in kinds for each, its in options_of(kind) if each.name not in left_out]
    for each, _ in chosen:
        assert signature.parameters[each.name].default == default_of(each)
        assert f"\n{each.name}:\n    " in described
    assert not {*left_out} & {*signature.parameters}
    assert "**" not in described


def test_the_studio_says_its_settings():
    parameters, state = inspect.signature(lippmann.studio).parameters, StudioState()
    for each, _ in options_of(StudioState):
        if each.name not in ("scene", "display", "eye"):
            assert parameters[each.name].default == getattr(state, each.name), each.name


@pytest.mark.parametrize(
    ("keywords", "kinds"),
    [
        (RenderKeywords, (QualityOptions, MachineOptions)),
        (MachineKeywords, (MachineOptions,)),
        (LoadKeywords, (SceneOptions, AccessOptions)),
    ],
)
def test_type_checkers_know_the_keywords(keywords, kinds):
    def said(kind):
        return getattr(kind, "__forward_arg__", kind)

    typed = {name: said(kind) for name, kind in keywords.__annotations__.items()}
    assert typed == {each.name: each.type for kind in kinds for each, _ in options_of(kind)}


@pytest.mark.parametrize(
    ("kind", "each", "its"), [row for row in OPTIONS if row[0] not in (AccessOptions, MachineOptions)]
)
def test_the_studio_its_files_and_metadata_have_an_option(kind, each, its):
    value = sample(each, its)
    told = str(value) if isinstance(value, Path) else value
    state = StudioState(**{each.name: told})
    assert state_of_text(text_of_state(state)) == state
    assert from_plain(StudioState.__dataclass_fields__[each.name].type, to_plain(told)) == told
    words = words_of_state(state)
    assert its.flag_of(each.name) in words
    assert settings_of(kind(**{each.name: value})) == [f"{each.name} = {toml_of(getattr(state, each.name))}"]


def test_the_studio_lets_no_setting_open_files_elsewhere():
    assert "allow_outside" not in StudioState.__dataclass_fields__


def test_a_command_takes_a_class_once():
    def command(*, how: QualityOptions) -> None: ...

    made = with_options(command)
    assert set(inspect.signature(made).parameters) - {"help_all"} == {
        each.name for each, _ in options_of(QualityOptions)
    }


NEW = """
import inspect, sys
import lippmann
from lippmann.cli import run
from lippmann.options.texts import settings_of
from lippmann.options.quality import QualityOptions
from lippmann.studio_app.command_line import words_of_state
from lippmann.studio_app.state import StudioState
from lippmann.studio_app.state_toml import state_of_text, text_of_state

assert inspect.signature(lippmann.render).parameters["grain"].default == 0.0
assert "Grain of the film." in lippmann.render.__doc__
state = StudioState(grain=0.5)
assert state_of_text(text_of_state(state)) == state
assert words_of_state(state)[-2:] == ["--grain", "0.5"], words_of_state(state)
assert state.request().grain == 0.5
assert settings_of(QualityOptions(grain=0.5)) == ["grain = 0.5"]
assert run(["render", "--help-all"]) == 0
assert run(["render", "teapot", "--grain", "2"]) == 2
"""


@pytest.mark.slow
def test_a_new_option_is_two_places_in_one_file(tmp_path):
    """Field and keyword; what it does is written where it is done."""
    source = Path(lippmann.__file__).parent
    shutil.copytree(source, tmp_path / "lippmann", ignore=shutil.ignore_patterns("__pycache__"))
    home = tmp_path / "lippmann" / "options" / "quality.py"
    text = home.read_text(encoding="utf-8")
    field = '    grain: float = _quality(0.0, "Grain of the film.", low=0.0, high=1.0)\n'
    for before, line in (("    layers: bool = option(", field), ("    layers: bool\n", "    grain: float\n")):
        assert text.count(before) == 1
        text = text.replace(before, line + before)
    home.write_text(text, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", NEW], env=environment, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "--grain <float>" in done.stdout
    assert done.stderr == "lippmann: --grain: 2.0; must be a number from 0 to 1.0\n"
