"""The stereo pairs of HEIF files, spatial photographs; they are read alone, since libheif writes no groups."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lippmann.codecs.photograph import Photograph
from lippmann.errors import PictureError
from lippmann.runtime.machine import check_input
from lippmann.runtime.optional_import import check_installed
from lippmann.scene.readers.heif.photo import BYTES_PER_PIXEL, open_pictures, profile_of


def read_heif_pair(path: Path) -> tuple[Photograph, Photograph] | None:
    """The left and the right view, which a group ``ster`` names in this order (ISO/IEC 23008-12); None without one.

    Raises
    ------
    PictureError
        The file is damaged.
    SceneError
        ``pillow-heif`` is not installed.
    MemoryLimitError
        Its pixels take more than the memory that is left.
    """
    check_installed("pillow_heif", "heif", "HEIF pictures need it", str(path))
    try:
        file = open_pictures(path)
        groups = [group["images"][:2] for group in file.info.get("entity_groups", ()) if group["type"] == "ster"]
        if not groups:
            return None
        left, right = (file[number] for number in groups[0])
        for each in (left, right):
            check_input(BYTES_PER_PIXEL * each.size[0] * each.size[1], "a view of the pair", where=str(path))
        (first, icc), (second, other_icc) = ((np.array(each), profile_of(each.info)) for each in (left, right))
    except (ValueError, RuntimeError, EOFError, KeyError, IndexError, TypeError) as error:
        raise PictureError(f"cannot be decoded ({error})", where=str(path), rule="a HEIF picture") from None
    return Photograph.of_codes(first, icc), Photograph.of_codes(second, other_icc)


def has_depth(path: Path) -> bool:
    """Whether a HEIF file that can be read is a photograph with depth."""
    return bool(open_pictures(path).info.get("depth_images"))
