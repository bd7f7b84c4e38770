"""Frames and messages between the studio and its page."""

from __future__ import annotations

import io
import json
import struct
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from lippmann.errors import UsageError
from lippmann.studio_app.wire import (
    CODINGS,
    LARGEST_NUMBER,
    FrameHeader,
    count_of,
    encode_frame,
    message_text,
    numbers_of,
    parse_message,
)

PIXELS = np.random.default_rng(1).integers(0, 256, (12, 20, 3), np.uint8)


def test_header_is_as_it_is_told():
    header = FrameHeader("png", 7, 9, 20, 12, samples=33, seconds=0.25, is_final=True, is_denoised=True)
    assert struct.unpack("<BBBBIIHHIf", header.pack()) == (1, 1, 3, 0, 7, 9, 20, 12, 33, 0.25)


@pytest.mark.parametrize("coding", CODINGS)
def test_pictures_arrive(coding):
    smooth = np.full((12, 20, 3), (200, 100, 50), np.uint8)
    sent = smooth if coding == "jpeg" else PIXELS
    body = encode_frame(FrameHeader(coding, 1, 1, 20, 12), sent)[24:]
    arrived = np.frombuffer(body, np.uint8).reshape(sent.shape) if coding == "rgb" else Image.open(io.BytesIO(body))
    assert np.abs(np.asarray(arrived).astype(int) - sent).max() <= (2 if coding == "jpeg" else 0)


def test_numbers_that_are_not_finite_are_null_for_the_page():
    message = {"type": "a", "depth": [1.5, np.inf], "in": {"it": (float("nan"), -np.inf, True)}, "title": "inf"}
    assert json.loads(message_text(message), parse_constant=pytest.fail) == {
        "type": "a",
        "depth": [1.5, None],
        "in": {"it": [None, None, True]},
        "title": "inf",
    }


@pytest.mark.parametrize(
    "text",
    [b"{}", None, "", "{}", "[]", "1", '{"type": 1}', '{"type": "view", "a": NaN}', "{" * 5000, '{"type": "a"'],
)
def test_what_is_no_message_is_refused(text):
    with pytest.raises(UsageError, match="an object of JSON with a type"):
        parse_message(text)


def test_deep_messages_are_refused():
    nested = "[" * 40 + "]" * 40
    with pytest.raises(UsageError):
        parse_message(f'{{"type": "view", "a": {nested}}}')


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4),
    max_leaves=12,
)


@given(JSON)
def test_any_message_is_read_or_refused(values):
    try:
        message = parse_message(json.dumps(values))
    except UsageError:
        return
    assert isinstance(message["type"], str)


@given(st.dictionaries(st.just("n"), JSON))
def test_any_number_is_within_its_range_or_refused(message):
    with suppress(UsageError):
        assert 0 <= count_of(message, "n") <= LARGEST_NUMBER
    with suppress(UsageError):
        assert all(-5 <= value <= 5 for value in numbers_of(message, "n", 2, 5.0))
