"""Files that a Blender file names beside itself."""

from __future__ import annotations

from pathlib import Path

import bpy


def first_outside(folder: Path) -> str | None:
    """The first picture, library or other file in use that lies outside a folder; None if there is none."""
    own = Path(bpy.utils.resource_path("LOCAL")).resolve()
    used: list[str] = [library.filepath for library in bpy.data.libraries if library.packed_file is None]
    used += [
        image.filepath
        for image in bpy.data.images
        if image.source in ("FILE", "SEQUENCE", "MOVIE", "TILED") and not image.packed_files and image.library is None
    ]
    others = [*bpy.data.volumes, *bpy.data.fonts, *bpy.data.cache_files]
    used += [other.filepath for other in others if getattr(other, "packed_file", None) is None]
    for name in used:
        if not name or name == "<builtin>":
            continue
        path = Path(bpy.path.abspath(name)).resolve()
        if path.is_dir():  # a volume without a file
            continue
        if not path.is_relative_to(folder) and not path.is_relative_to(own):
            return name
    return None
