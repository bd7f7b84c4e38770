"""What the calibration's server takes and writes, and that it writes nothing else."""

from __future__ import annotations

import json
import math
from contextlib import suppress
from http import HTTPStatus
from http.client import HTTPMessage

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lippmann.display import load_display
from lippmann.display.formats.monitor import Monitor
from lippmann.errors import LippmannError, OutputError
from lippmann.viewer.calibrate.site import CalibrationSite
from lippmann.viewer.responses import RefusedError, Request

TURNED = {"pitch": 45.7, "slope": -5.5, "center": 0.25, "order": None}


class Desk:
    """A site, what it said, and the file that it may write."""

    def __init__(self, monitor, folder):
        self.output = folder / "mine.toml"
        self.saved = []
        self.site = CalibrationSite(monitor, self.output, self.saved.append)
        self.start = json.loads(self.get("/calibration.json").body)

    def get(self, path):
        return self.site.get(Request(path, HTTPMessage()))

    def post(self, values, path="/display", token=None):
        headers = HTTPMessage()
        headers["X-Lippmann-Token"] = self.start["token"] if token is None else token
        body = values if isinstance(values, bytes) else json.dumps(values).encode()
        return self.site.post(Request(path, headers), body)


@pytest.fixture
def desk(slanted, tmp_path):
    return Desk(slanted, tmp_path)


def test_page_starts_from_the_monitor(monitor, tmp_path):
    start = Desk(monitor, tmp_path).start
    assert start["panel"]["width"] == monitor.panel.width
    assert start["monitor"]["pitch"] == monitor.pitch
    assert start["monitor"]["lean"] == (0 if math.isinf(monitor.slope) else 1 / monitor.slope)
    assert start["monitor"]["center"] == pytest.approx(monitor.center)
    assert start["output"] == "mine.toml"
    cells = monitor.panel.subpixel_cells
    assert len(start["panel"]["cells"]) == (3 if cells else 1)
    assert bool(start["orders"]) == (cells is None)


def test_what_the_page_is_made_of(desk):
    kinds = {"/": "text/html", "/assets/page.js": "text/javascript", "/assets/page.css": "text/css"}
    for path, kind in kinds.items():
        assert desk.get(path).kind.startswith(kind)


@pytest.mark.parametrize(
    "path", ["/assets/page.html", "/assets/", "/assets/../site.py", "/mine.toml", "/display", "//"]
)
def test_nothing_else_is_served(desk, path):
    desk.post(TURNED)
    with pytest.raises(RefusedError) as caught:
        desk.get(path)
    assert caught.value.status == HTTPStatus.NOT_FOUND


def test_saved_file_is_the_turned_display(desk, slanted):
    assert json.loads(desk.post(TURNED).body) == {"saved": str(desk.output)}
    found = Monitor.of_display(load_display(desk.output))
    assert found.name == "mine"
    assert (found.pitch, found.slope, found.center) == pytest.approx((45.7, -5.5, 0.25), rel=1e-9)
    assert found.panel == slanted.panel
    assert found.view_cone == pytest.approx(slanted.view_cone)
    assert [item.pitch for item in desk.saved] == [45.7]


def test_upright_lenses_have_no_slope(desk):
    desk.post(TURNED | {"slope": None})
    assert load_display(desk.output).lens_array.slant == 0


def test_cells_stay_as_they_are(monitor, tmp_path):
    desk = Desk(monitor, tmp_path)
    desk.post(TURNED)
    assert load_display(desk.output).panel.subpixel_cells == monitor.panel.subpixel_cells


def test_order_of_sub_pixels(desk):
    assert desk.start["order"] == "rgb"
    desk.post(TURNED | {"order": "bgr"})
    assert load_display(desk.output).panel.subpixel_offsets[0] == (1 / 3, 0.0)


def test_measured_places_can_be_kept(slanted, tmp_path):
    from dataclasses import replace

    offsets = ((-0.3, 0.1), (0.0, 0.0), (0.31, 0.0))
    desk = Desk(replace(slanted, panel=replace(slanted.panel, subpixel_offsets=offsets)), tmp_path)
    assert desk.start["order"] == "as they are"
    desk.post(TURNED | {"order": "as they are"})
    assert load_display(desk.output).panel.subpixel_offsets == offsets


@pytest.mark.parametrize("token", ["", "x", "ü", "None"])
def test_only_the_page_itself_can_save(desk, token):
    with pytest.raises(RefusedError) as caught:
        desk.post(TURNED, token=token)
    assert caught.value.status == HTTPStatus.FORBIDDEN
    assert not desk.output.exists()


def test_every_server_has_a_token_of_its_own(desk, slanted, tmp_path):
    assert Desk(slanted, tmp_path).start["token"] != desk.start["token"]


@pytest.mark.parametrize("path", ["/", "/display/", "/mine.toml", "/assets/page.js", "/display?x=../other.toml"])
def test_nothing_else_can_be_written(desk, path):
    with pytest.raises(RefusedError):
        desk.post(TURNED, path=path)
    assert not desk.output.exists()


@pytest.mark.parametrize(
    "change",
    [
        {"pitch": 0},
        {"pitch": -45.7},
        {"pitch": "45"},
        {"pitch": None},
        {"pitch": True},
        {"pitch": float("nan")},
        {"pitch": float("inf")},
        {"pitch": 900},
        {"pitch": 10**400},
        {"slope": 0},
        {"slope": 0.01},
        {"slope": [1]},
        {"center": None},
        {"center": float("inf")},
        {"order": "rgx"},
        {"order": "../../x"},
        {"order": 7},
        {"output": "other.toml"},
        {"name": "x"},
    ],
    ids=str,
)
def test_impossible_values_are_refused_and_the_file_stays(desk, change):
    desk.output.write_text("older")
    with pytest.raises(LippmannError):
        desk.post(TURNED | change)
    assert desk.output.read_text() == "older"
    assert desk.saved == []


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b"null", b"\xff\xfe", b"[" * 50_000, b'{"pitch": 45}'])
def test_what_is_no_calibration_is_refused(desk, body):
    with pytest.raises(LippmannError, match="this is no calibration"):
        desk.post(body)
    assert not desk.output.exists()


VALUES = (
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.lists(st.floats(), max_size=2)
)


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(sent=st.fixed_dictionaries(dict.fromkeys(TURNED, VALUES)) | st.dictionaries(st.sampled_from([*TURNED]), VALUES))
def test_whatever_is_sent_gives_a_display_or_a_refusal(desk, sent):
    desk.output.unlink(missing_ok=True)
    with suppress(LippmannError):
        desk.post(sent)
        load_display(desk.output)
        return
    assert not desk.output.exists()


def test_a_place_that_cannot_be_written_is_said(slanted, tmp_path):
    folder = tmp_path / "gone"
    folder.mkdir()
    desk = Desk(slanted, folder)
    folder.rmdir()
    with pytest.raises(OutputError, match=r"mine\.toml"):
        desk.post(TURNED)
