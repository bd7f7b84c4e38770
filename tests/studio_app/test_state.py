"""States survive their files, and their command line makes the same picture."""

from __future__ import annotations

import dataclasses
import shlex
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.errors import LippmannError, UsageError
from lippmann.options.light import LightOptions
from lippmann.options.placement import PlacementOptions
from lippmann.options.quality import QualityOptions
from lippmann.options.scene import SceneOptions
from lippmann.studio_app.command_line import words_of_state
from lippmann.studio_app.state import StudioState
from lippmann.studio_app.state_toml import read_state, state_of_text, text_of_state

NUMBERS = st.floats(-1e6, 1e6)
ANGLES = st.floats(-179, 179)
FACTORS = st.floats(1e-3, 1e3)
NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=12)

STATES = st.builds(
    StudioState,
    scene=NAMES,
    display=NAMES,
    up=st.sampled_from([None, "y", "z"]),
    environment=st.none() | NAMES,
    background=st.none() | st.tuples(*[st.floats(0, 1)] * 3),
    place=st.sampled_from([None, "fit"]),
    turn=st.tuples(ANGLES, ANGLES, ANGLES),
    shift=st.tuples(NUMBERS, NUMBERS, NUMBERS),
    scale=FACTORS,
    depth_scale=st.none() | FACTORS,
    pop_out=st.none() | st.floats(0, 1),
    light_turn=st.tuples(ANGLES, ANGLES),
    light_strength=st.floats(0, 100),
    environment_strength=st.floats(0, 100),
    exposure=st.just("auto") | st.floats(-10, 10),
    tone_map=st.sampled_from(["auto", "none", "pbr-neutral"]),
    integrator=st.sampled_from(["path", "direct", "auto"]),
    depth=st.none() | st.integers(1, 64),
    method=st.sampled_from(["auto", "full", "pooled"]),
    spp=st.none() | st.integers(1, 1000),
    quality=st.none() | st.floats(1, 80),
    seed=st.integers(0, 2**32 - 1),
    subpixels=st.none() | st.booleans(),
    eye=st.none() | st.tuples(NUMBERS, NUMBERS, st.floats(1, 1e4)),
)


@settings(max_examples=60)
@given(STATES)
def test_a_file_says_all_of_a_state(state):
    text = text_of_state(state)
    assert state_of_text(text) == state
    assert text.count("\n") <= len(dataclasses.fields(StudioState))


@pytest.mark.long
@settings(max_examples=30)
@given(STATES)
def test_the_command_line_says_all_but_the_eye(state):
    """Words are read as the command reads them: by its own parser, without the work."""
    import typer

    from lippmann.cli.app import make_app
    from lippmann.cli.shared.command_options import _make
    from lippmann.options.option import options_of

    def read_options(kind, values):
        return _make(kind, [each for each in options_of(kind) if each[0].name in values], values)

    command = typer.main.get_command(make_app()).commands["render"]
    words = words_of_state(state)
    assert shlex.split(shlex.join(words)) == words
    read = command.make_context("render", list(words)).params
    assert read["scene"].removeprefix("./") == state.scene.removeprefix("./")
    assert read["display"] == state.display
    for kind in (PlacementOptions, LightOptions, QualityOptions):
        assert read_options(kind, read) == kind.part_of(state)
    assert read_options(SceneOptions, read) == SceneOptions.part_of(state)


def test_a_draft_is_kept_and_said():
    state = StudioState(effort="draft")
    assert state_of_text(text_of_state(state)) == state
    assert words_of_state(state)[-2:] == ["--effort", "draft"]
    assert state.request().effort == "draft"
    with pytest.raises(UsageError) as caught:
        state_of_text('effort = "draft"\nspp = 4\n')
    assert str(caught.value).startswith("state:2: spp: 4 beside a draft; a draft has one sample a pixel; leave it out")


def test_files_that_a_state_names_lie_beside_it(tmp_path, monkeypatch):
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "model.glb").write_bytes(b"")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder" / "state.toml").write_text(text_of_state(StudioState(scene="model.glb")))
    assert read_state(tmp_path / "folder" / "state.toml").scene == str(tmp_path / "folder" / "model.glb")
    monkeypatch.chdir(tmp_path / "folder")
    assert StudioState(scene=read_state(tmp_path / "folder" / "state.toml").scene).scene.endswith("model.glb")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("turn = 3", "state:1: turn: 3; a list of 3 numbers"),
        ("scale = 1\n\nlight = 2", "state:3: unknown setting 'light'"),
        ("tunr = [1, 2, 3]", "did you mean 'turn'"),
        ("scene = ", "not valid TOML"),
        ("scale = 2\nscale = 3\n", "state:2: not valid TOML"),
        ('turn = [1.0, "a", 3.0]', "state:1: turn: 'a'; a number"),
        ("seed = 1.5", "state:1: seed: 1.5; a whole number"),
        ("subpixels = 1", "state:1: subpixels: 1; true or false"),
        ('method = "fast"', "known are auto, full"),
        ("\npop_out = 2.0", "state:2: pop_out: 2.0; must be a share of the depth"),
        ("light_strength = -1.0", "state:1: light_strength: -1.0; must be a factor from 0"),
        ("exposure = inf", "exposure"),
        ('place = "display"\npop_out = 0.5', "state:2: pop_out"),
        ("[scene]\nname = 1", "state:1: scene"),
        ("eye = [0.0, 0.0, 0.0]", "z above 0"),
        ("background = [0.0, 2.0, 0.0]", "from 0 to 1"),
        ('scene = ""', "state:1: scene: is empty"),
    ],
)
def test_what_is_wrong_in_a_file_is_told_in_one_line(text, line):
    with pytest.raises(UsageError) as raised:
        state_of_text(text)
    assert line in str(raised.value)
    assert "\n" not in str(raised.value)


def test_what_is_no_text_is_no_state(tmp_path):
    (tmp_path / "picture.png").write_bytes(b"\x89PNG\xff\xfe")
    for name in ("picture.png", "none.toml", "."):
        with pytest.raises(LippmannError, match="a state is a TOML file"):
            read_state(tmp_path / name)


@pytest.mark.long
def test_a_state_loads_no_engine():
    code = (
        "import sys, lippmann.studio_app.state_toml, lippmann.studio_app.command_line; "
        "import lippmann.rendering.live.renderer; "
        "assert 'mitsuba' not in sys.modules and 'drjit' not in sys.modules"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("setting", ["scale", "exposure", "quality"])
def test_numbers_of_hundreds_of_digits_are_refused_by_their_line(setting):
    with pytest.raises(UsageError, match=rf"state:2: {setting}: 1000.*a number below 1\.8e308"):
        state_of_text(f'scene = "teapot"\n{setting} = 1{"0" * 399}\n')


def test_a_byte_order_mark_is_no_part_of_a_state(tmp_path):
    path = tmp_path / "state.toml"
    path.write_bytes(b"\xef\xbb\xbf" + b'scene = "gears"\n')
    assert read_state(path).scene == "gears"
