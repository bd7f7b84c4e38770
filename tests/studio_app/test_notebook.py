"""The studio in a notebook: what Jupyter gets, who may frame it, and its end."""

from __future__ import annotations

import contextlib
import http.client
import http.server
import json
import re
import subprocess
import sys
import threading
import urllib.request
from urllib.parse import urlsplit

import pytest
from stand_in import TINY, said, view
from websockets.sync.client import connect

import lippmann
from lippmann.errors import LippmannError
from lippmann.studio_app.page_values import values_of_state
from lippmann.studio_app.state import StudioState

LIVE = "window.lippmann?.studio?.stage?.header?.number ?? 0"


@contextlib.contextmanager
def page_of(studio):
    """The WebSocket of a page of the studio."""
    address = urlsplit(studio.address)
    with connect(f"ws://{address.netloc}{address.path}live", origin=f"http://{address.netloc}") as socket:
        yield socket


def headers_of(studio):
    with urllib.request.urlopen(studio.address) as answer:
        return answer.headers


@pytest.fixture(scope="module")
def studio(engine):
    with lippmann.studio("teapot", TINY, turn=(30, 0, 0), height=500) as made:
        yield made


def test_jupyter_gets_an_iframe(studio):
    bundle = studio._repr_mimebundle_()
    assert f'<iframe src="{studio.address}"' in bundle["text/html"]
    assert 'height="500"' in bundle["text/html"]
    assert studio.address in bundle["text/plain"]


@pytest.mark.long
def test_only_pages_of_this_machine_may_frame_it(studio):
    headers = headers_of(studio)
    assert "X-Frame-Options" not in headers
    found = re.findall(r"frame-ancestors ([^;]*)", headers["Content-Security-Policy"])
    assert found == ["http://localhost:* http://127.0.0.1:* https://localhost:* https://127.0.0.1:*"]
    with lippmann.studio("teapot", TINY, framed_by=["https://hub.example:8000"]) as other:
        assert other.address != studio.address
        assert headers_of(other)["Content-Security-Policy"].endswith(" https://hub.example:8000; media-src 'self'")


def test_the_state_follows_the_page(studio):
    assert studio.state.turn == (30.0, 0.0, 0.0)
    with page_of(studio) as socket:
        assert said(socket, "hello")["state"]["turn"] == [30.0, 0.0, 0.0]
        socket.send(view(values_of_state(StudioState(display=TINY, scale=1.5))))
        assert "--scale 1.5" in said(socket, "facts", 60)["command"]
    assert studio.state == StudioState(display=TINY, scale=1.5)


@pytest.mark.long
def test_renders_take_turns_with_the_studio(studio):
    """A live picture gathers light all the while, and goes on afterwards."""
    state = values_of_state(StudioState(display=TINY))
    with page_of(studio) as socket:
        socket.send(view(state, 7, size=[200, 150]))
        said(socket, "frame", 60)
        pictures = []

        def render():
            pictures.append(lippmann.render("teapot", TINY, spp=1, denoise="none").pixels)

        thread = threading.Thread(target=render, daemon=True)
        thread.start()
        thread.join(90)
        assert len(pictures) == 1
        socket.send(view(state | {"turn": [50, 0, 0]}, 8))
        number = 0
        while number != 8:
            socket.send(json.dumps({"type": "shown", "frame": 1000}))
            number = int.from_bytes(said(socket, "frame", 60)[8:12], "little")


@pytest.mark.long
def test_a_scene_without_a_file_is_shown_but_not_rendered_from_the_page(engine):
    scene = lippmann.load_scene("teapot", light=lippmann.LightOptions(light_turn=(20.0, 0.0)))
    with lippmann.studio(scene, TINY) as studio, page_of(studio) as socket:
        assert studio.state.light_turn == (20.0, 0.0)
        state = said(socket, "hello")["state"]
        socket.send(view(state | {"background": [0, 0, 1]}))
        assert said(socket, "facts", 60)["command"].startswith("# This scene has no file: call lippmann.render")
        said(socket, "frame", 60)
        for message in ({"type": "render", "kind": "picture"}, {"type": "save"}):
            socket.send(json.dumps(message | {"state": state}))
            line = said(socket, "error")["line"]
            assert "needs a scene that is a file" in line
            assert "\n" not in line


@pytest.mark.slow
def test_a_closed_studio_is_gone(tmp_path, engine):
    studio = lippmann.studio("teapot", TINY, folder=tmp_path)
    address, thread = urlsplit(studio.address), studio._session.thread._thread
    studio.close()
    studio.close()
    assert not studio.is_open
    assert not thread.is_alive()
    assert studio._repr_mimebundle_() == {"text/plain": "<Lippmann Studio: closed>"}
    with pytest.raises(ConnectionRefusedError):
        http.client.HTTPConnection(address.netloc, timeout=5).request("GET", address.path)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"scene": "no-such"}, "unknown bundled scene or file"),
        ({"display": "no-such"}, "no-such"),
        ({"display": 3}, "must be a text or a path"),
        ({"height": 10}, "200 to 4000"),
        ({"port": 99999}, "port"),
        ({"framed_by": "https://hub.example"}, "say ['https://hub.example']"),
        ({"framed_by": ["*"]}, "no origin"),
        ({"framed_by": ["https://a.example; script-src *"]}, "no origin"),
        ({"folder": "no/such/folder"}, "folder"),
        ({"colour": 1}, "unknown setting 'colour'"),
        ({"turn": "left"}, "turn"),
    ],
)
def test_what_will_not_do_is_one_line(arguments, words):
    with pytest.raises(LippmannError) as caught:
        lippmann.studio(**{"display": TINY, **arguments})
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.long
def test_the_interpreter_ends_with_an_open_studio():
    """Also in the middle of rendering, once the engine is loaded."""
    code = f"""
import lippmann, time
studio = lippmann.studio("teapot", {TINY!r})
until = time.monotonic() + 60
while studio._session.thread._renderer is None and time.monotonic() < until:
    time.sleep(0.05)
print(studio.address)
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.startswith("http://127.0.0.1:")


class _Notebook(http.server.BaseHTTPRequestHandler):
    """A page at another origin that shows the output of a cell."""

    output = ""

    def do_GET(self):
        body = f"<!doctype html><title>Notebook</title><link rel=icon href=data:,>{self.output}".encode()
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):
        pass


@pytest.mark.long
def test_a_cell_shows_live_frames(studio, open_tab):
    handler = type("Notebook", (_Notebook,), {"output": studio._repr_mimebundle_()["text/html"]})
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        tab = open_tab(size=(1024, 600)).open(f"http://localhost:{server.server_port}/")
        frame = tab.wait_until(lambda: next((f for f in tab.page.frames if f.url == studio.address), None))
        tab.wait_until(lambda: frame.evaluate(LIVE) > 0)
        assert frame.evaluate("document.querySelector('canvas').width") > 100
        tab.assert_clean()
        server.shutdown()
