"""Answers to photographs of a panel that are none, or that no answer can be given to."""

from __future__ import annotations

import base64
import io
import json

import pytest
from PIL import Image

from lippmann.display import load_display
from lippmann.studio_app import panel_check
from lippmann.studio_app.panel_check import check_response, pattern_response
from lippmann.viewer.responses import RefusedError

DISPLAY = load_display("seed-lenticular")


def line(data):
    body = json.dumps({"photograph": base64.b64encode(data).decode()})
    return json.loads(check_response(DISPLAY, body.encode()).body)["line"]


def test_what_is_wrong_with_a_photograph_is_its_answer(monkeypatch):
    file = io.BytesIO()
    Image.new("RGB", (20, 10)).save(file, "PNG")
    assert line(b"no picture").startswith("photograph")
    assert "more than" not in line(file.getvalue())
    monkeypatch.setattr(panel_check, "_MOST_PIXELS", 199)
    assert "photograph: it has more than 199 pixels" in line(file.getvalue())


@pytest.mark.parametrize("body", [b"", b"[]", b"{}", b'{"photograph": 1}', b'{"photograph": "?"}', b"[" * 100_000])
def test_what_is_no_photograph_is_refused(body):
    with pytest.raises(RefusedError, match="this is no photograph") as caught:
        check_response(DISPLAY, body)
    assert caught.value.status == 400


def test_tracked_monitors_have_no_pattern():
    monitor = load_display("spatiallabs")
    for ask in (lambda: pattern_response(monitor), lambda: check_response(monitor, b"{}")):
        with pytest.raises(RefusedError, match="there is no pattern for this display") as caught:
            ask()
        assert caught.value.status == 404
