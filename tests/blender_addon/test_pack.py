"""The packed add-on: its files, its manifest, and that the same sources give the same bytes."""

import ast
import subprocess
import sys
import zipfile
from pathlib import Path

try:
    import tomllib
except ModuleNotFoundError:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]


def test_the_same_sources_give_the_same_bytes(packer, packed, tmp_path):
    for path in packer.contents().values():
        path.touch()
    again = packer.pack(tmp_path)
    assert (again.name, again.read_bytes()) == (packed.name, packed.read_bytes())


def test_the_script_tells_where_it_lies(tmp_path):
    command = [sys.executable, str(ROOT / "scripts" / "pack_addon.py"), str(tmp_path / "dist")]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert zipfile.is_zipfile(told.strip())


def test_the_manifest(packed):
    with zipfile.ZipFile(packed) as file:
        assert file.testzip() is None
        manifest = tomllib.loads(file.read("blender_manifest.toml").decode())
    assert manifest["schema_version"] == "1.0.0"
    assert (manifest["id"], manifest["type"]) == ("lippmann", "add-on")
    assert manifest["blender_version_min"] == "4.2.0"
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert packed.name == f"lippmann-blender-{manifest['version']}.zip"
    # Blender refuses taglines and permissions that are long or end in a stop.
    for line in (manifest["tagline"], *manifest["permissions"].values()):
        assert len(line) <= 64
        assert line[-1].isalnum()
    assert set(manifest["permissions"]) <= {"files", "network", "clipboard", "camera", "microphone"}


def test_the_license_is_whole(packed):
    with zipfile.ZipFile(packed) as file:
        text = file.read("LICENSE").decode()
    assert text.startswith("SPDX-License-Identifier: GPL-3.0-or-later\n")
    assert "GNU GENERAL PUBLIC LICENSE\n                       Version 3, 29 June 2007" in text
    assert "END OF TERMS AND CONDITIONS" in text


#: Beside the standard library, what Blender's own Python has.
_BLENDERS = {"bpy", "mathutils", "numpy"}


def test_it_holds_every_module_that_it_imports_and_nothing_of_lippmann(packed):
    with zipfile.ZipFile(packed) as file:
        names = set(file.namelist())
        sources = {name: file.read(name).decode() for name in names if name.endswith(".py")}
    assert {"__init__.py", "in_blender/__init__.py", "LICENSE", "README.md"} <= names
    for name, source in sources.items():
        folder = name.rpartition("/")[0]
        for node in ast.walk(ast.parse(source, name, feature_version=(3, 11))):
            if isinstance(node, ast.ImportFrom) and node.level == 1:
                module = "/".join(filter(None, (folder, *node.module.split("."))))
                assert f"{module}.py" in names
            elif isinstance(node, ast.ImportFrom):
                assert node.module.partition(".")[0] in {*sys.stdlib_module_names, *_BLENDERS}
            elif isinstance(node, ast.Import):
                assert {each.name.partition(".")[0] for each in node.names} <= {*sys.stdlib_module_names, *_BLENDERS}
