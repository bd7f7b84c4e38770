"""Blenders for tests: fake ones, and a real one where there is one."""

import functools
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from lippmann.errors import SceneError
from lippmann.scene.readers.blend import read_blend
from lippmann.scene.readers.blend.find_blender import VARIABLE, find_blender

HERE = Path(__file__).parent
#: Environment variable of the tests alone: a Python that has Blender's module ``bpy``.
BPY_PYTHON = "LIPPMANN_TEST_BPY_PYTHON"

pytestmark = pytest.mark.skipif(os.name == "nt", reason="fake programs are scripts of a shell")


@pytest.fixture
def fake_blender(tmp_path, monkeypatch):
    """Makes a program that tells a version and otherwise runs Python code; its name is in the environment."""

    def make(code="", version="Blender 4.5.1 LTS", name="blender"):
        folder = tmp_path / "programs"
        folder.mkdir(exist_ok=True)
        program = folder / name
        script = folder / f"{name}.py"
        lines = (
            "import json, sys, time",
            "from pathlib import Path",
            "if sys.argv[1:] == ['--version']:",
            f"    print({version!r})",
            "    sys.exit()",
            "request = json.loads(sys.argv[-1])",
            "out = Path(request['out'])",
            code,
        )
        script.write_text("\n".join(lines))
        program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -I {shlex.quote(str(script))} "$@"\n')
        program.chmod(0o755)
        monkeypatch.setenv(VARIABLE, str(program))
        return program

    return make


@pytest.fixture
def no_blender(monkeypatch, tmp_path):
    """A machine without Blender."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("lippmann.scene.readers.blend.find_blender._usual_places", list)
    monkeypatch.setattr("lippmann.scene.readers.blend.find_blender._has_module", lambda: False)


@pytest.fixture
def blend(tmp_path):
    """A file that begins as Blender's do."""
    path = tmp_path / "model.blend"
    path.write_bytes(b"BLENDER-v405REND")
    return path


@pytest.fixture(scope="session")
def real_blender(tmp_path_factory):
    """The path of a real Blender, or of one made of its module; else the test is skipped."""
    python = os.environ.get(BPY_PYTHON)
    if python:
        program = tmp_path_factory.mktemp("blender") / "blender"
        script = shlex.quote(str(HERE / "blender_by_bpy.py"))
        program.write_text(f'#!/bin/sh\nexec {shlex.quote(python)} -P {script} "$@"\n')
        program.chmod(0o755)
        return str(program)
    try:
        program = find_blender("tests")
    except SceneError:
        pytest.skip("no Blender of version 4.2 or newer is installed")
    if program is None:
        pytest.skip(f"no program of Blender's; {BPY_PYTHON} may name a Python that has bpy")
    return program


@pytest.fixture(scope="session")
def real_scenes(real_blender, tmp_path_factory):
    """Folder of the files that ``make_scenes.py`` makes."""
    folder = tmp_path_factory.mktemp("scenes")
    command = [real_blender, "--background", "--factory-startup", "--disable-autoexec"]
    script = ["--python-exit-code", "1", "--python", str(HERE / "make_scenes.py"), "--", str(folder)]
    subprocess.run([*command, *script], check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    return folder


@pytest.fixture(scope="session")
def read_real(real_blender, real_scenes):
    """Reads one of those files, once."""

    @functools.cache
    def read(name):
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv(VARIABLE, real_blender)
            return read_blend(real_scenes / name)

    return read
