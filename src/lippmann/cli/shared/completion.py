"""Names that the shell offers for half-typed ones."""

from __future__ import annotations

from pathlib import Path

#: Endings of files that hold scenes, and displays.
_SCENES = (".blend", ".glb", ".gltf", ".obj", ".off", ".ply", ".stl", ".xml", ".dat", ".nff")
_DISPLAYS = (".toml", ".json")


def complete_displays(incomplete: str) -> list[str]:
    """Names of bundled displays, and of files that may describe one."""
    from lippmann.display import list_displays

    names = [display.name for display in list_displays() if display.name.startswith(incomplete)]
    return [*names, *_files(incomplete, _DISPLAYS)]


def complete_scenes(incomplete: str) -> list[str]:
    """Names of bundled scenes, and of files that may hold one."""
    from lippmann.scene import bundled

    return [name for name in bundled.names() if name.startswith(incomplete)] + _files(incomplete, _SCENES)


def _files(incomplete: str, endings: tuple[str, ...]) -> list[str]:
    """Folders and files that begin so."""
    given = Path(incomplete)
    folder = given if incomplete.endswith("/") else given.parent
    try:
        paths = sorted(path for path in folder.iterdir() if str(path).startswith(str(given) if incomplete else ""))
    except OSError:
        return []
    folders = [f"{path}/" for path in paths if path.is_dir()]
    return [*(str(path) for path in paths if path.suffix.lower() in endings), *folders]
