"""Display, placement and provenance as one JSON text, for files of other tools' layouts.

The text is the metadata of a picture file with one more member, ``layout``. It has a key of its own, so that no
reader mistakes a light field for the native picture of the display.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from lippmann.errors import PictureError
from lippmann.image.metadata import KEY, Metadata, from_dict, parse_json
from lippmann.runtime.regular_file import check_kind, unreadable

#: Keyword of the PNG text and name of the MATLAB variable that hold the JSON.
TEXT_KEY = "lippmann_light_field"

#: Name of the file that holds the JSON in a folder.
FILE = "lippmann.json"


def to_note(metadata: Metadata | None, layout: str) -> str:
    """JSON text of the metadata and of the layout's name; empty if there is no metadata."""
    if metadata is None:
        return ""
    return json.dumps({**metadata.to_dict(), "layout": layout}, allow_nan=False, separators=(",", ":"))


def from_note(text: str, layout: str, where: str) -> Metadata | None:
    """Metadata of the JSON text of a light field; None if the text is empty. ``where`` names the file in messages.

    Raises
    ------
    PictureError
        If the text is no such JSON, names another layout, or holds invalid values.
    """
    if not text:
        return None
    values: Any = parse_json(text)
    if not isinstance(values, dict) or KEY not in values:
        raise PictureError("the JSON text that describes the display is damaged", where=where)
    if values.get("layout") != layout:
        rule = f"it must be {layout!r}"
        raise PictureError(f"the layout is {values.get('layout')!r}", where=where, rule=rule)
    return from_dict(values, where)


def write_note_file(folder: Path, metadata: Metadata | None, layout: str) -> None:
    """Write the JSON text of the metadata as :data:`FILE` into ``folder``; nothing if there is no metadata."""
    if metadata is not None:
        (folder / FILE).write_text(to_note(metadata, layout) + "\n", encoding="ascii")


def read_note_file(folder: Path, layout: str) -> Metadata | None:
    """Metadata of a folder's :data:`FILE`; None if there is no such file.

    Raises
    ------
    PictureError
        If the file cannot be read, is no such JSON, names another layout, or holds invalid values.
    """
    path = folder / FILE
    try:
        check_kind(path, PictureError)
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    except OSError as error:
        raise unreadable(path, error, PictureError) from error
    except UnicodeDecodeError:
        text = "\0"
    return from_note(text.strip() or "\0", layout, str(path))
