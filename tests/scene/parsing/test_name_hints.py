"""Hints at misspelt names."""

import pytest

from lippmann.scene.parsing.name_hints import closest_name_hint


@pytest.mark.parametrize(
    ("name", "hint"),
    [("teapt", "is 'teapot' meant?"), ("teapots", "is 'teapot' meant?"), ("roum", "is 'room' meant?"), ("xyz", "")],
)
def test_the_most_similar_name_is_hinted_at(name, hint):
    assert closest_name_hint(name, ("room", "teapot", "tree")) == hint


def test_without_known_names_there_is_no_hint():
    assert closest_name_hint("teapot", ()) == ""
