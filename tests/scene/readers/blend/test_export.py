"""The export of a Blender file: what Blender is asked for, and Blenders that fail in every way."""

import json
import math
import os
import shutil
import struct
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from lippmann.errors import MemoryLimitError, SceneError
from lippmann.runtime.machine import limit_inputs
from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.readers.blend import export, read_blend
from lippmann.scene.readers.load import load_scene

pytestmark = pytest.mark.skipif(os.name == "nt", reason="the fake programs are scripts of a shell")

TELL = "(out / 'outcome.json').write_text(json.dumps({'world': False, 'camera': 'B', 'notes': ['a note']}))"


def triangle() -> bytes:
    """A GLB file of one triangle, a point light and two cameras."""
    data = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    lens = {"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}
    root = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1, 2, 3]}],
        "nodes": [
            {"mesh": 0},
            {"camera": 0, "name": "A"},
            {"camera": 0, "name": "B"},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        "cameras": [lens],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 2.0}]}},
    }
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", 36, b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.fixture
def give(fake_blender, tmp_path):
    """A Blender that writes these bytes as its scene."""

    def write(content: bytes, code: str = TELL):
        stored = tmp_path / "stored.glb"
        stored.write_bytes(content)
        return fake_blender(f"(out / 'scene.glb').write_bytes(Path({str(stored)!r}).read_bytes())\n{code}")

    return write


def test_a_scene(give, blend):
    give(triangle())
    scene = load_scene(blend)
    assert scene.name == "model"
    assert [camera.name for camera in scene.cameras] == ["B", "A"]
    assert scene.notes[0] == "a note"
    assert scene.environment is None
    assert not scene.has_physical_lights  # they are as bright as they were in Blender


def test_content_counts_where_the_name_says_nothing(give, blend):
    give(triangle())
    assert load_scene(blend.rename(blend.with_suffix(".data"))).description.meshes


def test_blender_is_asked_for_no_scripts_and_no_input(give, blend, tmp_path):
    told = tmp_path / "told.json"
    note = f"import os\nPath({str(told)!r}).write_text(json.dumps([sys.argv[1:], sys.stdin.read(), str(out)]))"
    give(triangle(), f"{TELL}\n{note}")
    read_blend(blend)
    words, given, out = json.loads(told.read_text())
    request = json.loads(words.pop())
    assert words[:3] == ["--background", "--factory-startup", "--disable-autoexec"]
    assert words[3:7] == [str(blend), "--python-exit-code", "1", "--python"]
    assert Path(words[7]).is_file()
    assert words[8:] == ["--"]
    assert request == {"out": out, "folder": str(blend.parent), "is_animated": False, "open": None}
    assert given == ""
    assert not Path(out).exists()
    give(triangle(), f"{TELL}\n{note}")
    read_blend(blend, files=NamedFiles(blend.parent, True))
    assert json.loads(json.loads(told.read_text())[0][-1])["folder"] is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "message"),
    [
        (
            "print('Error: it is broken')\nprint('Blender quit')\nsys.exit(1)",
            r"fails at the file \(Error: it is broken\)",
        ),
        ("sys.exit(7)", r"Blender fails at the file \(exit status 7\)"),
        ("import os\nos.abort()", r"Blender fails at the file \(exit status -6\)"),
        (
            "(out / 'outcome.json').write_text('{\"error\": \"no\\\\nmemory\"}')",
            r"Blender fails at the file \(no memory\)",
        ),
        ("(out / 'outcome.json').write_text('[]')", r"Blender fails at the file \(exit status 0\)"),
        ("(out / 'outcome.json').write_text('{')", r"Blender fails at the file \(exit status 0\)"),
        (
            "(out / 'outcome.json').write_text('{\"a\": 1}' + ' ' * 5000000)",
            r"Blender fails at the file \(exit status 0\)",
        ),
        ("print('x' * 100000)", r"Blender fails at the file \(x{300}\)"),
        (TELL, "Blender wrote no scene"),
        ("(out / 'scene.glb').mkdir()\n" + TELL, "Blender wrote no scene"),
    ],
)
def test_blenders_that_fail(fake_blender, blend, code, message):
    fake_blender(code)
    with pytest.raises(SceneError, match=rf"^model\.blend: .*{message}") as caught:
        read_blend(blend)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"glTF", triangle()[:-40], triangle().replace(b"VEC3", b"VEC9")])
def test_a_damaged_scene_is_told_of_the_blender_file(give, blend, content):
    give(content)
    with pytest.raises(SceneError, match=r"^model\.blend: "):
        read_blend(blend)


def test_a_world_that_is_missing_or_no_picture(give, blend):
    world = TELL.replace("False", "True")
    give(triangle(), world)
    with pytest.raises(SceneError, match=r"^model\.blend: no such file"):
        read_blend(blend)
    give(triangle(), f"(out / 'world.exr').write_bytes(b'x' * 100)\n{world}")
    with pytest.raises(SceneError, match=r"^model\.blend: is no picture in linear light"):
        read_blend(blend)


def test_a_huge_scene_is_refused_before_it_is_read(give, blend):
    give(triangle(), f"{TELL}\nwith (out / 'scene.glb').open('ab') as file:\n    file.truncate(1 << 38)")
    says = r"^model\.blend: the file takes 256\.0 GiB of memory"
    with limit_inputs(1 << 28), pytest.raises(MemoryLimitError, match=says):
        read_blend(blend)


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)
KEYS = st.sampled_from(["world", "camera", "exposure", "notes", "error", "outside"])


@pytest.mark.slow
@given(st.dictionaries(KEYS, VALUES).map(lambda told: json.dumps(told).encode()) | st.binary(max_size=40))
@example(b"[" * 100_000)
@example(b'{"exposure": 1e999, "notes": 3}')
@example(b'{"exposure": 1' + b"0" * 400 + b"}")
def test_whatever_the_outcome_says(tmp_path_factory, told):
    path = tmp_path_factory.getbasetemp() / "outcome.json"
    path.write_bytes(told)
    outcome = export._outcome(path, "a.blend")
    if outcome is None:
        return
    if "error" in outcome or "outside" in outcome:
        assert all(isinstance(value, str) for value in outcome.values())
        return
    assert {name: type(value) for name, value in outcome.items()} == {
        "world": bool,
        "camera": str,
        "exposure": float,
        "notes": list,
    }
    assert math.isfinite(outcome["exposure"])


@pytest.mark.slow
def test_a_time_limit(fake_blender, blend, monkeypatch, tmp_path):
    pid = tmp_path / "pid"
    child = "[sys.executable, '-c', 'import time; time.sleep(60)']"
    fake_blender(
        f"import subprocess\nPath({str(pid)!r}).write_text(str(subprocess.Popen({child}).pid))\ntime.sleep(60)"
    )
    monkeypatch.setattr(export, "MOST_SECONDS", 1.0)
    with pytest.raises(SceneError, match=r"^model\.blend: Blender takes more than 1 s; export it"):
        read_blend(blend)
    own = int(pid.read_text())  # of what it started: gone, or waited for by nobody
    with suppress(psutil.NoSuchProcess):
        while psutil.Process(own).status() != psutil.STATUS_ZOMBIE:
            time.sleep(0.01)


def test_files_outside_are_refused(fake_blender, blend):
    fake_blender("(out / 'outcome.json').write_text(json.dumps({'error': 'outside', 'outside': '//../a.png'}))")
    with pytest.raises(SceneError, match=r"^model\.blend: names the file '//\.\./a\.png' outside its folder; pack it"):
        read_blend(blend)


@pytest.mark.parametrize("content", [b"RIFF", b"BLEND", bytes(16)])
def test_what_is_no_blender_file_is_never_shown_to_blender(tmp_path, no_blender, content):
    path = tmp_path / "a.blend"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=r"^a\.blend: is no Blender file; it begins with BLENDER, or is compressed"):
        load_scene(path)


@pytest.mark.parametrize("beginning", [b"\x28\xb5\x2f\xfd", b"\x1f\x8b"])
def test_compressed_files(give, tmp_path, beginning):
    give(triangle())
    path = tmp_path / "a.blend"
    path.write_bytes(beginning + bytes(8))
    assert read_blend(path).meshes


def test_the_module_in_place_of_the_program(no_blender, blend, monkeypatch, tmp_path):
    """A module ``bpy`` that is importable runs the same script; here one that writes what it is asked for."""
    (tmp_path / "stored.glb").write_bytes(triangle())
    script = tmp_path / "script.py"
    script.write_text(
        "import json, sys\nfrom pathlib import Path\nrequest = json.loads(sys.argv[-1])\n"
        "out = Path(request['out'])\nassert request['open'].endswith('model.blend')\n"
        f"(out / 'scene.glb').write_bytes(Path({str(tmp_path / 'stored.glb')!r}).read_bytes())\n{TELL}\n"
    )
    monkeypatch.setattr("lippmann.scene.readers.blend.find_blender._has_module", lambda: True)
    monkeypatch.setattr(export, "_SCRIPT", script)
    assert read_blend(blend).cameras[0].name == "B"
    assert shutil.which("blender") is None
