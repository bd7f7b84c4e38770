"""``lippmann studio`` and ``lippmann show`` as whole commands."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import urllib.request
from contextlib import contextmanager
from urllib.error import HTTPError

import numpy as np
import pytest
from PIL import Image
from websockets.sync.client import connect

from lippmann.display import Display, LensArray, Panel
from lippmann.image import IntegralImage
from lippmann.studio_app.page_values import values_of_state
from lippmann.studio_app.state import StudioState

DISPLAY = Display("d", Panel(32, 24, 0.1), LensArray("lenticular", 0.4), gap=1.0, viewing_distance=500.0)
OWN_DISPLAY = (
    "gap = 3.0\nviewing_distance = 300\naperture_distance = 20\n[panel]\nwidth = 48\nheight = 32\n"
    'pixel_pitch = 1.0\n[lens_array]\nlayout = "lenticular"\npitch = 4.0\n'
)


@contextmanager
def serving(*words, folder):
    """The command as a process of its own that serves a page; yields it and the address that it printed."""
    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-c", "from lippmann.cli import main; main()", *map(str, words)]
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, **streams, text=True, env=environment, cwd=folder) as process:
        try:
            yield process, process.stdout.readline().split()[-1]
        finally:
            process.kill()


def fetch(address):
    with urllib.request.urlopen(address, timeout=20) as answer:
        return answer.read()


def interrupted(process, number=signal.SIGINT):
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    return process.returncode, err


def until(socket, holds, seconds=120.0):
    """The first message for which ``holds`` is true; frames are acknowledged."""
    while True:
        message = socket.recv(seconds)
        if isinstance(message, bytes):
            socket.send(json.dumps({"type": "shown", "frame": int.from_bytes(message[4:8], "little")}))
        read = message if isinstance(message, bytes) else json.loads(message)
        if holds(read):
            return read


@pytest.mark.slow
def test_studio_shows_and_renders_until_ctrl_c(tmp_path):
    """The real renderer, once: a live frame, a full render of the same state into another folder, and the end."""
    (tmp_path / "own.toml").write_text(OWN_DISPLAY)
    outputs = tmp_path / "outputs"
    outputs.mkdir()
    words = ("studio", "teapot", "--display", "own.toml", "--folder", "outputs")
    with serving(*words, folder=tmp_path) as (process, address):
        assert address.startswith("http://127.0.0.1:")
        assert len(address.rstrip("/").rpartition("/")[2]) == 32
        assert b"Lippmann Studio" in fetch(address)
        with pytest.raises(HTTPError, match="404"):
            fetch(address[: address.index("/", 8)] + "/")
        base = address.removeprefix("http://")
        state = values_of_state(StudioState(scene="teapot", display="own.toml", spp=1, method="full"))
        with connect(f"ws://{base}live", origin=f"http://{base.partition('/')[0]}") as socket:
            view = {"type": "view", "number": 3, "state": state, "eye": [0, 0, 300], "size": [60, 48], "window": None}
            socket.send(json.dumps(view))
            frame = until(socket, lambda m: isinstance(m, bytes) and int.from_bytes(m[8:12], "little") == 3)
            # As bytes: on one machine pictures are not compressed. The teapot is there, and so is its background.
            width, height = (int.from_bytes(frame[at : at + 2], "little") for at in (12, 14))
            pixels = np.frombuffer(frame[24:], np.uint8).reshape(height, width, 3)
            assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 20
            socket.send(json.dumps({"type": "render", "kind": "picture", "state": state}))
            job = until(socket, lambda m: isinstance(m, dict) and m["type"] == "job" and m["phase"] != "running")
        assert (job["phase"], job["line"]) == ("done", str(outputs / job["name"]))
        manifest = json.loads(fetch(f"{address}pictures/1/manifest.json"))
        assert manifest["name"] == job["name"]
        assert fetch(f"{address}results/1/{job['name']}") == (outputs / job["name"]).read_bytes()
        code, err = interrupted(process)
    assert (code, err.strip()) == (130, "Ctrl-C ends it")


@pytest.mark.slow
@pytest.mark.usefixtures("hangup_ends")
@pytest.mark.parametrize("number", [pytest.param(signal.SIGINT, marks=pytest.mark.long), signal.SIGHUP])
def test_show_serves_the_picture_until_it_is_ended(tmp_path, number):
    pixels = np.random.default_rng(1).random((24, 32, 3), dtype=np.float32)
    IntegralImage(pixels, DISPLAY).save(tmp_path / "shot.png")
    with serving("show", "shot.png", folder=tmp_path) as (process, address):
        assert b"panel_window.js" in fetch(address)
        assert json.loads(fetch(f"{address}panel.json")) == {
            "width": 32,
            "height": 24,
            "name": "d",
            "live": None,
            "corner": None,
            "camera": 500.0,
        }
        assert len(fetch(f"{address}pictures/0/tiles/picture/0_0")) == 3 * 32 * 24
        code, err = interrupted(process, number)
    assert (code, err.strip()) == (130, "Ctrl-C ends it")


@pytest.mark.slow
def test_mistakes_are_said_before_a_page_opens(lippmann, tmp_path):
    (tmp_path / "bad.toml").write_text("scale = 'large'\n")
    tried = {
        ("studio", "no-such"): "no-such",
        ("studio", tmp_path / "gone.glb"): "gone.glb",
        ("studio", "--display", "no-such"): "no-such",
        ("studio", "--state", tmp_path / "bad.toml"): "bad.toml",
        ("studio", "--folder", tmp_path / "gone"): "gone",
        ("show", tmp_path / "gone.png"): "gone.png",
    }
    for words, named in tried.items():
        outcome = lippmann(*words, "--no-browser")
        assert outcome.code in (1, 2), outcome
        assert len(outcome.err.strip().splitlines()) == 1
        assert named in outcome.err


def test_a_quilt_goes_through_bridge(lippmann, tmp_path, fake_bridge):
    quilt = tmp_path / "seen_qs4x2a0.75.png"
    Image.fromarray(np.zeros((256, 320, 3), np.uint8)).save(quilt)
    done = lippmann("show", quilt, "--json")
    assert done.json == {"picture": str(quilt), "panels": ["LKG-P00001"]}
    assert fake_bridge.asked[-1][0] == "play_playlist"
    fake_bridge.devices = []
    assert "finds no panel" in lippmann("show", quilt).err
    for words in (("--port", 8000), ("--no-browser",), ("--display", "portrait")):
        done = lippmann("show", quilt, *words)
        assert done.code == 2
        assert f"{words[0]}: a quilt goes through Bridge" in done.err
    pair = quilt.rename(tmp_path / "seen_2x1.png")
    assert "this is a stereo pair" in lippmann("show", pair).err
    odd = pair.rename(tmp_path / "seen_qs7x2a0.75.png")
    assert "7x2 views" in lippmann("show", odd).err
    assert "--port: a quilt goes through Bridge" in lippmann("show", odd, "--port", 8000).err  # before it is read
