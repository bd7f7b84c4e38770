"""Eye-tracked monitors as files."""

from __future__ import annotations

import pytest

from lippmann.display import Display, load_display
from lippmann.errors import DisplayError

GOOD = """title = "My monitor"

[stereo]
width = 1200
height = 900
diagonal = "15 in"
viewing_distance = "50 cm"
eyes = 60
layout = "full"
"""


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "mine.toml"
        path.write_text(text)
        return path

    return write


def test_own_monitor(write):
    display = load_display(write(GOOD))
    assert (display.name, display.title) == ("mine", "My monitor")
    assert display.size_mm == pytest.approx((304.8, 228.6))  # 12 x 9 inches
    assert display.viewing_distance == 500
    assert (display.stereo.eyes, display.stereo.width) == (60, "full")
    assert Display.from_dict(display.to_dict()) == display


def test_most_viewers_and_monitors_are_the_default(write):
    display = load_display(write(GOOD.replace('eyes = 60\nlayout = "full"\n', "")))
    assert (display.stereo.eyes, display.stereo.width) == (63, "half")


@pytest.mark.parametrize(
    ("good", "bad", "line", "said"),
    [
        ("eyes = 60", "eyes = 90", 8, "it must be 40 to 80 mm"),
        ('"full"', '"top"', 9, "unknown layout 'top'"),
        ('"50 cm"', '"50 m"', 7, "it must be 150 to 1500 mm"),
        ('"50 cm"', '"infinite"', 7, "is not a length"),
        ('"15 in"', "0", 6, "above zero"),
        ("width = 1200", "width = 0", 4, "whole number"),
        ("width = 1200", "widht = 1200", 4, "did you mean 'width'?"),
        ('diagonal = "15 in"\n', "", 3, "the key 'diagonal' is missing"),
        ("[stereo]", "[stereo]\n[panel]", 4, "unknown key 'panel'"),
    ],
)
def test_bad_values_are_named_with_their_line(write, good, bad, line, said):
    path = write(GOOD.replace(good, bad, 1))
    with pytest.raises(DisplayError) as caught:
        load_display(path)
    assert said in str(caught.value)
    assert caught.value.where == f"{path}:{line}"
    assert "\n" not in str(caught.value)
