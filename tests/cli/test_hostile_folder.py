"""Commands started in a folder of somebody else's: nothing that lies there is loaded, imported or followed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PLUGINS = ("sphere", "merge", "path", "constant", "envmap", "diffuse", "hdrfilm", "perspective", "principled", "bitmap")
#: The first modules that programs of ours and what they use import by name.
MODULES = ("socket", "random", "numpy", "lippmann", "mitsuba", "ctypes", "json", "yaml", "site", "sitecustomize")
XML = '<scene version="3.0.0"><shape type="sphere"/><emitter type="constant"/></scene>'


@pytest.fixture
def folder(tmp_path) -> Path:
    """A folder of traps. No library can be loaded from a text, and so a command that tries to fails."""
    (tmp_path / "plugins").mkdir()
    for name in PLUGINS:
        (tmp_path / "plugins" / f"{name}.so").write_text("no library")
    for name in MODULES:
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'marker')!r}, 'w')")
    (tmp_path / "scene.xml").write_text(XML)
    return tmp_path


def lippmann(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    program = Path(sys.executable).with_name("lippmann")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}
    return subprocess.run(
        [program, *words], cwd=folder, capture_output=True, text=True, timeout=300, check=False, env=environment
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("doctor",),
        pytest.param(("preview", "teapot", "--pixels", "16x16", "--spp", "1", "-o", "x.png"), marks=pytest.mark.long),
        pytest.param(
            ("preview", "scene.xml", "--plain", "--pixels", "16x16", "--spp", "1", "-o", "x.png"),
            marks=pytest.mark.long,
        ),
    ],
    ids=("doctor", "bundled scene", "scene file"),
)
def test_nothing_of_the_folder_is_loaded(folder, words):
    run = lippmann(folder, *words)
    assert run.returncode == 0, run.stderr
    assert not (folder / "marker").exists()


def test_a_library_is_asked_for_its_version_elsewhere(folder, monkeypatch):
    """A library that does not name its version is loaded by a child process, which imports ``ctypes``."""
    from lippmann.runtime import llvm

    monkeypatch.chdir(folder)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    assert llvm._ask(folder / "plugins" / "sphere.so") == ()
    assert not (folder / "marker").exists()


@pytest.mark.slow
def test_settings_of_the_compiler_are_not_taken_from_the_folder(folder):
    (folder / ".numba_config.yaml").write_text("cache_dir: kernels\n")
    run = lippmann(
        folder, "render", "teapot", "--display", "seed-lenticular", "--method", "lens-view", "--spp", "1", "-o", "x.png"
    )
    assert run.returncode == 2
    assert run.stderr.startswith("lippmann: .numba_config.yaml: would set up Numba; files of the working directory")
    assert not (folder / "kernels").exists()
