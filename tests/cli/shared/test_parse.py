"""What people type, as values."""

from __future__ import annotations

import pytest

from lippmann.cli.shared import parse
from lippmann.errors import UsageError


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("-40:40:5", [-40.0, -20.0, 0.0, 20.0, 40.0]),
        ("0:1:11", [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]),
        ("3:9:1", [3.0]),
    ],
)
def test_steps_reach_both_ends(text, values):
    assert parse.steps(text, "--planes") == values


@pytest.mark.parametrize("text", ["0:1", "0:1:0", "0:1:-2", "0:1:10000", "a:1:2"])
def test_other_steps_are_refused(text):
    with pytest.raises(UsageError, match="--planes"):
        parse.steps(text, "--planes")


def test_a_size_is_told_by_either_letter():
    assert parse.size("512x384", "--size") == parse.size(" 512X384 ", "--size") == (512, 384)


@pytest.mark.parametrize("text", ["512", "0x4", "4x00", "4x-4", "4.5x4", "1000000000x1"])
def test_other_sizes_are_refused(text):
    with pytest.raises(UsageError, match="; must be width x height in pixels"):
        parse.size(text, "--size")
