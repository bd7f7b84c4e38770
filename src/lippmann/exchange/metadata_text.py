"""What a file of another tool's layout says of our own: display, placement and provenance as one JSON text.

The text is that of our picture files with one name more, ``layout``. It lies under a key of its own: a reader of
pictures must not take a light field for the native picture of the display that it names.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from lippmann.errors import PictureError
from lippmann.image.metadata import KEY, Metadata, from_dict, parse_json

#: Keyword of a PNG's text, name of a variable and of an attribute that hold the JSON.
TEXT_KEY = "lippmann_light_field"

#: The file that holds it in a folder.
FILE = "lippmann.json"


def to_note(metadata: Metadata | None, layout: str) -> str:
    """The text; of a light field that knows nothing of itself, empty."""
    if metadata is None:
        return ""
    return json.dumps({**metadata.to_dict(), "layout": layout}, allow_nan=False, separators=(",", ":"))


def from_note(text: str, layout: str, where: str) -> Metadata | None:
    """The metadata of :func:`to_note`; None of an empty text.

    Raises
    ------
    PictureError
        If the text is something else, speaks of another layout, or its values make no sense.
    """
    if not text:
        return None
    values: Any = parse_json(text)
    if not isinstance(values, dict) or KEY not in values:
        raise PictureError("what it says of its display makes no sense", where=where)
    if values.get("layout") != layout:
        rule = f"it must be {layout!r}"
        raise PictureError(f"the layout is {values.get('layout')!r}", where=where, rule=rule)
    return from_dict(values, where)


def write_note_file(folder: Path, metadata: Metadata | None, layout: str) -> None:
    """Write the text into a folder, if there is any."""
    if metadata is not None:
        (folder / FILE).write_text(to_note(metadata, layout) + "\n", encoding="ascii")


def read_note_file(folder: Path, layout: str) -> Metadata | None:
    """The metadata of a folder; None if it has none. Raises as :func:`from_note`."""
    path = folder / FILE
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    except OSError as error:
        raise PictureError(f"cannot be read: {error.strerror}", where=str(path)) from error
    except UnicodeDecodeError:
        text = "\0"
    return from_note(text.strip() or "\0", layout, str(path))
