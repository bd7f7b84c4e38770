"""Options that are several numbers, and settings as files hold them."""

import sys

import numpy as np
import pytest

from lippmann import LightOptions, PlacementOptions
from lippmann.errors import UsageError
from lippmann.options.scene import SceneOptions
from lippmann.options.texts import settings_of, toml_of

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


@pytest.mark.parametrize("given", [[0, 0.5, 1], np.array([0.0, 0.5, 1.0], np.float32), (0.0, 0.5, 1.0)])
def test_lists_and_arrays_become_pythons_own_numbers(given):
    background = SceneOptions(background=given).background
    assert background == (0.0, 0.5, 1.0)
    assert {type(value).__module__ for value in background} == {"builtins"}


@pytest.mark.parametrize(
    ("kind", "name", "value", "rule"),
    [
        (SceneOptions, "window", (1.0, 2.0, 3.0), "2 finite numbers"),
        (SceneOptions, "crop", (0.0,) * 5 + (np.inf,), "6 finite numbers"),
        (SceneOptions, "background", (0.0, 0.0, True), "three numbers from 0 to 1"),
        (SceneOptions, "background", 0.5, "three numbers from 0 to 1"),
        (LightOptions, "light_turn", 30.0, "two finite angles"),
        (PlacementOptions, "turn", (0.0, np.nan), "one to three numbers"),
    ],
)
def test_wrong_ones_are_refused(kind, name, value, rule):
    with pytest.raises(UsageError, match=f"{name}: .*{rule}"):
        kind(**{name: value})


def test_texts_are_those_that_toml_reads():
    text = "".join(map(chr, range(128)))
    assert tomllib.loads(f"text = {toml_of(text)}") == {"text": text}


def test_settings_tell_no_folders_and_no_defaults():
    asked = SceneOptions(depth_map="some/where/depth.png", unit_scale=2.0, series=None)
    assert settings_of(asked) == ['depth_map = "depth.png"', "unit_scale = 2.0"]
