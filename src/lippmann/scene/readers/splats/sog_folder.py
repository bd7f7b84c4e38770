"""The unbundled form of SOG: a folder of pictures with a meta.json, which other formats name their files, too."""

from __future__ import annotations

from pathlib import Path

from lippmann.scene.parsing.files import read_bytes

META = "meta.json"

#: Parts that every such file has, and the bytes in which they are looked for: those of its largest tables.
_PARTS = (b'"means"', b'"quats"', b'"sh0"')
_SEARCHED = 1 << 18


def holds_sog(path: Path) -> bool:
    """Whether a path is such a folder, or the JSON file in it.

    Raises
    ------
    SceneError
        The file cannot be read.
    """
    meta = path / META if path.is_dir() else path
    if meta.suffix.lower() != ".json" or not meta.is_file():
        return False
    head = read_bytes(meta, _SEARCHED)
    return all(part in head for part in _PARTS)
