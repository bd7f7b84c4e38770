"""Files that would lead a stage elsewhere, or bring its reader down, are refused in one line."""

import os
import random
import signal
import subprocess
import sys
import threading
import time
import zipfile

import numpy as np
import pytest

from lippmann.errors import LippmannError, MemoryLimitError, SceneError
from lippmann.runtime.machine import limit_inputs
from lippmann.scene.readers.load import load_scene
from lippmann.scene.readers.usd import process

from .conftest import HEAD, triangle
from .test_stage_materials import packed


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["references", "payload", "subLayers"])
def test_layers_outside_the_folder_are_refused(read, tmp_path, kind):
    outside = tmp_path.parent / "elsewhere.usda"
    outside.write_text(HEAD.replace("(\n", '(\n    defaultPrim = "m"\n', 1) + triangle())
    head, body = HEAD, f'def "x" (prepend {kind} = @../elsewhere.usda@) {{}}\n'
    if kind == "subLayers":
        head, body = HEAD.replace("(\n", "(\n    subLayers = [@../elsewhere.usda@]\n", 1), ""
    with pytest.raises(SceneError) as caught:
        read(triangle("own") + body, head=head)
    assert str(caught.value).startswith(
        "stage.usda: layer '../elsewhere.usda' lies outside the scene's folder; a scene file may name only files in its"
    )
    trusted = read(triangle("own") + body, head=head, allow_outside=True)
    assert len(trusted.meshes) == 2


def test_a_link_that_leads_outside_is_refused(read, tmp_path):
    (tmp_path.parent / "far.usda").write_text(HEAD + triangle())
    (tmp_path / "near.usda").symlink_to(tmp_path.parent / "far.usda")
    with pytest.raises(SceneError, match="lies outside"):
        read(triangle() + 'def Xform "x" (prepend references = @near.usda@</m>) {}\n')


def test_layers_in_the_folder_are_read(read):
    part = HEAD + triangle()
    scene = read('def "x" (prepend references = @parts/part.usda@</m>) {}\n', files={"parts/part.usda": part})
    assert len(scene.meshes) == 1


def test_a_layer_that_is_not_there_is_named(read):
    scene = read(triangle() + 'def Xform "x" (prepend references = @none.usda@) {}\n')
    assert scene.notes == ["layer 'none.usda' not found: the scene lacks what it holds"]


@pytest.mark.parametrize(
    ("name", "content", "note"),
    [
        ("look.obj", "v 0 0 0", "is of a format that the installed USD does not read: left out"),
        ("look.mtlx", "<materialx>", "is no MaterialX that can be read (no element found"),
        (
            "look.mtlx",
            '<materialx><standard_surface name="s"><input name="base" type="float" value="x"/></standard_surface>'
            '<surfacematerial name="m"><input name="surfaceshader" nodename="s"/></surfacematerial></materialx>',
            "is no MaterialX that can be read (could not convert string to float: 'x'): left out",
        ),
    ],
)
def test_a_layer_that_is_not_read_is_left_out(read, name, content, note):
    body = triangle() + f'def Scope "x" (prepend references = @{name}@</MaterialX>) {{}}\n'
    scene = read(body, files={name: content})
    assert len(scene.meshes) == 1
    assert scene.notes[0].startswith(f"layer '{name}' {note}")


def test_a_unit_that_is_stored_in_single_precision_counts(tmp_path):
    from pxr import Usd, UsdGeom

    path = tmp_path / "float.usdc"
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 0.5)
    UsdGeom.Cube.Define(stage, "/cube")
    stage.Save()
    double, single = b"\0\0\0?\0\0\x09@", b"\0\0\0?\0\0\x08@"  # 0.5 as a value of the file, and its type
    content = path.read_bytes()
    assert content.count(double) == 1
    path.write_bytes(content.replace(double, single))
    assert load_scene(path).bounds == pytest.approx(np.array([[-0.5] * 3, [0.5] * 3]))


def test_layers_that_name_each_other_end(read):
    loop = 'def Xform "x" (prepend references = @stage.usda@</y>) {}\n'
    scene = read(
        triangle() + 'def Xform "y" (prepend references = @loop.usda@</x>) {}\n', files={"loop.usda": HEAD + loop}
    )
    assert len(scene.meshes) == 1


def test_a_file_of_another_kind_is_refused(read, tmp_path):
    with pytest.raises(SceneError, match=r"^stage\.usda: USD refuses it: stage.usda:"):
        read("", head="#usda 1.0\ndef def def")
    (tmp_path / "odd.usdc").write_bytes(b"PXR-USDC" + bytes(100))
    with pytest.raises(SceneError, match=r"^odd\.usdc: USD refuses it"):
        load_scene(tmp_path / "odd.usdc")


@pytest.mark.parametrize("compression", [zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA])
def test_compressed_packages_are_refused(tmp_path, compression):
    """A ZIP archive of some kilobytes can unpack to gigabytes."""
    path = tmp_path / "bomb.usdz"
    packed(path, {"stage.usda": (HEAD + triangle()).encode() + b" " * 10_000_000}, compression)
    with pytest.raises(SceneError, match=r"^bomb\.usdz: 'stage\.usda' is compressed or encrypted; files in a USDZ"):
        load_scene(path)


def test_packages_that_lie_about_their_size_are_refused(tmp_path):
    path = tmp_path / "bomb.usdz"
    packed(path, {"stage.usda": (HEAD + triangle()).encode()})
    data = path.read_bytes()
    place = data.rindex(b"PK\x01\x02")
    path.write_bytes(data[: place + 24] + (1 << 30).to_bytes(4, "little") + data[place + 28 :])
    with pytest.raises(SceneError, match="longer than the package"):
        load_scene(path)
    path.write_bytes(b"PK\x03\x04 nothing more")
    with pytest.raises(SceneError, match="is no USDZ package"):
        load_scene(path)


def test_what_takes_more_memory_than_allowed_is_refused(read):
    fields = 180
    row = fields + 1
    points = [(x, y, 0) for y in range(row) for x in range(row)]
    faces = [
        (y * row + x, y * row + x + 1, y * row + row + x + 1, y * row + row + x)
        for y in range(fields)
        for x in range(fields)
    ]
    corners = ", ".join(str(corner) for face in faces for corner in face)
    body = (
        f'def Mesh "m" {{\npoint3f[] points = {points}\nint[] faceVertexCounts = {[4] * len(faces)}\n'
        f"int[] faceVertexIndices = [{corners}]\n}}\n"
    )
    with limit_inputs(400 << 20), pytest.raises(MemoryLimitError, match="refined, takes"):
        read(body)


@pytest.mark.slow
def test_a_process_that_ends_is_one_line(read, monkeypatch):
    read(triangle())
    ask = process._process.ask

    def killed(request, *, where):
        pid = process._process._process.pid
        os.kill(pid, signal.SIGSTOP)  # so that it dies over the request, not before
        threading.Timer(0.2, os.kill, (pid, signal.SIGKILL)).start()
        return ask(request, where=where)

    monkeypatch.setattr(process._process, "ask", killed)
    with pytest.raises(SceneError, match=r"^stage\.usda: USD breaks down at the file \(signal 9\); is it whole\?$"):
        read(triangle("again"))
    monkeypatch.undo()
    assert len(read(triangle("after")).meshes) == 1


def test_a_stage_that_takes_too_long_is_given_up(read, monkeypatch):
    read(triangle())
    os.kill(process._process._process.pid, signal.SIGSTOP)  # so that no answer comes, however busy the machine is
    monkeypatch.setattr(process._process, "_most_seconds", 0.01)
    with pytest.raises(SceneError, match=r"USD breaks down at the file \(it takes more than 0.01 s\)"):
        read(triangle("again"))
    assert process._process._process is None


@pytest.mark.slow
def test_damaged_stages_end_in_a_scene_or_one_line(tmp_path):
    """Mutations of a stage in text, and some of one in USD's binary form."""
    sound = (
        HEAD
        + triangle()
        + 'def PointInstancer "p" {\nrel prototypes = [</m>]\nint[] protoIndices = [0]\n'
        + "point3f[] positions = [(1, 0, 0)]\n}\n"
    )
    text = tmp_path / "a.usda"
    text.write_text(sound)
    binary = tmp_path / "a.usdc"
    code = "import sys; from pxr import Sdf; Sdf.Layer.FindOrOpen(sys.argv[1]).Export(sys.argv[2])"
    subprocess.run([sys.executable, "-c", code, text, binary], check=True)
    rng = random.Random(1)
    started = time.process_time()
    outcomes = set()
    for number in range(120):
        source = binary if number % 24 == 0 else text
        data = bytearray(source.read_bytes())
        for _ in range(rng.randint(1, 4)):
            data[rng.randrange(8, len(data))] = rng.randrange(256)
        damaged = tmp_path / f"d{number}{source.suffix}"
        damaged.write_bytes(data)
        try:
            load_scene(damaged)
            outcomes.add("read")
        except LippmannError as error:
            outcomes.add(f"refused in {len(str(error).splitlines())} line")
    assert outcomes == {"read", "refused in 1 line"}
    assert time.process_time() - started < 20


def test_hundreds_of_instances_are_read_once(read):
    """A board with 64 fields and 32 men, and forests of instancers: as fast as their prims are few."""
    piece = 'def Xform "{0}" {{\n' + triangle("body").replace("{", "{{").replace("}", "}}") + "}}\n"
    body = "".join(piece.format(f"kind{number}") for number in range(6))
    for number in range(600):
        body += (
            f'def Xform "piece{number}" (instanceable = true\nprepend references = </kind{number % 6}>) {{\n'
            f"double3 xformOp:translate = ({number % 20}, 0, {number // 20})\n"
            'uniform token[] xformOpOrder = ["xformOp:translate"]\n}\n'
        )
    started = time.process_time()
    scene = read(body)
    assert time.process_time() - started < 2
    assert len(scene.meshes) == 12
    assert sum(len(worlds) for worlds in scene.placements.values()) == 606
