"""What a picture file says of itself: display, placement and provenance as one JSON text."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.errors import LippmannError, PictureError
from lippmann.image.picture import Picture
from lippmann.image.provenance import Provenance
from lippmann.image.stored_values import checked_similarity

#: The version of this text. It rises when a name that readers know changes its meaning.
VERSION = 1

#: The key that holds the version and marks the JSON as ours.
KEY = "lippmann"


@dataclass(frozen=True, eq=False)
class Metadata:
    """The parts of a picture that are not pixels."""

    display: Display
    world_from_display: NDArray[np.float64]
    provenance: Provenance

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, with the version.

        Seconds are left out: the same picture rendered again is the same file.
        """
        made = self.provenance.to_dict()
        del made["seconds"]
        return {
            KEY: VERSION,
            "display": self.display.to_dict(),
            "world_from_display": self.world_from_display.tolist(),
            "provenance": made,
        }


def metadata_of(picture: Picture) -> Metadata:
    """The parts of a picture that are not pixels."""
    return Metadata(picture.display, picture.world_from_display, picture.provenance)


def to_text(metadata: Metadata) -> str:
    """ASCII JSON; numbers come back exactly."""
    return json.dumps(metadata.to_dict(), allow_nan=False, separators=(",", ":"))


def from_text(text: str, where: str) -> Metadata | None:
    """The metadata of :func:`to_text`; None if the text is something else.

    Raises
    ------
    PictureError
        If it is a text of ours whose values make no sense, or of a later version; names ``where``.
    """
    values = parse_json(text)
    if not isinstance(values, dict) or KEY not in values:
        return None
    return from_dict(values, where)


def parse_json(text: str) -> Any:
    """The value of a JSON text, or None if it is none; NaN and infinities, which JSON does not have, count as none."""
    try:
        return json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError):
        return None


def from_dict(values: dict[str, Any], where: str) -> Metadata:
    """The metadata of :meth:`Metadata.to_dict`; raises as :func:`from_text` does."""
    version = values.get(KEY)
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise PictureError(f"its metadata has the version {version!r}", where=where, rule="it must be a whole number")
    if version > VERSION:
        fix = "get a newer Lippmann"
        raise PictureError(
            f"its metadata has the version {version}", where=where, rule=f"up to {VERSION} is read", fix=fix
        )
    try:
        display = Display.from_dict(values.get("display"))  # type: ignore[arg-type]  # it refuses what is no mapping
        matrix = checked_similarity(values.get("world_from_display"))
        provenance = Provenance.from_dict(values.get("provenance"))
    except LippmannError as error:
        what = f"{error.where}: {error.what}" if error.where else error.what
        raise PictureError(f"its metadata makes no sense: {what}", where=where, rule=error.rule) from error
    if not isinstance(display.name, str) or not isinstance(display.title, str):
        raise PictureError("its metadata makes no sense: the display's name is no text", where=where)
    return Metadata(display, matrix, provenance)


def _refuse_constant(name: str) -> None:
    raise ValueError(name)
