"""What the proofs share: real scenes that glow by themselves, each loaded and built once."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import pytest

# Modules that only the proofs use lie beside them.
sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parent.parent / "viewing"))

SCENES = {
    "teapot": "teapot",
    "fancy teapot": "gltf/fancy_teapot/scene.gltf",
    "clear coat": "gltf/clearcoat_test/ClearCoatTest.gltf",
}


@pytest.fixture(scope="session")
def glowing(request):
    """``glowing(name)``: the scene with every material unlit, so that its colours and textures shine by themselves."""
    from lippmann.api import load_scene

    loaded = {}

    def get(name):
        if name not in loaded:
            file = SCENES[name]
            scene = load_scene(file if name == "teapot" else request.getfixturevalue("shared_scenes") / file)
            description = scene.description
            materials = [replace(material, unlit=True) for material in description.materials]
            loaded[name] = replace(scene, description=replace(description, materials=materials))
        return loaded[name]

    return get


@pytest.fixture(scope="session")
def _built_scenes():
    return {}


@pytest.fixture
def build_once(monkeypatch, _built_scenes):
    """``build_once(scene)``: the built scene, kept from test to test; renders take it from there too."""
    import lippmann.device.pbr

    build = lippmann.device.pbr.build

    def kept(scene, engine=None, *, memory=None):
        if id(scene) not in _built_scenes:
            _built_scenes[id(scene)] = (scene, build(scene, engine, memory=memory))
        return _built_scenes[id(scene)][1]

    monkeypatch.setattr(lippmann.device.pbr, "build", kept)
    return kept
