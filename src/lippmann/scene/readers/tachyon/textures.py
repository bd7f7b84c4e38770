"""Texture bodies, named textures and inline images of Tachyon scene files."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Literal, TypedDict

import numpy as np

from lippmann.scene.parsing.tokens import Words
from lippmann.scene.readers.tachyon.files import SceneFiles
from lippmann.scene.values.whitted_surfaces import TEXTURE_KINDS, ClassicImage, ClassicMaterial, ClassicTexture
from lippmann.scene.whitted.builder import ClassicSceneBuilder

DEFAULT_MATERIAL = ClassicMaterial()
"""Material of an undefined texture name: white, ambient 0.1, diffuse 0.9."""

_MOST_NAMES = 5  # in one note
_HEX = re.compile(r"[0-9a-fA-F]+").fullmatch


class _Finish(TypedDict, total=False):
    ambient: float
    diffuse: float
    specular: float
    opacity: float
    raster3d: bool
    outline: float
    outline_width: float
    phong_kind: Literal["plastic", "metal"]
    phong: float
    phong_size: float


class TextureTable:
    """Materials and images by name, and the readers of the phrases that define them.

    ``reserved`` are the words that begin an item: where one stands in place of a name, a word is missing.
    """

    def __init__(self, builder: ClassicSceneBuilder, files: SceneFiles, reserved: Collection[str]) -> None:
        self._builder = builder
        self._files = files
        self._reserved = reserved
        self._textures: dict[str, int] = {}
        self._images: dict[str, int] = {}
        self._remarks: dict[str, dict[str, str]] = {}  # per remark: the names it holds for, and where each was met

    def texture(self, words: Words, holder: Path) -> int:
        """TEX: the name of a texture, or TEXTURE and its body. Returns the material's index."""
        if words.has("TEXTURE"):
            return self.body(words, holder)
        return self._take_named(words)

    def define(self, words: Words, holder: Path) -> None:
        """``TEXDEF name <body>``."""
        name = words.name("a name for the texture")
        self._store(name, self.body(words, holder), words)

    def alias(self, words: Words) -> None:
        """``TEXALIAS newname oldname``."""
        name = words.name("a name for the texture")
        self._store(name, self._take_named(words), words)

    def body(self, words: Words, holder: Path) -> int:
        """A texture body with colour and function."""
        finish = self._finish(words)
        color = words.vector("COLOR")
        return self._builder.material(ClassicMaterial(color=color, texture=self._function(words, holder), **finish))

    def vertex_colored(self, words: Words) -> int:
        """The body of VCSTRI: as others up to the highlight, then VCST in place of colour and function."""
        finish = self._finish(words)
        words.keyword("VCST")
        return self._builder.material(ClassicMaterial(**finish))

    def default(self) -> int:
        """The material of what names no texture at all."""
        return self._builder.material(DEFAULT_MATERIAL)

    def define_image(self, words: Words) -> None:
        """``IMAGEDEF name FORMAT RGB24 RESOLUTION x y z ENCODING HEX <texels>``."""
        name = words.name("a name for the image")
        words.keyword("FORMAT")
        words.keyword("RGB24")
        words.keyword("RESOLUTION")
        size = [words.integer(1, 2**31 - 1) for _ in range(3)]
        width, height, depth = size
        if width * height * depth > words.left:
            raise words.wrong(f"a resolution that the file can fill (only {words.left} words follow)", back=3)
        words.keyword("ENCODING")
        words.keyword("HEX")
        texels = np.array([_hex_color(words) for _ in range(width * height * depth)], np.uint8)
        if name in self._images:
            self._remark("images are defined again; the first ones are kept", name, words.place(back=1))
            return
        image = ClassicImage(name, texels.reshape(depth, height, width, 3))
        self._images[name] = self._builder.image(image)

    def finish(self) -> None:
        """Note assumptions, in one line per kind of remark."""
        for remark, places in self._remarks.items():
            listed = ", ".join(f"'{name}' ({where})" for name, where in islice(places.items(), _MOST_NAMES))
            more = f" and {len(places) - _MOST_NAMES} more" if len(places) > _MOST_NAMES else ""
            self._builder.notes.append(f"{listed}{more}: {remark}")

    def _take_named(self, words: Words) -> int:
        name = words.peek()
        if name in self._textures:
            words.take()
            return self._textures[name]
        if not name or name.upper() in self._reserved:
            raise words.wrong("the name of a texture, or TEXTURE")
        self._remark("textures are not defined before they are used; a white one stands in", name, words.place())
        words.take()
        return self.default()

    def _store(self, name: str, material: int, words: Words) -> None:
        if self._textures.setdefault(name, material) != material:
            self._remark("textures are defined again; the first ones are kept", name, words.place(back=1))

    def _remark(self, remark: str, name: str, where: str) -> None:
        self._remarks.setdefault(remark, {}).setdefault(name, where)

    def _finish(self, words: Words) -> _Finish:
        """From AMBIENT to the highlight: the fields of ClassicMaterial."""
        finish: _Finish = {
            "ambient": words.number("AMBIENT"),
            "diffuse": words.number("DIFFUSE"),
            "specular": words.number("SPECULAR"),
            "opacity": words.number("OPACITY"),
        }
        if words.has("TRANSMODE"):
            words.keyword("R3D")
            finish["raster3d"] = True
        if words.has("OUTLINE"):
            finish["outline"] = words.number()
            finish["outline_width"] = words.number("OUTLINE_WIDTH")
        if words.has("PHONG"):
            kind: Literal["plastic", "metal"] = "metal" if words.has("METAL") else "plastic"
            if kind == "plastic":
                words.keyword("PLASTIC")
            finish["phong_kind"] = kind
            finish["phong"] = words.number()
            finish["phong_size"] = words.radius("PHONG_SIZE")
        return finish

    def _function(self, words: Words, holder: Path) -> ClassicTexture:
        """``TEXFUNC k`` and what belongs to that k."""
        kind = TEXTURE_KINDS[words.integer(0, len(TEXTURE_KINDS) - 1, "TEXFUNC")]
        if kind == "constant":
            return ClassicTexture()
        image = self._image(words, holder) if kind.endswith("image") else None
        center, rotate, scale = words.vector("CENTER"), words.vector("ROTATE"), words.vector("SCALE")
        if kind == "wood" and not all(scale):
            raise words.wrong("a scale without 0 (wood divides by it)", back=3)
        texture = ClassicTexture(kind, center, rotate, scale, image=image)
        if kind in ("planar-image", "volume-image"):
            texture = replace(texture, u_axis=words.vector("UAXIS"), v_axis=words.vector("VAXIS"))
        if kind == "volume-image":
            texture = replace(texture, w_axis=words.vector("WAXIS"))
        return texture

    def _image(self, words: Words, holder: Path) -> int:
        """Index of the image of that name: an inline one, or a file, read once."""
        name = words.peek()
        if name in self._images:
            words.take()
            return self._images[name]
        if not name or name.upper() in self._reserved or name.upper() == "CENTER":
            raise words.wrong("the name of an image")
        where = words.place()
        if name.startswith("::"):  # by convention the name of an inline image, which no file can be meant by
            self._remark("images are not defined before they are used; a white one stands in", name, where)
            image = ClassicImage(name, np.full((1, 4, 4, 3), 255, np.uint8))
        else:
            path = self._files.find(name, holder, where=where, what="picture")
            image = self._files.picture(path, name, where=where)
        words.take()
        self._images[name] = self._builder.image(image)
        return self._images[name]


_KEEP_8_BITS: dict[int, Callable[[int], int]] = {
    1: lambda value: value * 17,
    2: lambda value: value,
    3: lambda value: value >> 4,
    4: lambda value: value >> 8,
}


def _hex_color(words: Words) -> tuple[int, int, int]:
    """Three hexadecimal numbers of one to four digits, run together, as 8-bit values."""
    word = words.peek()
    digits = len(word) // 3
    if len(word) % 3 or digits not in _KEEP_8_BITS or not _HEX(word):
        raise words.wrong("a colour of 3, 6, 9 or 12 hexadecimal digits")
    words.take()
    keep = _KEEP_8_BITS[digits]
    red, green, blue = (keep(int(word[i * digits : (i + 1) * digits], 16)) for i in range(3))
    return red, green, blue
