"""OpenVDB's Python module is found where it is installed, else inside Blender's wheel, which is not imported."""

import sys

import pytest

from lippmann.scene.readers.volumes.vdb_module import find_module


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A place of modules that is the only one."""
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    for name in ("bpy", "openvdb", "pyopenvdb"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return tmp_path


def write(path, text=""):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("place", "name"),
    [("5.0/python/lib/python3.11/site-packages", "openvdb"), ("4.2/python/lib/site-packages", "pyopenvdb")],
)
def test_the_module_inside_blenders_wheel_is_found(installed, place, name):
    write(installed / "bpy" / "__init__.py", "raise SystemExit('was imported')")
    bundled = write(installed / "bpy" / place / f"{name}.py")
    assert find_module().origin == str(bundled)
    own = write(installed / "pyopenvdb.py")
    assert find_module().origin == str(own)


def test_without_one_there_is_none(installed):
    assert find_module() is None
    write(installed / "bpy" / "__init__.py")
    assert find_module() is None
