"""The studio's server: who gets in, what they get, and what is refused."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import http.client
import io
import json
import shlex
import signal
import socket as socketlib
import struct
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image
from stand_in import FOLDER, TINY, StandIn, placement, running, said, view
from starlette.websockets import WebSocketDisconnect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from lippmann.errors import SceneError
from lippmann.scene.readers.load import load_scene
from lippmann.studio_app import live_socket, uploads
from lippmann.studio_app import site as studio_site
from lippmann.studio_app.live_socket import LiveSocket
from lippmann.studio_app.page_values import state_of_values, values_of_state
from lippmann.studio_app.pages import static_files
from lippmann.studio_app.render_jobs import command_of
from lippmann.studio_app.session import StudioSession
from lippmann.studio_app.state import FILES, StudioState
from lippmann.studio_app.state_toml import state_of_text

STATE = values_of_state(StudioState(display=TINY))


def ask(studio, path, method="GET", body=None, **headers):
    """Status, headers and body of one request, whose path is sent just as it is said."""
    with closing(http.client.HTTPConnection("127.0.0.1", studio.server.port, timeout=10)) as connection:
        named = {name.replace("_", "-"): value for name, value in headers.items()}
        connection.request(method, path, body, named)
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read()


def test_pages_and_their_files(studio):
    for name, found in static_files().items():
        status, headers, body = ask(studio, f"/{FOLDER}/{name}")
        assert (status, body) == (200, found.body), name
        assert headers["Content-Type"] == found.kind
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        assert "unsafe" not in headers["Content-Security-Policy"]
        assert headers["Cache-Control"] == "no-store"
    size = json.loads(ask(studio, f"/{FOLDER}/panel.json")[2])
    display = StudioState(display=TINY).load_display()
    assert (size["width"], size["height"]) == (display.panel.width, display.panel.height)


@pytest.mark.parametrize("folder", ["", "secre", "secrett", "SECRET", "secre%74", "%73ecret", "x" * 32])
def test_without_the_token_there_is_nothing(studio, folder):
    for path in ("", "panel", "panel.json", "assets/app.js", "live"):
        assert ask(studio, f"/{folder}/{path}")[0] == 404
    assert ask(studio, "/")[0] == 404
    assert ask(studio, f"/{FOLDER}")[0] == 404


@pytest.mark.parametrize("path", ["../live", "%2e%2e/live", "wrong/live"])
def test_no_socket_without_the_token(studio, path):
    with pytest.raises(InvalidStatus) as caught:
        studio.connect(path)
    assert caught.value.response.status_code == 404


@pytest.mark.parametrize(
    ("options", "status"),
    [
        ({"origin": "http://evil.example"}, 403),
        ({"origin": "null"}, 403),
        ({"origin": "http://127.0.0.1:1"}, 403),
        ({"origin": None}, 403),
    ],
)
def test_no_socket_for_other_pages(studio, options, status):
    with pytest.raises(InvalidStatus) as caught:
        studio.connect(**options)
    assert caught.value.response.status_code == status
    assert "error" in json.loads(caught.value.response.body)


def test_no_socket_for_other_hosts(studio):
    status, _, body = ask(
        studio,
        f"/{FOLDER}/live",
        Host="evil.example",
        Origin="http://evil.example",
        Connection="Upgrade",
        Upgrade="websocket",
        Sec_WebSocket_Version="13",
        Sec_WebSocket_Key="dGhlIHNhbXBsZSBub25jZQ==",
    )
    assert status == 403
    assert b"not served" in body


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("POST", "panel.json"),
        ("GET", "files/a.glb"),
        ("POST", "results/1/a.png"),
        ("POST", ""),
        ("DELETE", "a"),
    ],
)
def test_other_methods_are_one_line_of_json(studio, method, path):
    status, headers, body = ask(studio, f"/{FOLDER}/{path}", method)
    assert (status, headers["Content-Type"]) == (405, "application/json")
    assert list(json.loads(body)) == ["error"]


UP = ("..", "%2e%2e", ".%2e", "%252e%252e", "..%00", "..%c0%af", "..;", "\\..", "%5c..")


@pytest.mark.parametrize("base", ["", "assets/", "viewer/", "results/1/", "pictures/1/", "files/"])
def test_files_outside_are_never_served(studio, tmp_path, base):
    secret = tmp_path / "secret.txt"
    secret.write_bytes(b"not for the page")
    tried = [f"{base}{quote(str(secret), safe='')}", f"{base}/{secret}", f"{base}file://{secret}"]
    tried += [base + (up + slash) * 12 + str(secret)[1:] for up in UP for slash in ("/", "%2f", "\\")]
    for path in tried:
        status, _, body = ask(studio, f"/{FOLDER}/{path}")
        assert status in (400, 404, 405), path
        assert b"not for the page" not in body


def test_frames_come_with_what_is_said_of_them(studio):
    with studio.connect() as socket:
        hello = said(socket, "hello")
        assert hello["state"] == STATE
        assert ["looking-glass-portrait" in json.dumps(hello["displays"])] == [True]
        socket.send(view(STATE | {"turn": [40, 0, 0]}, 5))
        facts = said(socket, "facts")
        assert "--turn 40,0,0" in facts["command"]
        frame = said(socket, "frame")
        assert int.from_bytes(frame[8:12], "little") == 5
        assert (int.from_bytes(frame[12:14], "little"), int.from_bytes(frame[14:16], "little")) == (40, 30)
    assert studio.session.state.turn == (40.0, 0.0, 0.0)


def test_facts_are_those_of_the_last_frame_though_an_older_one_came_late(tmp_path):
    begun, may_go = threading.Event(), threading.Event()

    class Slow(StandIn):
        def frame(self, view):
            begun.set()
            assert may_go.wait(60.0)
            return replace(super().frame(view), placement=placement(10.0 + view.request.placement.turn[0]))

    with running(tmp_path, make=Slow) as studio, studio.connect() as socket:
        socket.send(view(STATE, 1))
        assert begun.wait(60.0)
        socket.send(view(STATE | {"turn": [40, 0, 0]}, 2))
        until = time.monotonic() + 60.0
        while studio.session.state.turn[0] != 40.0:
            assert time.monotonic() < until
            time.sleep(0.005)
        may_go.set()
        depths = []
        while not depths or depths[-1] != -50.0:
            facts = said(socket, "facts")
            assert "--turn 40,0,0" in facts["command"]
            depths.append(facts["depth"]["scene"][0])
        assert depths in ([-10.0, -50.0], [-50.0])


def test_no_frame_is_sent_before_others_were_shown(studio):
    with studio.connect() as socket:
        for number in range(1, 30):
            socket.send(view(STATE | {"turn": [number, 0, 0]}, number))
            time.sleep(0.01)
        for _ in range(2):
            said(socket, "frame")
        with pytest.raises(TimeoutError):
            said(socket, "frame", 0.4)
        socket.send(json.dumps({"type": "shown", "frame": 2}))
        newest = said(socket, "frame")
        assert int.from_bytes(newest[8:12], "little") == 29


def test_facts_that_are_not_finite_leave_a_page_alive(tmp_path):
    class Black(StandIn):
        def frame(self, view, is_stale=None):
            return replace(super().frame(view), exposure=float("-inf"), placement=placement(float("nan")))

    with running(tmp_path, make=Black) as studio, studio.connect() as socket:
        for number in (1, 2):
            socket.send(view(STATE | {"turn": [number, 0, 0]}, number))
            assert said(socket, "facts")["exposure"] is None
            said(socket, "frame")


def test_a_page_that_is_closed_while_a_frame_is_sent_is_no_error(studio):
    class Leaving:
        """A socket whose page leaves while something is sent: what is sent then fails, also where it is cancelled."""

        sends = asyncio.Event()

        async def receive(self):
            await self.sends.wait()
            return {"type": "websocket.disconnect", "code": 1001}

        async def send_text(self, text):
            self.sends.set()
            try:
                await asyncio.sleep(60)
            except asyncio.CancelledError:
                raise WebSocketDisconnect(1006) from None

    async def serve():
        told = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(context["message"]))
        await LiveSocket(studio.session, Leaving(), "rgb").run()
        gc.collect()
        await asyncio.sleep(0)
        return told

    with ThreadPoolExecutor(1) as thread:  # a browser that other tests keep open has a loop in this one
        assert thread.submit(lambda: asyncio.run(serve())).result() == []


def test_a_fault_in_what_is_sent_ends_the_connection_and_is_one_line(tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(live_socket, "encode_frame", lambda *_: 1 / 0)
    with running(tmp_path) as studio, studio.connect() as socket:
        socket.send(view(STATE))
        with pytest.raises(ConnectionClosed):
            said(socket, "frame")
    assert capfd.readouterr().err.count("\n") == 1


def test_native_pixels_are_those_of_the_panel(studio):
    panel = StudioState(display=TINY).load_display().panel
    with studio.connect() as socket:
        socket.send(view(STATE, 1, eye=None, window=[panel.width - 4, -3, 1000, 7]))
        frame = said(socket, "frame")
        assert (int.from_bytes(frame[12:14], "little"), int.from_bytes(frame[14:16], "little")) == (4, 7)


def test_the_window_on_the_panel_follows_and_sets_nothing(studio):
    panel = StudioState(display=TINY).load_display().panel
    with studio.connect() as page, studio.connect("live-panel") as window:
        frame = said(window, "frame")
        assert int.from_bytes(frame[12:14], "little") == panel.width
        page.send(view(STATE | {"turn": [77, 0, 0]}))
        said(page, "frame")
        window.send(json.dumps({"type": "shown", "frame": 1}))
        assert said(window, "frame")
        window.send(view(STATE))
        assert "unknown message" in said(window, "error")["line"]


def test_picked_depth_and_saved_states(studio):
    with studio.connect() as socket:
        socket.send(view(STATE | {"scale": 2}))
        said(socket, "frame")
        socket.send(json.dumps({"type": "pick", "place": [0.9, 0.5]}))
        assert said(socket, "picked")["depth"] == 3.0
        socket.send(json.dumps({"type": "save", "state": STATE | {"scale": 2}}))
        saved = said(socket, "saved")
        assert saved["name"] == "teapot.toml"
        assert "scale = 2.0" in saved["text"]
        socket.send(json.dumps({"type": "open", "text": saved["text"].replace("2.0", "3.0")}))
        assert said(socket, "state")["state"]["scale"] == 3.0


@pytest.mark.parametrize("name", FILES)
def test_states_open_no_files_that_were_not_given(studio, tmp_path, name):
    file = tmp_path / {"scene": "a.glb", "display": "a.toml"}.get(name, "a.exr")
    file.write_bytes(b"x")
    with studio.connect() as socket:
        socket.send(view(STATE | {name: str(file)}))
        line = said(socket, "error")["line"]
        assert "was not opened" in line
        assert str(tmp_path) not in line
        socket.send(json.dumps({"type": "open", "text": f"{name} = {json.dumps(str(file))}\n"}))
        assert "was not opened" in said(socket, "error")["line"]


def post(studio, name, body=b"data", kind="application/octet-stream", **headers):
    own = f"http://127.0.0.1:{studio.server.port}"
    return ask(studio, f"/{FOLDER}/files/{name}", "POST", body, Content_Type=kind, **({"Origin": own} | headers))


WEDGE = b"v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n"


def kept(studio):
    """The files that are kept of what was dropped, and the bytes that count."""
    folder = studio.outputs.parent / "uploads"
    return sorted(path.name for path in folder.rglob("*") if path.is_file()), studio.session.uploads._bytes


def several(studio, files):
    """Drop several files at once: names and contents."""
    head = json.dumps([[name, len(body)] for name, body in files.items()]).encode() + b"\n"
    status, _, body = ask(
        studio,
        f"/{FOLDER}/files",
        "POST",
        head + b"".join(files.values()),
        Content_Type="application/octet-stream",
        Origin=f"http://127.0.0.1:{studio.server.port}",
    )
    return status, json.loads(body)


@pytest.mark.parametrize(
    "name",
    [
        "my model.obj",
        "Anna's [new] model, 2nd try (final) #3 & more!.obj",
        "100% wool %41.obj",
        "модель.obj",
        "می‌خواهم.obj",  # with a zero-width non-joiner
        "模型" * 120 + ".obj",
        "-o.obj",
    ],
)
def test_a_dropped_model_can_be_used_by_its_name(tmp_path, name):
    with running(tmp_path) as studio:
        status, _, body = post(studio, quote(name, safe=""), WEDGE)
        changes = json.loads(body)["changes"]
        assert status == 200
        with studio.connect() as socket:
            socket.send(view(STATE | changes))
            facts = said(socket, "facts")
            assert facts["title"] == name
            words = shlex.split(facts["command"])
            assert Path(words[2]).read_bytes() == WEDGE
            if len(name) < 100:
                assert Path(words[2]).name == name
            socket.send(json.dumps({"type": "save", "state": STATE | changes}))
            saved = said(socket, "saved")
            assert saved["name"] == f"{name[:-4]}.toml"
    # After the studio's end the state and the command find the model, and a later studio may open it.
    assert load_scene(state_of_text(saved["text"]).scene).name
    with running(tmp_path) as studio, studio.connect() as socket:
        socket.send(json.dumps({"type": "open", "text": saved["text"]}))
        assert said(socket, "state")["state"]["scene"] == changes["scene"]


def test_another_model_is_placed_as_if_it_were_the_first(tmp_path):
    with running(tmp_path, StudioState(display=TINY, turn=(30, 0, 0), camera="lens", up="z", seed=7)) as studio:
        changes = json.loads(post(studio, "a.obj", WEDGE)[2])["changes"]
        assert {"turn", "camera", "up", "shift", "scale"} <= changes.keys()
        assert state_of_values({"turn": [9, 9, 9]} | changes) == StudioState(scene=changes["scene"])
        assert studio.session.state.turn == (30, 0, 0)  # it is the page that sets them, as a step of undo


@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("bad.glb", b"no model"),
        ("bad.obj", b"v 0 0\n"),
        ("bad.ply", b"ply\nformat ascii 1.0\n"),
        ("empty.stl", b""),
        ("bad.exr", b"x"),
        ("bad.hdr", b"#?RADIANCE\n"),
        ("photo.png", b"\x89PNG"),
        ("slice", b"x" * 200),
        ("a.exe", b"x"),
        ("model.fbx", b"x"),
    ],
)
def test_a_file_that_cannot_be_opened_changes_nothing(studio, name, body):
    before = kept(studio)
    status, _, answer = post(studio, name, body)
    assert status in (200, 415), answer
    line = json.loads(answer)["error"]
    assert name in line
    assert "\n" not in line
    assert kept(studio) == before
    with studio.connect() as socket:
        assert said(socket, "hello")["state"]["scene"] == "teapot"
        socket.send(view(STATE))
        assert said(socket, "facts")["title"] == "teapot"


def test_a_scene_that_the_renderer_refuses_changes_nothing(tmp_path):
    class Strict(StandIn):
        def set_scene(self, scene):
            raise SceneError("no light is seen", where=scene.name)

    with running(tmp_path, make=Strict) as studio:
        with studio.connect() as socket:
            socket.send(view(STATE))
            said(socket, "frame")
        status, _, body = post(studio, "a.obj", WEDGE)
        assert (status, "no light is seen" in json.loads(body)["error"]) == (200, True)
        assert kept(studio) == ([], 0)


def test_a_state_that_cannot_be_shown_changes_nothing(tmp_path):
    class Strict(StandIn):
        def frame(self, view, is_stale=None):
            if view.request.placement.camera == "gone":
                raise SceneError("no camera is called 'gone'")
            return super().frame(view)

    with running(tmp_path, make=Strict) as studio, studio.connect() as socket:
        socket.send(view(STATE))
        said(socket, "frame")
        socket.send(json.dumps({"type": "open", "text": 'camera = "gone"\n'}))
        assert "gone" in said(socket, "error")["line"]
        assert studio.session.state.camera is None
        socket.send(json.dumps({"type": "open", "text": f"scale = 2.0\ndisplay = {json.dumps(TINY)}\n"}))
        assert said(socket, "state")["state"]["scale"] == 2.0


def test_the_command_line_may_read_what_the_studio_may(tmp_path):
    state = StudioState(display=TINY)
    for allowed in (False, True):
        session = StudioSession(state, uploads=None, outputs=tmp_path, make_renderer=StandIn, allow_outside=allowed)
        assert ("--allow-outside" in session.command(state)) == allowed
        session.close()


def test_of_an_eye_tracked_monitor_commands_make_stereo_pairs(tmp_path, monkeypatch):
    """They were those of native pixels, which such monitors do not take."""
    state = StudioState(display="odyssey-3d", subpixels=True)
    session = StudioSession(state, uploads=None, outputs=tmp_path, make_renderer=StandIn)
    begun = []
    monkeypatch.setattr(session.jobs, "start", lambda *given: begun.append(given))
    words = session.command(state)
    assert words[:6] == ["lippmann", "quilt", "render", "teapot", "--display", "odyssey-3d"]
    assert "--subpixels" not in words
    for kind in ("picture", "quilt", "turntable"):
        session.render(kind, state)
    assert [(kind, ending) for kind, _, _, ending in begun] == [
        ("quilt", "_half_2x1.png"),
        ("quilt", "_half_2x1.png"),
        ("turntable", "_half_2x1.mp4"),
    ]
    film = command_of("turntable", words, tmp_path / "turn_half_2x1.mp4")
    assert film[:3] == ("lippmann", "quilt", "render")
    assert film.count("render") == 1
    session.close()


def test_what_is_dropped_twice_is_kept_once(tmp_path):
    with running(tmp_path) as studio:
        paths = {json.loads(post(studio, "a.obj", WEDGE)[2])["path"] for _ in range(2)}
        assert len(paths) == 1
        assert kept(studio)[0] == ["a.obj"]


def test_a_part_of_a_broken_drop_is_removed_and_its_bytes_given_back(tmp_path):
    with running(tmp_path) as studio:
        head = f"POST /{FOLDER}/files/a.obj HTTP/1.1\r\nHost: 127.0.0.1:{studio.server.port}\r\n"
        head += "Content-Type: application/octet-stream\r\nContent-Length: 1000000\r\n\r\n"
        with socketlib.create_connection(("127.0.0.1", studio.server.port)) as client:
            client.sendall(head.encode() + b"v 0 0 0\n" * 1000)
            wait_until(lambda: kept(studio)[1] == 1000000 and kept(studio)[0])
        wait_until(lambda: kept(studio) == ([], 0))
        assert [path.name for path in (tmp_path / "uploads").iterdir()] == []


def wait_until(holds):
    until = time.monotonic() + 60.0
    while not holds():
        assert time.monotonic() < until
        time.sleep(0.01)


GLTF = json.dumps(
    {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"uri": "data/my%20triangle.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0] * 3, "max": [1] * 3}
        ],
    }
).encode()
TRIANGLE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 1)


def test_a_model_is_dropped_with_the_files_that_it_names(tmp_path):
    with running(tmp_path) as studio:
        long = bytes(range(256)) * 1200  # comes in many pieces
        files = {"a/preview.png": long, "a/data/my triangle.bin": TRIANGLE, "a/scene.gltf": GLTF, "a/notes": long[7:]}
        status, answer = several(studio, files)
        assert (status, Path(answer["path"]).name) == (200, "scene.gltf")
        assert {name: (Path(answer["path"]).parents[1] / name).read_bytes() for name in files} == files
        assert len(load_scene(answer["path"]).description.meshes) == 1
        before = kept(studio)
        del files["a/data/my triangle.bin"]
        status, answer = several(studio, files)
        assert list(answer) == ["error"]
        assert "my triangle.bin" in answer["error"]
        assert kept(studio) == before


def test_a_photograph_is_dropped_with_its_depth_map(tmp_path):
    def png(pixels):
        held = io.BytesIO()
        Image.fromarray(pixels).save(held, "PNG")
        return held.getvalue()

    photo, depth = png(np.zeros((20, 30, 3), np.uint8)), png(np.tile(np.arange(30, dtype=np.uint8), (20, 1)))
    volume = io.BytesIO()
    np.save(volume, np.tile(np.arange(1.0, 31.0), (20, 1)))
    with running(tmp_path) as studio:
        for name, data in (("my photo_depth.png", depth), ("my photo-depth.npy", volume.getvalue())):
            status, answer = several(studio, {name: data, "my photo.png": photo})
            assert (status, Path(answer["path"]).name) == (200, "my photo.png")
            assert load_scene(answer["path"]).fills_panel
        status, answer = several(studio, {"a.png": photo, "b.png": depth})
        assert "named like it: photo.jpg and photo_depth.png" in answer["error"]
        status, answer = several(studio, {"a.png": photo})
        assert "a_depth.png" in answer["error"]


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b'[["a.obj", 3]]\nabcd', 400),
        (b'[["a.obj", 9]]\nabcd', 400),
        (b'[["a.obj", -1], ["b.obj", 5]]\nabcd', 400),
        (b'[["a.obj", NaN]]\nabcd', 400),
        (b"[]\n", 400),
        (b"[1]\n", 400),
        (b'{"a": 1}\n', 400),
        (b"no list", 400),
        (b"[" * 9000 + b"\n", 400),
        (b'[["../a.obj", 4]]\nabcd', 415),
        (b'[["/a.obj", 4]]\nabcd', 415),
        (b'[["a/./b.obj", 4]]\nabcd', 415),
        (b'[["a\\u0000.obj", 4]]\nabcd', 415),
        (b'[["a.obj", 2], ["a.obj", 2]]\nabcd', 400),
        (b'[["a.obj", 2], ["a.obj/b.obj", 2]]\nabcd', 400),
        (b'[["a.txt", 2], ["b.txt", 2]]\nabcd', 200),
        (b'[["a.obj", 2], ["b.obj", 2]]\nabcd', 200),
    ],
)
def test_lists_of_files_that_will_not_do_leave_nothing(studio, body, status):
    before = kept(studio)
    own = f"http://127.0.0.1:{studio.server.port}"
    kind = "application/octet-stream"
    found, _, answer = ask(studio, f"/{FOLDER}/files", "POST", body, Content_Type=kind, Origin=own)
    assert (found, list(json.loads(answer))) == (status, ["error"])
    assert kept(studio) == before


@pytest.mark.parametrize(
    ("name", "headers", "status"),
    [
        ("a.exe", {}, 415),
        ("a.glb.html", {}, 415),
        ("..%2fa.glb", {}, 404),
        ("..", {}, 415),
        (".glb", {}, 200),
        ("a%00.glb", {}, 415),
        ("a%0a.glb", {}, 415),
        ("a.glb", {"kind": "application/json"}, 415),
        ("a.glb", {"kind": "multipart/form-data"}, 415),
        ("a.glb", {"Origin": "http://evil.example"}, 403),
        ("a.glb", {"Content_Length": "99999999999"}, 413),
    ],
)
def test_other_files_are_refused(studio, name, headers, status):
    assert post(studio, name, **headers)[0] == status


def test_dropped_files_have_a_limit(studio, monkeypatch):
    monkeypatch.setattr(uploads, "MOST_BYTES", 100)
    assert post(studio, "a.glb", b"x" * 101)[0] == 413
    monkeypatch.setattr(uploads, "MOST_BYTES_IN_ALL", 10)
    status, _, body = post(studio, "a.glb", b"x" * 50)
    assert status == 507
    assert b"too many models" in body


@pytest.mark.skipif(not hasattr(signal, "SIGXFSZ"), reason="the system has no limit on the size of files")
def test_a_disk_that_takes_no_more_keeps_nothing_of_a_drop(studio):
    resource = pytest.importorskip("resource")
    before, (_, most) = kept(studio), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, most))
    try:
        status, _, body = post(studio, "a.obj", WEDGE * 1000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
    assert status == 507
    assert json.loads(body)["error"] == (
        "the file cannot be kept: the file would be larger than the system allows here; choose another place"
    )
    assert kept(studio) == before
    assert post(studio, "a.obj", WEDGE)[0] == 200


def test_a_long_message_ends_the_connection(studio):
    with studio.connect() as socket:
        socket.send("x" * 100_000)
        with pytest.raises(ConnectionClosed) as caught:
            said(socket, "frame")
    assert caught.value.rcvd.code == 1009
    assert ask(studio, f"/{FOLDER}/")[0] == 200


MESSAGES = st.sampled_from(["view", "shown", "pick", "render", "open", "resume", "cancel", "x"]).flatmap(
    lambda kind: st.fixed_dictionaries(
        {"type": st.just(kind)},
        optional={
            name: st.none() | st.integers() | st.text(max_size=5) | st.lists(st.floats() | st.integers(), max_size=4)
            for name in ("number", "state", "eye", "size", "window", "place", "frame", "kind", "text")
        },
    ).map(json.dumps)
)


@pytest.mark.slow
@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture]
)
@given(st.lists(MESSAGES | st.text(max_size=20) | st.binary(max_size=20), max_size=6))
def test_any_messages_leave_the_studio_alive(studio, messages):
    with studio.connect() as socket:
        for message in messages:
            socket.send(message)
        socket.send(view(STATE, 77))
        while True:
            if int.from_bytes(said(socket, "frame")[8:12], "little") == 77:
                break


def test_pages_are_counted(studio, monkeypatch):
    monkeypatch.setattr(studio_site, "MOST_PAGES", 2)
    with ExitStack() as stack:
        for _ in range(2):
            stack.enter_context(studio.connect())
        with pytest.raises(InvalidStatus) as caught:
            stack.enter_context(studio.connect())
        assert caught.value.response.status_code == 503

    def answers():
        with contextlib.suppress(InvalidStatus), studio.connect() as again:
            return said(again, "hello")

    wait_until(answers)


def test_pages_end_with_the_studio(tmp_path):
    with ExitStack() as stack:
        with running(tmp_path) as made:
            socket = stack.enter_context(made.connect())
            assert said(socket, "hello")
        with pytest.raises(ConnectionClosed):
            said(socket, "frame")


@pytest.mark.parametrize("path", ["results/1/a.png", "pictures/1/manifest.json", "results/0/x", "results/a/b"])
def test_there_are_no_results_before_a_render(studio, path):
    assert ask(studio, f"/{FOLDER}/{path}")[0] == 404


def test_each_page_has_the_state_that_it_shows(tmp_path, monkeypatch):
    """What a page saves, renders and has to copy is its own, whatever another page of the studio set last."""
    started = []
    with running(tmp_path) as studio, studio.connect() as page, studio.connect() as other:
        monkeypatch.setattr(studio.session.jobs, "start", lambda kind, words, stem, ending=None: started.append(words))
        mine = STATE | {"turn": [30, 0, 0]}
        page.send(view(mine))
        said(page, "frame")
        other.send(view(STATE | {"turn": [60, 0, 0], "scale": 2}))
        said(other, "frame")
        page.send(json.dumps({"type": "save", "state": mine}))
        saved = said(page, "saved")["text"]
        other.send(view(STATE | {"turn": [61, 0, 0], "scale": 2}, 2))
        page.send(json.dumps({"type": "render", "kind": "picture", "state": mine}))
        page.send(json.dumps({"type": "render", "kind": "picture"}))
        assert "state" in said(page, "error")["line"]
    assert "turn = [30.0, 0.0, 0.0]" in saved
    assert "scale" not in saved
    (words,) = started
    assert "30,0,0" in words


def test_a_frame_is_told_of_with_the_state_of_its_own_page(tmp_path):
    begun, may_go = threading.Event(), threading.Event()

    class Slow(StandIn):
        def frame(self, view):
            begun.set()
            assert may_go.wait(60.0)
            return super().frame(view)

    with running(tmp_path, make=Slow) as studio, studio.connect() as page, studio.connect() as other:
        page.send(view(STATE | {"turn": [30, 0, 0]}))
        assert begun.wait(60.0)
        other.send(view(STATE | {"turn": [60, 0, 0]}))
        until = time.monotonic() + 60.0
        while studio.session.state.turn[0] != 60.0:
            assert time.monotonic() < until
            time.sleep(0.005)
        may_go.set()
        assert "--turn 30,0,0" in said(page, "facts")["command"]
        assert "--turn 60,0,0" in said(other, "facts")["command"]


def test_a_page_that_sends_changes_without_end_still_gets_frames(tmp_path, monkeypatch):
    """Changes come faster than they can be taken over: the newest is, frames come, and the last change is shown."""
    taken = []

    def slow(values):
        taken.append(values)
        time.sleep(0.005)
        return state_of_values(values)

    monkeypatch.setattr(live_socket, "state_of_values", slow)
    with running(tmp_path) as studio, studio.connect() as socket:
        sent = frames = 0
        until = time.monotonic() + 30.0
        while frames < 5:
            assert time.monotonic() < until, f"{frames} frames for {sent} changes"
            for _ in range(17):
                sent += 1
                socket.send(view(STATE | {"turn": [sent % 360, 0, 0]}, sent))
            time.sleep(0.01)
            with contextlib.suppress(TimeoutError):
                message = socket.recv(0.001)
                if isinstance(message, bytes):
                    socket.send(json.dumps({"type": "shown", "frame": int.from_bytes(message[4:8], "little")}))
                    frames += 1
        while int.from_bytes(said(socket, "frame")[8:12], "little") != sent:
            socket.send(json.dumps({"type": "shown", "frame": 1000}))
        assert studio.session.state.turn[0] == sent % 360
    assert len(taken) < sent / 2
