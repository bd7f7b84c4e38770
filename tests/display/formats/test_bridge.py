"""Looking Glass Bridge, by a stand-in that answers as its maker's package expects."""

from __future__ import annotations

import socket

import pytest

from lippmann.display import load_display
from lippmann.display.formats import bridge
from lippmann.errors import DisplayError


def test_the_only_panel_is_the_display(fake_bridge):
    display = load_display("bridge")
    assert (display.name, display.panel.width, display.panel.height) == ("LKG-P00001", 150, 200)
    assert display == load_display("bridge:LKG-P00001")
    asked = [
        ("enter_orchestration", {"name": "default"}),
        ("available_output_devices", {"orchestration": fake_bridge.token}),
    ]
    assert fake_bridge.asked[:2] == asked


def test_one_of_several_panels(fake_bridge):
    fake_bridge.connect("LKG-E00002", (3456, 0), (140, 250))
    fake_bridge.connect("another maker's", (0, 0))
    assert load_display("bridge:LKG-E00002").panel.width == 140
    with pytest.raises(DisplayError, match="2 panels; say which: bridge:LKG-P00001, bridge:LKG-E00002"):
        load_display("bridge")
    with pytest.raises(DisplayError, match="unknown panel of Bridge 'LKG-E00003', did you mean 'LKG-E00002'"):
        load_display("bridge:LKG-E00003")
    panels = bridge.panels_or_none()
    assert bridge.corner_of_screen(panels, 140, 250) == (3456, 0)
    assert bridge.corner_of_screen(panels, 140, 251) is None


@pytest.mark.parametrize(
    ("raw", "said"),
    [
        (b"<html>", "the answer is no JSON"),
        (b"[1]", "the answer is no object"),
        (b"{}", "payload is None"),
        (b'{"payload": {"value": 3}}', "payload is 3"),
    ],
)
def test_other_answers(fake_bridge, raw, said):
    fake_bridge.raw = raw
    with pytest.raises(DisplayError, match=said) as caught:
        load_display("bridge")
    assert "\n" not in str(caught.value)
    assert bridge.panels_or_none() == []


def test_no_panel(fake_bridge):
    fake_bridge.devices = []
    with pytest.raises(DisplayError, match="Looking Glass Bridge finds no panel; connect one"):
        load_display("bridge")


def test_a_broken_calibration(fake_bridge):
    fake_bridge.devices[0]["calibration"]["value"] = "{}"
    with pytest.raises(DisplayError, match="Bridge's LKG-P00001"):
        load_display("bridge")


def refusal():
    with pytest.raises(DisplayError) as caught:
        load_display("bridge")
    assert "start Bridge, or give the panel's visual.json" in str(caught.value)
    assert "\n" not in str(caught.value)
    return caught.value.what


def test_nothing_waits_where_bridge_does_not_run(monkeypatch):
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    monkeypatch.setattr(bridge, "PORT", port)
    assert "refused" in refusal()
    assert bridge.panels_or_none() == []


def test_nobody_waits_for_a_bridge_that_hangs(monkeypatch):
    assert bridge.PATIENCE < 0.3
    with socket.socket() as silent:
        silent.bind(("localhost", 0))
        silent.listen()
        monkeypatch.setattr(bridge, "PORT", silent.getsockname()[1])
        monkeypatch.setattr(bridge, "PATIENCE", 0.01)
        assert "timed out" in refusal()
