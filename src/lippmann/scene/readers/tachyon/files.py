"""Files that a Tachyon scene names: where they may lie, and pictures as rows of texels."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import NamedFiles, decode_image, read_bytes
from lippmann.scene.parsing.tokens import Words
from lippmann.scene.values.whitted_surfaces import ClassicImage

_MOST_WORDS = 20_000_000
_MOST_TEXELS = 1 << 27


class SceneFiles:
    """Finds and reads files beside the scene.

    A name counts from the folder of the file that holds it, then from the folder of the scene itself (Tachyon knows
    the working directory alone). What all named files together may hold is limited, because a short scene can name a
    long file many times.
    """

    def __init__(self, named: NamedFiles) -> None:
        self._named, self.folder = named, named.folder
        self._words_left = _MOST_WORDS
        self._texels_left = _MOST_TEXELS

    def find(self, name: str, holder: Path, *, where: str, what: str) -> Path:
        """The file that ``name`` means in the file ``holder``.

        Raises
        ------
        SceneError
            It is not found, or lies outside; ``where`` is the place that names it, ``what`` the kind of file.
        """
        try:
            beside = holder.parent != self.folder and (holder.parent / name).is_file()
        except (OSError, ValueError):  # no name of a file, as the look-up will say
            beside = False
        if beside:
            name = os.path.relpath(holder.parent / name, self.folder)
        return self._named.find(name, where=where, what=what)

    def relative_name(self, path: Path) -> str:
        """A file's name as errors give it: seen from the scene's folder."""
        return Path(os.path.relpath(path, self.folder)).as_posix()

    def words(self, path: Path, *, comment: re.Pattern[str], where: str) -> Words:
        """The words of a text file that is named at ``where``.

        Raises
        ------
        SceneError
            The file is unreadable, empty or not text, or one file too many.
        """
        words = Words.of_file(path, self.relative_name(path), comment=comment, single=True)
        self._words_left -= words.left
        if self._words_left < 0:
            raise SceneError(
                f"'{self.relative_name(path)}' is one file too many",
                where=where,
                rule=f"at most {_MOST_WORDS} words in all",
            )
        return words

    def picture(self, path: Path, name: str, *, where: str) -> ClassicImage:
        """The picture that is named at ``where``; see :func:`read_picture`."""
        image = read_picture(path, name, where=where)
        self._texels_left -= image.texels[..., 0].size
        if self._texels_left < 0:
            raise SceneError(
                f"picture '{name}' is one too many", where=where, rule=f"at most {_MOST_TEXELS} texels in all"
            )
        return image


def read_picture(path: Path, name: str, *, where: str) -> ClassicImage:
    """A PPM, JPEG, PNG or TGA picture as an image of depth 1.

    Row 0 (v = 0) is the top row of a PPM or JPEG picture and the bottom row of a TGA or PNG one, as in Tachyon. Values
    are taken as stored; transparency is dropped.

    Raises
    ------
    SceneError
        Another format, or a damaged file.
    """
    data = read_bytes(path)
    top_first = data[:2] in (b"P3", b"P6") or data.startswith(b"\xff\xd8\xff")
    if not top_first and not data.startswith(b"\x89PNG") and path.suffix.lower() != ".tga":
        raise SceneError(
            f"picture '{name}' is of a format that Tachyon does not read", where=where, rule="PPM, TGA, JPEG or PNG"
        )
    pixels = decode_image(data, name, where=where).pixels
    if pixels.dtype != np.uint8:
        pixels = np.round(np.asarray(pixels, np.float64) * 255.0).astype(np.uint8)
    rgb = np.repeat(pixels, 3, axis=-1) if pixels.shape[-1] == 1 else pixels[..., :3]
    rows = rgb if top_first else rgb[::-1]
    return ClassicImage(name, np.ascontiguousarray(rows[None], dtype=np.uint8))
