"""Which of the files that are dropped together is the scene."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

from lippmann.errors import SceneError
from lippmann.scene.parsing.dicom_files import holds_dicom
from lippmann.scene.readers.depth_photo import depth_beside
from lippmann.scene.readers.load import kind_of_name
from lippmann.scene.readers.registry import PHOTOS, READERS

#: Endings of pictures of the surroundings.
ENVIRONMENTS = (".hdr", ".exr")

_SLICE = ".dcm"

#: Bytes of a scene file in which names of others are looked for.
_SEARCHED = 1 << 23


def main_file(folder: Path, places: Sequence[Path]) -> Path:
    """The scene among files that were dropped together, from their folder on.

    Several DICOM slices are one scene, their folder. Otherwise it is the scene file that no other one names, nearest to
    the top; photographs are scenes only where there is nothing else, and their depth maps never.

    Raises
    ------
    SceneError
        There is none, or there are several.
    """
    if len(places) == 1:
        return places[0]
    of_photos = {depth_beside(folder / place) for place in places if kind_of_name(place) in PHOTOS}
    known = [place for place in places if READERS.find(kind_of_name(place)) is not None]
    scenes = [place for place in known if folder / place not in of_photos]
    candidates = [place for place in scenes if kind_of_name(place) not in PHOTOS]
    if all(kind_of_name(place) == _SLICE for place in candidates) and holds_dicom(folder):
        tops = {place.parts[0] for place in places}
        return Path(tops.pop()) if len(tops) == 1 else Path()
    candidates = candidates or scenes
    if len(candidates) > 1:
        candidates = [
            place
            for place in candidates
            if not any(_names(folder / each, place) for each in candidates if each != place)
        ]
    top = min((len(place.parts) for place in candidates), default=0)
    candidates = [place for place in candidates if len(place.parts) == top]
    if len(candidates) == 1:
        return candidates[0]
    if not scenes:
        raise SceneError("no scene is among these files", rule=f"known are {', '.join(READERS.claims())}")
    rule = "a scene is dropped with the files that it names"
    if all(kind_of_name(place) in PHOTOS for place in scenes):
        rule = "a photograph is dropped with its depth map, named like it: photo.jpg and photo_depth.png"
    raise SceneError(f"{len(candidates) or len(scenes)} scenes were dropped", rule=rule, fix="drop one")


def _names(path: Path, other: Path) -> bool:
    """Whether a scene file names another one, in text or in percent signs."""
    with path.open("rb") as file:
        text = file.read(_SEARCHED)
    return any(name.encode("utf-8", "surrogateescape") in text for name in (other.name, quote(other.name)))
