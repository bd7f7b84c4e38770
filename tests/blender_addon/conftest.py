"""Modules of the add-on that need no Blender, and a packed one."""

import importlib.util
import os
import sys
from pathlib import Path

import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.blend.find_blender import find_blender

ROOT = Path(__file__).resolve().parents[2]


def module_of(path):
    """A module by its file, under a name of its own."""
    name = f"addon_{path.stem}"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, path)
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


@pytest.fixture(scope="session")
def addon():
    """Gives a module of the add-on by its name."""
    return lambda name: module_of(ROOT / "blender_addon" / f"{name}.py")


@pytest.fixture(scope="session")
def packer():
    """The script that packs it."""
    return module_of(ROOT / "scripts" / "pack_addon.py")


@pytest.fixture(scope="session")
def packed(packer, tmp_path_factory):
    """The packed add-on."""
    return packer.pack(tmp_path_factory.mktemp("packed") / "dist")


@pytest.fixture(scope="session")
def blender_command():
    """Beginning of a command line that runs a script in a real Blender; else the test is skipped."""
    python = os.environ.get("LIPPMANN_TEST_BPY_PYTHON")
    if python:
        return [python, "-P"]
    try:
        program = find_blender("tests")
    except SceneError:
        program = None
    if program is None:
        pytest.skip("no Blender of version 4.2 or newer is installed")
    return [program, "--background", "--factory-startup", "--python-exit-code", "1", "--python"]
