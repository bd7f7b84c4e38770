"""Packs the add-on for Blender into ``dist/lippmann-blender-VERSION.zip``: the same bytes from the same sources.

python scripts/pack_addon.py [FOLDER]
"""

from __future__ import annotations

import re
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ADDON = ROOT / "blender_addon"
#: Runs inside Blender for ``.blend`` files, too.
EXPORT = ROOT / "src" / "lippmann" / "scene" / "readers" / "blend" / "in_blender"

_SUFFIXES = (".py", ".toml", ".md")
#: The earliest time that a zip file can tell, so that it tells nothing of when it was made.
_TIME = (1980, 1, 1, 0, 0, 0)
_MODE = 0o644 << 16


def main() -> int:
    """Pack it, and print where it lies."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "dist"
    print(pack(folder))
    return 0


def pack(folder: Path) -> Path:
    """Write the zip file into a folder, which is made if need be."""
    found = re.search(r'^version = "([0-9.]+)"$', (ADDON / "blender_manifest.toml").read_text("utf-8"), re.MULTILINE)
    assert found is not None
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"lippmann-blender-{found[1]}.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as packed:
        for name, source in sorted(contents().items()):
            entry = zipfile.ZipInfo(name, _TIME)
            entry.compress_type, entry.external_attr, entry.create_system = zipfile.ZIP_DEFLATED, _MODE, 3
            packed.writestr(entry, source.read_bytes())
    return path


def contents() -> dict[str, Path]:
    """The files of the add-on, by their names in it."""
    own = [path for path in ADDON.iterdir() if path.suffix in _SUFFIXES or path.name == "LICENSE"]
    shared = [path for path in EXPORT.iterdir() if path.suffix == ".py"]
    return {path.name: path for path in own} | {f"in_blender/{path.name}": path for path in shared}


if __name__ == "__main__":
    raise SystemExit(main())
