"""States as the page has them."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st
from stand_in import TINY, placement

from lippmann.display import load_display
from lippmann.errors import UsageError
from lippmann.studio_app.page_values import (
    display_size,
    facts_of_view,
    optics_of,
    shell_line,
    state_of_values,
    values_of_state,
)
from lippmann.studio_app.state import StudioState

STATE = StudioState(
    scene="teapot",
    display=TINY,
    background=(0.1, 0.2, 0.3),
    turn=(10.0, -5.0, 0.0),
    depth_scale=0.5,
    exposure=1.5,
    subpixels=True,
)
VALUES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)


def test_a_state_comes_back():
    assert state_of_values(values_of_state(STATE)) == STATE
    assert state_of_values({}) == StudioState()


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ([], "object"),
        ({"colour": 1}, "unknown setting 'colour'"),
        ({"scene": ""}, "scene"),
        ({"scene": "a\nb"}, "scene"),
        ({"scene": "a" * 5000}, "scene"),
        ({"turn": [1, 2]}, "turn"),
        ({"turn": [1, 2, "3"]}, "turn"),
        ({"scale": 0}, "scale"),
        ({"scale": True}, "scale"),
        ({"scale": 1e300}, "scale"),
        ({"subpixels": 1}, "subpixels"),
        ({"tone_map": "loud"}, "tone_map"),
        ({"spp": 1.5}, "spp"),
        ({"pop_out": 2}, "pop_out"),
    ],
)
def test_what_is_no_state_is_refused_in_one_line(values, words):
    with pytest.raises(UsageError) as caught:
        state_of_values(values)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@given(
    st.dictionaries(
        st.sampled_from([field.name for field in fields(StudioState)]),
        VALUES | st.lists(VALUES, max_size=4),
        max_size=4,
    )
)
def test_any_values_are_a_state_or_refused(values):
    with suppress(UsageError):
        state = state_of_values(values)
        assert state_of_values(values_of_state(state)) == state


def test_facts_are_plain_values_in_the_words_of_the_page():
    display = load_display(TINY)
    facts = facts_of_view(display, placement(), 0.5)
    assert facts["depth"] == {"scene": [-10.0, 5.0], "sharp": [-8.0, 8.0]}
    assert facts["eye_tracked"] is False
    assert facts_of_view(load_display("odyssey-3d"), placement(), 0.5)["eye_tracked"] is True
    assert facts["warnings"] == ["depth scale 1 shows it whole"]
    assert ["Panel", f"{display.panel.width} x {display.panel.height} pixels"] in facts["display_facts"]
    assert optics_of(display, subpixels=None)["panel"]["subpixels"] is False


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        (TINY, (10.0, 8.0, "mm")),
        ("print:lpi=60, size = 8x10in ,ppi=720", (203.2, 254.0, "mm")),
        ("monitor:dpi=282,size=400x300,pitch=45.5,slope=-6,center=0", (400, 300, "px")),
        ("seed-lenticular", None),
        ("looking-glass-portrait", None),
    ],
)
def test_sizes_that_can_be_set(name, expected):
    size = display_size(StudioState(display=name))
    if expected is None:
        assert size is None
        return
    assert (size["width"], size["height"], size["unit"]) == pytest.approx(expected)
    # The text around the size is the same display in that size, and in another.
    same = load_display(f"{size['head']}{size['width']:g}x{size['height']:g}{size['tail']}")
    assert same == load_display(name)
    twice = load_display(f"{size['head']}{2 * size['width']:g}x{2 * size['height']:g}{size['tail']}")
    assert twice.panel.width == pytest.approx(2 * same.panel.width, abs=1)


def test_command_lines_are_quoted():
    assert shell_line(["lippmann", "render", "my model.glb"]) == "lippmann render 'my model.glb'"
