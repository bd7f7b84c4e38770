"""Quilts shown on a panel by Looking Glass Bridge, see :mod:`lippmann.display.formats.bridge`."""

from __future__ import annotations

from pathlib import Path

from lippmann.display.formats.bridge import Bridge
from lippmann.json_values import JsonObject
from lippmann.quilts.quilt import Quilt

#: The list of pictures that Bridge plays; each cast takes the place of the one before.
_PLAYLIST = "lippmann"


def cast_quilt(quilt: Quilt, file: Path) -> list[str]:
    """Show a quilt's file on the panels that Bridge finds.

    Bridge reads the file by itself. It is told the quilt's layout, so the name need not say it.

    Returns
    -------
    Serial numbers of the panels.

    Raises
    ------
    DisplayError
        Bridge does not run, or finds no panel.
    """
    bridge = Bridge()
    panels = [panel.display.name for panel in bridge.panels()]
    columns, rows, aspect = quilt.layout
    width, height = quilt.view_size
    bridge.ask("delete_playlist", {"name": _PLAYLIST, "loop": False})
    bridge.ask("instance_playlist", {"name": _PLAYLIST, "loop": True})
    entry: JsonObject = {
        "name": _PLAYLIST,
        "id": 0,
        "index": 0,
        "uri": file.resolve().as_posix(),
        "rows": rows,
        "cols": columns,
        "focus": 0,
        "aspect": aspect or width / height,
        "view_count": quilt.layout.views,
        "isRGBD": 0,
        "tag": "",
    }
    bridge.ask("insert_playlist_entry", entry)
    bridge.ask("play_playlist", {"name": _PLAYLIST, "head_index": -1})
    return panels
