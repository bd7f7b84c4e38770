"""Small files that stand for gigabytes, and files that are none, end each command in one line, soon."""

import io
import json
import os
import resource
import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest
from PIL import Image

from lippmann.runtime.child_python import python_command

#: Bytes of data that a command may have in these tests, beyond what the program and its libraries take themselves.
MEMORY = 3 << 30


def ended(*words):
    """Exit code, and what a command said, of a process of its own with little memory."""
    command, environment = python_command("from lippmann.cli import main; main()", *map(str, words))

    def limit():
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))

    done = subprocess.run(
        command, capture_output=True, text=True, timeout=60, env=environment, preexec_fn=limit, check=False
    )
    return done.returncode, done.stderr.strip()


def refused(*words, says):
    code, said = ended(*words)
    line = said.splitlines()[-1]
    assert code in (1, 2), said
    assert line.startswith("lippmann: ")
    assert says in line, line
    assert "internal error" not in line
    assert "Traceback" not in said


COMMANDS = {
    "render": ("render", "{}", "-d", "seed-lenticular", "-o", "x.png"),
    "display": ("render", "teapot", "-d", "{}.toml", "-o", "x.png"),
    "environment": ("render", "teapot", "--environment", "{}", "-o", "x.png"),
    "info": ("info", "{}"),
    "weave": ("weave", "{}", "-d", "looking-glass-go", "-o", "x.png"),
    "interlace": ("interlace", "{}", "{}", "--lpi", "60", "--ppi", "720", "--size", "2x2in", "-o", "x.png"),
    "import": ("import", "{}", "-o", "x.png"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_a_pipe_that_nobody_writes_into_is_not_waited_for(name, tmp_path, monkeypatch):
    from lippmann.cli import run

    monkeypatch.chdir(tmp_path)
    for ending in ("", ".glb", ".toml", ".png", ".mat", ".exr"):
        os.mkfifo(f"pipe{ending}")
    file = {"render": "pipe.glb", "weave": "pipe.png", "interlace": "pipe.png", "import": "pipe.mat"}.get(name, "pipe")
    file = "pipe.exr" if name == "environment" else file
    said = io.StringIO()
    monkeypatch.setattr(sys, "stderr", said)
    assert run([word.format(file) for word in COMMANDS[name]]) == 2
    assert "is a pipe, no file" in said.getvalue().splitlines()[-1]


@pytest.mark.slow
def test_a_device_that_never_ends_is_refused():
    refused("info", "/dev/zero", says="/dev/zero: is a device, no file")


def exr(width, height, tile):
    def attribute(name, kind, value):
        return name + b"\0" + kind + b"\0" + struct.pack("<I", len(value)) + value

    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(name + b"\0" + struct.pack("<iBxxxii", 1, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    head = struct.pack("<II", 20000630, 2 | 0x200)
    head += attribute(b"channels", b"chlist", channels) + attribute(b"compression", b"compression", b"\x03")
    head += attribute(b"dataWindow", b"box2i", box) + attribute(b"displayWindow", b"box2i", box)
    head += attribute(b"lineOrder", b"lineOrder", b"\0") + attribute(
        b"pixelAspectRatio", b"float", struct.pack("<f", 1)
    )
    head += attribute(b"screenWindowCenter", b"v2f", bytes(8)) + attribute(b"screenWindowWidth", b"float", bytes(4))
    return head + attribute(b"tiles", b"tiledesc", struct.pack("<IIB", *tile, 0)) + b"\0" + bytes(4096)


@pytest.mark.long
def test_tiles_larger_than_their_picture_get_no_memory(tmp_path):
    (tmp_path / "t.exr").write_bytes(exr(64, 32, (30000, 30000)))
    refused(
        "render", "teapot", "--environment", tmp_path / "t.exr", "-o", tmp_path / "x.png", says="30000 x 30000 pixels"
    )


@pytest.mark.long
def test_textures_count_against_the_memory_that_was_given(tmp_path):
    """Ten files of 190 kB are 2.7 GB of pixels."""
    packed = zlib.compress(bytes(8192 * 8192 * 3 + 8192), 9)

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", 8192, 8192, 8, 2, 0, 0, 0)
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    (tmp_path / "b.bin").write_bytes(corners + np.zeros((3, 2), "<f4").tobytes())
    scene = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "b.bin", "byteLength": 60}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 24}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
        "images": [{"uri": f"{k}.png"} for k in range(10)],
        "textures": [{"source": k} for k in range(10)],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": k}}} for k in range(10)],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": k} for k in range(10)]}
        ],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    for k in range(10):
        (tmp_path / f"{k}.png").write_bytes(png)
    (tmp_path / "s.gltf").write_text(json.dumps(scene))
    refused("preview", tmp_path / "s.gltf", "--memory", "1G", "-o", tmp_path / "x.png", says="allow more with --memory")


@pytest.mark.slow
def test_a_light_field_of_one_packed_byte_is_refused(tmp_path):
    """A variable of 8 GB, packed, in the head of a file of 300 bytes."""
    body = struct.pack("<II2I", 6, 8, 9, 0) + struct.pack("<II5i4x", 5, 20, 8, 8, 5000, 8000, 3)
    body += struct.pack("<HH", 1, 2) + b"LF\0\0" + struct.pack("<II", 2, 8 * 8 * 5000 * 8000 * 3 & 0xFFFFFFFF)
    packed = zlib.compress(struct.pack("<II", 14, len(body)) + body)
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    (tmp_path / "x.mat").write_bytes(head + struct.pack("<II", 15, len(packed)) + packed)
    refused("import", tmp_path / "x.mat", "-o", tmp_path / "x.png", says="claims")


def test_a_photograph_larger_than_memory_is_refused_before_it_is_decoded(tmp_path, monkeypatch):
    from lippmann.cli import run
    from lippmann.runtime import machine

    for k in range(2):
        Image.new("L", (6000, 6000)).save(tmp_path / f"{k}.png")
    monkeypatch.setattr(machine, "available_memory", lambda: 100 << 20)
    said = io.StringIO()
    monkeypatch.setattr(sys, "stderr", said)
    names = [str(tmp_path / f"{k}.png") for k in range(2)]
    assert (
        run(["interlace", *names, "--lpi", "60", "--ppi", "360", "--size", "1x1in", "-o", str(tmp_path / "x.png")]) == 2
    )
    assert "6000 x 6000 pixels takes 275 MiB of memory; 100 MiB are left" in said.getvalue().splitlines()[-1]
