"""Textures, samplers and images; each image is decoded once and shared."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from lippmann.codecs.ktx2 import IDENTIFIER, Ktx2Error, decode_ktx2
from lippmann.errors import SceneError
from lippmann.scene.parsing.files import MissingFileError, decode_image
from lippmann.scene.readers.gltf.buffers import Buffers, read_uri
from lippmann.scene.readers.gltf.document import BASISU, Document, texture_extension_is_readable
from lippmann.scene.readers.gltf.json_fields import Fields
from lippmann.scene.values.description import Filter, Image, Matrix, Texture, Wrap

_WRAPS: dict[int, Wrap] = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
_REPEAT = 10497
_FILTERS: dict[int, Filter] = {9728: "nearest", 9729: "linear"}
_LINEAR = 9729
_MOST_UV_SETS = 8


@dataclass(frozen=True, eq=False)
class Textures:
    """The textures of a document."""

    document: Document
    buffers: Buffers
    _images: dict[int, Image] = field(default_factory=dict)
    _files: dict[str, Image] = field(default_factory=dict)

    def read(self, owner: Fields, key: str, *, srgb: bool = False) -> Texture | None:
        """The texture that member ``key`` of a material points to; None without one, or, with a note, without its file.

        Parameters
        ----------
        srgb:
            Whether the values are sRGB-coded, which the use fixes, not the file.

        Raises
        ------
        SceneError
            A reference leads nowhere, or the image is damaged.
        """
        info = owner.child(key)
        if info is None:
            return None
        index = self.document.required_reference(info, "index", "textures")
        fields = self.document.all("textures")[index]
        source = self._source(fields)
        if source is None:
            self.document.notes.add("a texture has no image that is understood and is left out", fields.place)
            return None
        try:
            image = self._image(source)
        except MissingFileError as error:
            self.document.notes.add(f"{error.what}: shown without it", fields.place)
            return None
        wrap_u, wrap_v, texel_filter = self._sampler(fields)
        transform = info.extension("KHR_texture_transform")
        # Blender 5.3 writes -1 where a mesh has no coordinates.
        uv_set = 0 if info.values.get("texCoord") == -1 else info.optional_integer("texCoord") or 0
        if transform is not None and transform.has("texCoord"):
            uv_set = transform.integer("texCoord")
        if uv_set >= _MOST_UV_SETS:
            raise info.error("texCoord", f"up to {_MOST_UV_SETS} sets of texture coordinates are understood")
        return Texture(
            image=image,
            srgb=srgb,
            wrap_u=wrap_u,
            wrap_v=wrap_v,
            filter=texel_filter,
            uv_transform=np.eye(3) if transform is None else _uv_transform(transform),
            uv_set=uv_set,
        )

    def _source(self, texture: Fields) -> int | None:
        for name in (BASISU, "EXT_texture_webp", "EXT_texture_avif"):
            better = texture.extension(name)
            if better is not None and (name == BASISU or texture_extension_is_readable(name)):
                return self.document.required_reference(better, "source", "images")
        return self.document.reference(texture, "source", "images")

    def _sampler(self, texture: Fields) -> tuple[Wrap, Wrap, Filter]:
        index = self.document.reference(texture, "sampler", "samplers")
        if index is None:
            return "repeat", "repeat", "linear"
        fields = self.document.all("samplers")[index]
        wraps = []
        for key in ("wrapS", "wrapT"):
            code = fields.optional_integer(key)
            if code is not None and code not in _WRAPS:
                raise fields.error(key, f"one of {', '.join(map(str, _WRAPS))} belongs here")
            wraps.append(_WRAPS[_REPEAT if code is None else code])
        magnification = fields.optional_integer("magFilter")
        if magnification is not None and magnification not in _FILTERS:
            raise fields.error("magFilter", f"one of {', '.join(map(str, _FILTERS))} belongs here")
        return wraps[0], wraps[1], _FILTERS[_LINEAR if magnification is None else magnification]

    def _image(self, index: int) -> Image:
        if index not in self._images:
            self._images[index] = self._load(index)
        return self._images[index]

    def _load(self, index: int) -> Image:
        fields = self.document.all("images")[index]
        uri = fields.text("uri")
        if uri is None:
            view = self.document.required_reference(fields, "bufferView", "bufferViews")
            name = fields.text("name") or fields.place
            return _decode(bytes(self.buffers.view(view)[0]), name, self.document.file)
        # Several entries of the list may name one file.
        if uri not in self._files:
            data, name = read_uri(self.document, uri, fields.place, "texture")
            self._files[uri] = _decode(data, name, self.document.file)
        return self._files[uri]


def _decode(data: bytes, name: str, file: str) -> Image:
    if not data.startswith(IDENTIFIER):
        return decode_image(data, name, where=file)
    try:
        return Image(name, decode_ktx2(data))
    except Ktx2Error as error:
        raise SceneError(f"texture '{name}' cannot be decoded ({error})", where=file) from None


def _uv_transform(fields: Fields) -> Matrix:
    """The 3x3 matrix of KHR_texture_transform: scale, then rotation, then offset.

    The rotation is counter-clockwise as seen on the image, whose v axis points down. That is what the extension's
    words, its example and its implementations have; the sign in its sample code is the opposite.
    """
    offset_u, offset_v = fields.numbers("offset", 2) or (0.0, 0.0)
    scale_u, scale_v = fields.numbers("scale", 2) or (1.0, 1.0)
    angle = fields.number("rotation", 0.0)
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array(
        [
            [scale_u * cos, scale_v * sin, offset_u],
            [-scale_u * sin, scale_v * cos, offset_v],
            [0.0, 0.0, 1.0],
        ]
    )
