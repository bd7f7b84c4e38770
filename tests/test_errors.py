"""Errors are one line; those of unknown names say the likeliest first."""

import pickle

import pytest

from lippmann.errors import SceneError, UsageError

NAMES = ("room", "teapot", "tree")


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("teapt", "unknown scene 'teapt', did you mean 'teapot'?; known are room, teapot, tree"),
        ("tre", "unknown scene 'tre', did you mean 'tree'?; known are room, teapot, tree"),
        ("xyz", "unknown scene 'xyz'; known are room, teapot, tree"),
        ("", "no scene; known are room, teapot, tree"),
        (None, "unknown scene 'None'; known are room, teapot, tree"),
        ("two\nlines", "unknown scene 'two lines'; known are room, teapot, tree"),
    ],
)
def test_an_unknown_name_is_told_with_the_likeliest_first(name, line):
    assert str(SceneError.unknown("scene", name, NAMES)) == line


def test_a_long_list_is_left_out_beside_a_likely_name():
    many = [*NAMES, *(f"number {each}" for each in range(10))]
    assert str(SceneError.unknown("scene", "teapt", many)) == "unknown scene 'teapt', did you mean 'teapot'?"
    assert "; known are room, teapot, tree, number 0, " in str(SceneError.unknown("scene", "xyz", many))


def test_where_a_name_stands_and_what_else_is_allowed():
    error = UsageError.unknown(
        "scene", "a", NAMES, where="a.toml:3", parameter="scene", rule="or a file", fix="name one"
    )
    assert str(error) == "a.toml:3: scene: unknown scene 'a'; or a file; name one"
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_without_known_names_there_are_none():
    assert str(SceneError.unknown("camera", "eye", ())) == "unknown camera 'eye'; there is none"


def test_long_names_and_long_lists_are_cut():
    line = str(SceneError.unknown("camera", "x" * 10_000, [f"camera-{number}" for number in range(1000)]))
    assert len(line) < 700
    assert line.endswith("camera-39, ...")
