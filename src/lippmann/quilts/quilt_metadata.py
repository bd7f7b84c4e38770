"""Metadata of quilt files: layout, display and provenance as one JSON text."""

from __future__ import annotations

import json
from typing import NamedTuple

from lippmann.display import Display
from lippmann.errors import LippmannError, PictureError
from lippmann.image.metadata import KEY, QUILT_KEY, VERSION, Provenance, parse_json
from lippmann.quilts.quilt import Quilt, QuiltLayout, checked_layout


class QuiltMetadata(NamedTuple):
    """A quilt's metadata, as its file holds them.

    Attributes
    ----------
    layout:
        Columns, rows and aspect ratio.
    display:
        The display that the views are for; None if unknown.
    provenance:
        How the quilt was made.
    """

    layout: QuiltLayout
    display: Display | None
    provenance: Provenance


def quilt_text(quilt: Quilt) -> str:
    """ASCII JSON of a quilt's metadata, for :func:`metadata_of_text`."""
    provenance = quilt.provenance.to_dict()
    del provenance["seconds"]  # the same quilt gives the same file
    values = {
        KEY: VERSION,
        QUILT_KEY: quilt.layout._asdict(),
        "display": None if quilt.display is None else quilt.display.to_dict(),
        "provenance": provenance,
    }
    return json.dumps(values, allow_nan=False, separators=(",", ":"))


def layout_text(layout: QuiltLayout) -> str:
    """ASCII JSON of a layout alone, for :func:`metadata_of_text`: of files whose quilts have many displays or none."""
    values = {KEY: VERSION, QUILT_KEY: layout._asdict(), "display": None, "provenance": {}}
    return json.dumps(values, allow_nan=False, separators=(",", ":"))


def metadata_of_text(text: str, where: str) -> QuiltMetadata | None:
    """Metadata of a text by :func:`quilt_text`; None for any other text.

    Raises
    ------
    PictureError
        If a value makes no sense, or the text is of a later version; names ``where``.
    """
    values = parse_json(text) if text else None
    if not isinstance(values, dict) or KEY not in values or QUILT_KEY not in values:
        return None
    if values[KEY] != VERSION:
        rule = f"version {VERSION} is read"
        raise PictureError(f"its metadata has the version {values[KEY]!r}", where=where, rule=rule)
    layout = _layout(values[QUILT_KEY], where)
    try:
        display = None if values.get("display") is None else Display.from_dict(values["display"])
        provenance = Provenance.from_dict(values.get("provenance"))
    except LippmannError as error:
        raise PictureError(f"its metadata makes no sense: {error.what}", where=where, rule=error.rule) from error
    return QuiltMetadata(layout, display, provenance)


def _layout(values: object, where: str) -> QuiltLayout:
    if isinstance(values, dict):
        columns, rows, aspect = (values.get(name) for name in QuiltLayout._fields)
        if isinstance(columns, int) and isinstance(rows, int) and isinstance(aspect, (int, float, type(None))):
            return checked_layout(columns, rows, aspect, where=where)
    raise PictureError(f"its metadata says the layout {values!r}", where=where, rule="columns, rows and aspect")
