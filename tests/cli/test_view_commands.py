"""``lippmann view`` and ``lippmann calibrate page`` as whole commands."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from contextlib import contextmanager

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel, load_display
from lippmann.image import IntegralImage
from lippmann.image.write import write_plain_picture

DISPLAY = Display(
    "d", Panel(32, 24, 0.1), LensArray("lenticular", 0.4), gap=1.0, viewing_distance=500.0, aperture_distance=5.0
)
PIXELS = np.random.default_rng(1).random((24, 32, 3), dtype=np.float32)


@pytest.fixture
def shot(tmp_path):
    """A small picture."""
    path = tmp_path / "shot.png"
    IntegralImage(PIXELS, DISPLAY).save(path)
    return path


@contextmanager
def serving(*words, **variables):
    """The command as a process of its own that serves a page; yields it and the address that it printed."""
    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-c", "from lippmann.cli import main; main()", *map(str, words)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment | variables
    ) as process:
        try:
            line = process.stdout.readline()
            yield process, line.split()[-1].strip('"}')
        finally:
            process.kill()


def fetch(address):
    with urllib.request.urlopen(address, timeout=20) as answer:
        return answer.read()


def interrupted(process):
    """Code and standard error of a process after Ctrl-C."""
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    return process.returncode, err


@pytest.mark.slow
def test_view_serves_the_picture_until_ctrl_c(shot):
    with serving("view", shot) as (process, address):
        assert address.startswith("http://127.0.0.1:")
        assert b"lippmann" in fetch(address)
        assert json.loads(fetch(f"{address}pictures/0/manifest.json"))["name"] == "shot.png"
        code, err = interrupted(process)
    assert code == 130
    assert err.strip() == "Ctrl-C ends it"
    with pytest.raises(OSError, match="refused"):
        fetch(address)


@pytest.mark.slow
def test_view_says_the_way_through_a_tunnel(shot):
    with serving("view", shot, "--json", SSH_CONNECTION="192.0.2.1 1 192.0.2.2 22") as (process, address):
        port = address.rstrip("/").rpartition(":")[2]
        # Packed tiles, since the bytes go through a wire.
        assert json.loads(fetch(f"{address}pictures/0/manifest.json"))["tiles"]["format"] == "png"
        _, err = interrupted(process)
    assert f"ssh -L {port}:127.0.0.1:{port} " in err


@pytest.mark.slow
def test_view_warns_of_others(shot):
    with serving("view", shot, "--host", "0.0.0.0") as (process, _):
        assert "everyone who can reach this machine" in interrupted(process)[1]


@pytest.mark.slow
def test_view_says_what_is_wrong_with_pixels_here_and_on_the_page(shot):
    content = bytearray(shot.read_bytes())
    content[-40] ^= 0xFF
    shot.write_bytes(content)
    with serving("view", shot) as (process, address):
        with pytest.raises(urllib.error.HTTPError) as caught:
            fetch(f"{address}pictures/0/manifest.json")
        line = json.loads(caught.value.read())["error"]
        assert "shot.png" in line
        assert "damaged" in line
        # Another thread says it; an interrupt before that would end the process.
        assert any(said == f"lippmann: {line}\n" for said in process.stderr)
        interrupted(process)


@pytest.mark.slow
def test_view_opens_the_browser_where_there_is_a_screen(shot, tmp_path):
    opened = tmp_path / "opened.txt"
    browser = f"{sys.executable} -c \"open(r'{opened}', 'w').write(__import__('sys').argv[1])\" %s"
    with serving("view", shot, BROWSER=browser, DISPLAY=":9") as (process, address):
        fetch(address)
        for _ in range(1200):
            if opened.exists() and opened.read_text():
                break
            time.sleep(0.05)
        assert opened.read_text() == address
        interrupted(process)


def test_export_writes_one_file(lippmann, shot, tmp_path):
    page = tmp_path / "page.html"
    outcome = lippmann("view", shot, shot, "--export", page, "--json")
    assert outcome.json == {"output": str(page), "bytes": page.stat().st_size}
    assert page.read_text().startswith("<!doctype html>")


def test_a_page_in_one_file_has_its_limits(lippmann, shot, tmp_path, monkeypatch):
    monkeypatch.setattr("lippmann.viewer.export.MOST_PIXELS", 100)
    refuse(lippmann("view", shot, "--export", tmp_path / "a.html"), "--export", "at most 100 pixels", "leave it out")
    assert not (tmp_path / "a.html").exists()


def test_a_page_does_not_replace_a_picture(lippmann, shot, tmp_path):
    page = tmp_path / "page.png"
    page.write_bytes(b"older")
    refuse(lippmann("view", shot, "--export", page), f"{page}: the ending is '.png'; a page ends in .html")
    assert page.read_bytes() == b"older"


@pytest.mark.parametrize("extra", [("--port", "1234"), ("--host", "localhost"), ("--no-browser",)])
def test_options_of_the_server_mean_nothing_to_a_file(lippmann, shot, tmp_path, extra):
    refuse(lippmann("view", shot, "--export", tmp_path / "a.html", *extra), extra[0])


def refuse(outcome, *words):
    """The command was refused in one line that holds all ``words``."""
    assert outcome.code == 2, outcome.err
    assert outcome.out == ""
    lines = outcome.err.strip().splitlines()
    assert len(lines) == 1, outcome.err
    for word in words:
        assert word in lines[0], outcome.err


@pytest.mark.slow
@pytest.mark.parametrize("way", [(), ("--export", "page.html")])
def test_pictures_that_will_not_do(lippmann, shot, tmp_path, monkeypatch, way):
    monkeypatch.chdir(tmp_path)
    plain = tmp_path / "plain.png"
    write_plain_picture(PIXELS, plain)
    refuse(lippmann("view", plain, *way), "plain.png", "--display")
    refuse(lippmann("view", tmp_path / "gone.png", *way), "gone.png", "no such file")
    refuse(lippmann("view", shot, tmp_path / "gone.png", *way), "gone.png")
    foreign = tmp_path / "foreign.png"
    foreign.write_bytes(b"no picture")
    refuse(lippmann("view", foreign, *way), "foreign.png")
    foreign.write_bytes(shot.read_bytes()[:-20])
    refuse(lippmann("view", foreign, *way), "foreign.png")
    refuse(lippmann("view", shot, "--display", "mla-square", *way), "32 x 24")
    refuse(lippmann("view", shot, "--display", "no-such", *way), "no-such")
    assert not (tmp_path / "page.html").exists()


def test_a_port_in_use_is_said(lippmann, shot):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        refuse(lippmann("view", shot, "--port", port), "--port", f"port {port} is in use")
    refuse(lippmann("view", shot, "--port", 99999), "--port", "99999")
    refuse(lippmann("view", shot, "--host", "192.0.2.1"), "--host", "192.0.2.1")


@pytest.mark.slow
def test_calibrate_page_saves_the_display_file(tmp_path):
    mine = tmp_path / "mine.toml"
    with serving("calibrate", "page", "panel-4k", "-o", mine) as (process, address):
        start = json.loads(fetch(f"{address}calibration.json"))
        sent = {"pitch": 45.5, "slope": -5.9, "center": 0.5, "order": None}
        headers = {"Content-Type": "application/json", "X-Lippmann-Token": start["token"]}
        request = urllib.request.Request(f"{address}display", json.dumps(sent).encode(), headers)
        assert json.loads(fetch(request)) == {"saved": str(mine)}
        code, err = interrupted(process)
    assert code == 130
    assert f"{mine}: pitch 45.5 lpi, slope -5.9" in err
    assert load_display(mine).panel.width == 3840


def test_calibrate_page_refuses(lippmann, tmp_path):
    refuse(lippmann("calibrate", "page", "panel-4k", "-o", tmp_path / "mine.json"), "mine.json", ".toml")
    refuse(lippmann("calibrate", "page", "panel-4k", "-o", tmp_path / "gone" / "mine.toml"), "gone")
    refuse(lippmann("calibrate", "page", "mla-square", "-o", tmp_path / "mine.toml"), "square")
    refuse(lippmann("calibrate", "page", "no-such", "-o", tmp_path / "mine.toml"), "no-such")
    assert list(tmp_path.iterdir()) == []
