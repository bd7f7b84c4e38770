"""What files and their names say never commands the terminal."""

import json
import re

import numpy as np
import pytest

from lippmann import printable
from lippmann.errors import SceneError

#: Sets the title, colours, turns lines around, clears the screen in C1, breaks the line, and styles Rich's.
EVIL = "\x1b]0;pwn\x07\x1b[31mred\u202e\u009b2J\nforged: yes[bold]x[/bold]"
RAW = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


def test_controls_are_spelt_out():
    assert printable.one_line("a\x1b[31m\u202eb\nc\u009bd é 日本") == r"a\x1b[31m\u202eb\nc\x9bd é 日本"
    assert printable.lines("a\nb\x07") == "a\nb\\x07"
    assert json.loads(printable.json_text(json.dumps({"a": "\x9b\u202e"}, ensure_ascii=False))) == {"a": "\x9b\u202e"}
    assert str(SceneError(f"name {EVIL}", where="\x1b.glb")).isprintable()


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "b.bin").write_bytes(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes())
    camera = {"name": EVIL, "type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}
    tree = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [f"ACME_{EVIL}"],
        "buffers": [{"uri": "b.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"name": EVIL, "primitives": [{"attributes": {"POSITION": 0}}]}],
        "cameras": [camera],
        "nodes": [{"mesh": 0, "name": EVIL}, {"camera": 0, "name": EVIL, "translation": [0, 0, 5]}],
        "scenes": [{"nodes": [0, 1], "name": EVIL}, {"nodes": [0]}],
        "scene": 0,
    }
    path = tmp_path / "e\x1b[31m.gltf"
    path.write_text(json.dumps(tree))
    return path


@pytest.mark.long
def test_a_hostile_file_says_nothing_to_the_terminal(lippmann, scene, tmp_path, engine):
    picture = tmp_path / "p\x1b[31m.png"
    quick = ("--integrator", "depth", "--spp", "1")
    for words in (
        ("render", scene, *quick, "-o", picture),
        ("render", scene, *quick, "--camera", "none", "-o", picture),
        ("render", scene, *quick, "--json", "-o", picture),
        ("plan", scene, *quick),
        ("info", picture),
        ("info", picture, "--json"),
        ("info", tmp_path / "none\x1b[31m.png"),
        ("render", scene, *quick, "-d", tmp_path / "\x9b.toml", "-o", picture),
    ):
        done = lippmann(*words)
        for stream in (done.out, done.err):
            assert not RAW.search(stream), (words[0], stream)
            assert not any(line.startswith("forged: yes") for line in stream.splitlines())
        assert "internal error" not in done.err


def test_values_in_messages_are_cut_to_sixty_characters():
    assert printable.shorten("x" * 58) == f"'{'x' * 58}'"
    assert printable.shorten("x" * 59) == f"'{'x' * 56}..."
