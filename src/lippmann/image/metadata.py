"""Metadata of picture files: display, placement and provenance as one JSON text."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

from lippmann.display import Display
from lippmann.errors import LippmannError, PictureError
from lippmann.image.picture import Picture, Provenance, checked_placement
from lippmann.image.stored_values import Matrix

#: Version of this text; rises when a known name changes its meaning.
VERSION = 1

#: The key that holds the version and marks the JSON as ours.
KEY = "lippmann"

#: The key that marks the metadata of a quilt, which is no picture of a panel.
QUILT_KEY = "quilt"


@dataclass(frozen=True, eq=False)
class Metadata:
    """Everything that a picture file carries beside the pixels.

    Parameters
    ----------
    display:
        Display of the picture.
    world_from_display:
        ``(4, 4)`` similarity from the display frame (mm) to the scene.
    provenance:
        How the picture was made.
    """

    display: Display
    world_from_display: Matrix
    provenance: Provenance

    def to_dict(self) -> dict[str, object]:
        """JSON-able values, with the version; without seconds, so that the same picture gives the same file."""
        provenance = self.provenance.to_dict()
        del provenance["seconds"]
        return {
            KEY: VERSION,
            "display": self.display.to_dict(),
            "world_from_display": self.world_from_display.tolist(),
            "provenance": provenance,
        }


def metadata_of(picture: Picture) -> Metadata:
    """Display, placement and provenance of a picture."""
    return Metadata(picture.display, picture.world_from_display, picture.provenance)


def to_text(metadata: Metadata) -> str:
    """ASCII JSON of the metadata, for :func:`from_text`; numbers come back exactly."""
    return json.dumps(metadata.to_dict(), allow_nan=False, separators=(",", ":"))


def from_text(text: str, where: str) -> Metadata | None:
    """Metadata of a text by :func:`to_text`; None for any other text, such as a quilt's.

    Raises
    ------
    PictureError
        If a value makes no sense, or the text is of a later version; names ``where``.
    """
    values = parse_json(text)
    if not isinstance(values, dict) or KEY not in values or QUILT_KEY in values:
        return None
    return from_dict(values, where)


def is_quilt_text(text: str) -> bool:
    """Whether a text is the metadata of a quilt."""
    values = parse_json(text) if text else None
    return isinstance(values, dict) and KEY in values and QUILT_KEY in values


def parse_json(text: str) -> object:
    """Value of a JSON text; None if it is no JSON. NaN and infinities are no JSON."""
    try:
        value: object = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError):
        return None
    return value


def from_dict(values: Mapping[str, object], where: str) -> Metadata:
    """Metadata of the values of :meth:`Metadata.to_dict`.

    Raises
    ------
    PictureError
        If a value makes no sense, or the values are of a later version; names ``where``.
    """
    version = values.get(KEY)
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise PictureError(f"its metadata has the version {version!r}", where=where, rule="it must be a whole number")
    if version > VERSION:
        what, rule = f"its metadata has the version {version}", f"up to {VERSION} is read"
        raise PictureError(what, where=where, rule=rule, fix="get a newer Lippmann")
    try:
        display = Display.from_dict(values.get("display"))  # type: ignore[arg-type]  # it refuses what is no mapping
        matrix = checked_placement(values.get("world_from_display"))
        provenance = Provenance.from_dict(values.get("provenance"))
    except LippmannError as error:
        what = f"{error.where}: {error.what}" if error.where else error.what
        raise PictureError(f"its metadata makes no sense: {what}", where=where, rule=error.rule) from error
    if not isinstance(display.name, str) or not isinstance(display.title, str):
        raise PictureError("its metadata makes no sense: the display's name is no text", where=where)
    return Metadata(display, matrix, provenance)


def _refuse_constant(name: str) -> None:
    raise ValueError(name)
