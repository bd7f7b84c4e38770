"""Transfer functions: which is chosen, presets over a range, files, and what a choice changes."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LippmannError, SceneError, UsageError
from lippmann.scene.readers.load import load_scene
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.volume import TransferFunction, Volume
from lippmann.scene.volumes.grid import crop, visible_corners
from lippmann.scene.volumes.presets import PRESETS, automatic, preset
from lippmann.scene.volumes.transfer_file import read_transfer_function

RAMP = TransferFunction(np.array([0.0, 10.0]), np.array([[0, 0, 0], [1, 1, 1.0]]), np.array([0.0, 0.5]), shading=0.5)


def ct(bone):
    random = np.random.default_rng(0)
    return np.concatenate([np.full(5000, -1000.0), random.normal(40, 20, 5000), np.full(bone, 900.0)])


def test_the_values_tell_which_preset_suits():
    assert automatic(ct(500), None).name == automatic(ct(500), "ct").name == "ct-bone"
    assert automatic(ct(0), None).name == "ct-soft"
    assert automatic(np.random.default_rng(0).uniform(0, 255, 9000), None).name == "grey"
    assert automatic(np.random.default_rng(0).uniform(0, 255, 9000), "mr").name == "mr"


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=60), st.sampled_from(PRESETS))
def test_presets_are_sound_for_any_values(values, name):
    transfer = preset(name, np.array(values))
    assert (np.diff(transfer.values) > 0).all()
    assert transfer.opacities[0] == 0
    assert transfer.opacities.max() < 1
    assert 0 <= transfer.colors.min() <= transfer.colors.max() <= 1


def test_a_relative_preset_leaves_the_dark_out():
    random = np.random.default_rng(0)
    values = np.concatenate([random.normal(5, 2, 5000), random.normal(200, 20, 5000), [5000.0]])
    low, high = preset("mr", values).values[[0, -1]]
    assert 20 < low < 120
    assert 220 < high < 300


def test_what_a_map_of_a_statistic_leaves_empty_is_left_out():
    values = np.concatenate([np.zeros(6000), np.linspace(-6.0, 7.0, 5000)])
    assert preset("grey", values).values[0] == 0.0
    assert preset("grey", values[2000:]).values[0] < -1.0  # a field that has much of everything


def written(tmp_path, text, name="a.toml"):
    (tmp_path / name).write_text(text)
    return tmp_path / name


def test_files(tmp_path):
    points = [[-100, "#000000", 0], [300.5, "#ff8000", 0.25]]
    for path in (
        written(tmp_path, json.dumps({"points": points, "per": "percent", "shading": 0}), "a.json"),
        written(tmp_path, f'points = {points}\nper = "percent"\nshading = 0'.replace("'", '"')),
    ):
        transfer = read_transfer_function(path)
        assert transfer.values.tolist() == [-100, 300.5]
        assert transfer.colors[1] == pytest.approx([1, 0.2158605, 0])
        assert transfer.opacities.tolist() == [0, 0.25]
        assert (transfer.per, transfer.shading) == ("percent", 0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("points = 3", "lists no 2 to 4096 points"),
        ('points = [[0, "#000000", 0]]', "lists no 2"),
        ('points = [[0, "#000000", 0], [0, "#000000", 1]]', "are not in order"),
        ('points = [[0, "black", 0], [1, "#000000", 1]]', "number 1 has no colour"),
        ('points = [[0, "#000000", 0], [1, "#000000", 2]]', "number 2 has no opacity"),
        ('points = [[nan, "#000000", 0], [1, "#000000", 1]]', "number 1 has no value"),
        ("points = [[0, 1], [2, 3]]", "number 1 is no point"),
        ('points = [[0, "#000000", 0], [1, "#000000", 1]]\nper = "cm"', "per"),
        ('points = [[0, "#000000", 0], [1, "#000000", 1]]\nshading = 2', "shading"),
        ("colour = 3", "unknown key 'colour'"),
        ("points = [", "cannot be read"),
    ],
)
def test_files_that_say_something_else(tmp_path, text, said):
    with pytest.raises(SceneError, match=said) as error:
        read_transfer_function(written(tmp_path, text))
    assert "\n" not in str(error.value)


def volume(**changes):
    grid = np.zeros((8, 6, 4), np.int16)
    grid[2:4, 1:3, 1:3] = 8
    return SceneDescription("v", volume=Volume(grid, np.eye(4), **{"transfer": RAMP, **changes}))


def test_a_window_lays_the_function_between_two_values():
    shown = load_scene(volume(), window=(100, 300)).description.volume.transfer
    assert shown.values.tolist() == [100, 300]
    assert load_scene(volume(), transfer_function="ct-bone", window=(0, 1)).description.volume.transfer.values[0] == 0
    assert load_scene(volume(), transfer_function=RAMP).description.volume.transfer is RAMP


def test_a_box_keeps_the_voxels_in_it():
    scene = load_scene(volume(), crop=(0.5, -9, 1.5, 2.5, 9, 3.5))
    kept = scene.description.volume
    assert kept.size == (2, 6, 2)
    assert kept.world_from_voxel[:3, 3].tolist() == [1, 0, 2]
    oblique = Volume(kept.grid, np.array([[0.8, -0.6, 0, 0], [0.6, 0.8, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]), RAMP)
    assert crop(oblique, np.array([[-99, -99, -99], [99, 99, 99.0]])).size == oblique.size


def test_the_scene_is_as_large_as_what_can_be_seen():
    assert load_scene(volume()).bounds.tolist() == [[0.5, 0.5, 1.5], [2.5, 2.5, 3.5]]
    hidden = volume(transfer=TransferFunction(np.array([50.0, 60.0]), np.ones((2, 3)), np.array([0.0, 0.5])))
    assert np.ptp(visible_corners(hidden.volume), axis=0).tolist() == [4, 6, 8]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"transfer_function": "ct-bones"}, "unknown preset 'ct-bones', did you mean 'ct-bone'"),
        ({"transfer_function": "not-there.toml"}, "no such file"),
        ({"window": (3, 1)}, "two numbers, the lower first"),
        ({"crop": (50, 50, 50, 60, 60, 60)}, "leaves no voxel"),
        ({"crop": (1, 0, 0, 0, 1, 1)}, "six numbers"),
        ({"min_opacity": 0.5}, "holds no Gaussian splats"),
        ({"series": "1"}, "is for files"),
    ],
)
def test_choices_that_cannot_be(options, said):
    with pytest.raises(LippmannError, match=said):
        load_scene(volume(), **options)
    if "crop" not in options and "series" not in options and "min_opacity" not in options:
        with pytest.raises(UsageError, match=r"holds no volume|two numbers"):
            load_scene("teapot", **options)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"world_from_voxel": np.diag([1.0, 0, 1, 1])}, "no extent"),
        ({"world_from_voxel": np.full((4, 4), np.nan)}, "no 4x4 matrix"),
        ({"slope": 0.0}, "no scale"),
        ({"grid": np.zeros((2, 2), np.int16)}, "three axes"),
        ({"grid": np.zeros((2, 2, 2))}, "is of float64"),
        ({"grid": np.full((2, 2, 2), np.inf, np.float32)}, "not finite"),
    ],
)
def test_volumes_that_are_none(changes, said):
    values = {"grid": np.zeros((2, 2, 2), np.int16), "world_from_voxel": np.eye(4), "transfer": RAMP, **changes}
    with pytest.raises(SceneError, match=said):
        load_scene(SceneDescription("v", volume=Volume(**values)))
