"""Metadata of Zarr arrays, admitted by an allow list before the library sees them.

A Zarr array names the codecs that decode it. The library runs whichever of them it knows, ``pickle`` among them, which
executes what the file says. Only arrays of numbers, packed by plain compressors, come through here, and only fields of
the format reach the library: how codecs are set up it checks itself.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lippmann.codecs.types import Document, StoredType
from lippmann.errors import PictureError

#: Names of the metadata of a node (an array or group), in the third and the second version of the format.
NODE_3, ARRAY_2, GROUP_2, ATTRIBUTES_2 = "zarr.json", ".zarray", ".zgroup", ".zattrs"

#: Bytes of a chunk, unpacked: Blosc's own limit.
MOST_CHUNK_BYTES = (1 << 31) - 1
#: Chunks may be larger than their array, up to this: ours are tiles of one size in pictures of any size.
_FREE_CHUNK_BYTES = 1 << 26
#: Chunks of an array, and chunks of a shard; the library spends time and memory on each.
_MOST_CHUNKS = 1 << 22
_MOST_CHUNKS_OF_A_SHARD = 1 << 16

#: Axes of an array, and codecs of a chunk.
_MOST_CODECS = 8
_MOST_LENGTH = 1 << 48
#: Characters of a fill value that is text: "-Infinity", or the bits of a float.
_MOST_FILL_TEXT = 20

#: Compressors and filters of the second version, codecs of the third, all of which turn bytes into bytes or numbers.
COMPRESSORS = ("zstd", "blosc", "gzip", "zlib", "lz4", "bz2")
FILTERS = ("shuffle", "delta")
CODECS = ("bytes", "transpose", "sharding_indexed", "zstd", "blosc", "gzip", "crc32c")
_INDEX_CODECS = ("bytes", "transpose", "crc32c")

_TYPE_2 = re.compile(r"[|<>](b1|[iu][1248]|f[248])")
_TYPES_3 = (
    "bool",
    *("int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64"),
    "float16",
    "float32",
    "float64",
)

_FIELDS_2 = ("zarr_format", "shape", "chunks", "dtype", "compressor", "fill_value", "order", "filters")
_FIELDS_3 = (
    *("zarr_format", "node_type", "shape", "data_type", "chunk_grid", "chunk_key_encoding", "fill_value", "codecs"),
    *("attributes", "storage_transformers", "dimension_names"),
)


@dataclass(frozen=True)
class ArrayMetadata:
    """Checked metadata of an array.

    Attributes
    ----------
    version:
        Of the format, 2 or 3.
    shape, chunks:
        Of the array, and of what one file holds of it.
    dtype:
        Type of its values.
    separator:
        Stands between the numbers in the name of a chunk's file.
    prefix:
        Stands before them.
    packing:
        What unpacks a file first; empty if nothing does, or if it holds chunks of its own.
    chunks_of_a_shard:
        How many chunks one file holds; 1 unless it is a shard.
    document:
        For the library: the fields of the format.
    """

    version: int
    shape: tuple[int, ...]
    chunks: tuple[int, ...]
    dtype: StoredType
    separator: str
    prefix: str
    packing: str
    chunks_of_a_shard: int
    document: Document

    @property
    def chunk_bytes(self) -> int:
        """Bytes of what one file holds, unpacked."""
        return math.prod(self.chunks) * self.dtype.itemsize

    @property
    def chunk_names(self) -> re.Pattern[str]:
        """The names that files of chunks can have, as paths from the array's folder."""
        number = r"(0|[1-9][0-9]{0,14})"
        return re.compile(re.escape(self.prefix) + re.escape(self.separator).join([number] * len(self.shape)))

    def chunk_name(self, place: Sequence[int]) -> str:
        """The name of a chunk's file, as a path from the array's folder."""
        return self.prefix + self.separator.join(map(str, place))

    def check_chunks(self, where: str) -> None:
        """Raise :class:`PictureError` where the array is cut into more chunks than any of this size."""
        count = math.prod(-(-length // chunk) for length, chunk in zip(self.shape, self.chunks, strict=True))
        if count * self.chunks_of_a_shard > _MOST_CHUNKS:
            what = f"it is cut into {count * self.chunks_of_a_shard} chunks"
            raise PictureError(what, where=where, rule=f"at most {_MOST_CHUNKS} are read")


def admit(values: Document, version: int, where: str) -> ArrayMetadata:
    """The metadata of an array, checked.

    Parameters
    ----------
    values:
        The JSON of ``.zarray`` (version 2) or ``zarr.json`` (version 3).
    where:
        The file, for messages.

    Raises
    ------
    PictureError
        If a value is missing or makes no sense, or names what is not on the allow list.
    """
    check = _Check(where)
    if values.get("zarr_format") != version:
        raise check.damaged("zarr_format", values.get("zarr_format"))
    metadata = _version_2(values, check) if version == 2 else _version_3(values, check)
    fill = values.get("fill_value")
    if isinstance(fill, (list, Mapping)) or (isinstance(fill, str) and len(fill) > _MOST_FILL_TEXT):
        raise check.damaged("fill_value", fill)
    return metadata


def _version_2(values: Document, check: _Check) -> ArrayMetadata:
    shape = check.lengths("shape", values.get("shape"), least=0)
    chunks = check.lengths("chunks", values.get("chunks"), least=1, axes=len(shape))
    dtype = check.type_2("dtype", values.get("dtype"))
    separator = check.choice("dimension_separator", values.get("dimension_separator", "."), (".", "/"))
    check.choice("order", values.get("order"), ("C", "F"))
    compressor, filters = values.get("compressor"), values.get("filters")
    packing = "" if compressor is None else check.codec_2("compressor", compressor, COMPRESSORS)
    for each in check.list_of("filters", filters or []):
        if check.codec_2("filter", each, FILTERS) == "delta":
            unpacked = check.type_2("dtype of the filter", each.get("dtype"))
            packed = check.type_2("astype of the filter", each.get("astype") or each.get("dtype"))
            if packed.itemsize > unpacked.itemsize:  # a file would be larger than its values
                raise check.refused(f"the astype {packed.str}", f"at most as many bytes as {unpacked.str} has are read")
    check.chunk_size(shape, chunks, dtype)
    document = {name: values.get(name) for name in _FIELDS_2} | {"dimension_separator": separator}
    return ArrayMetadata(2, shape, chunks, dtype, separator, "", packing, 1, document)


def _version_3(values: Document, check: _Check) -> ArrayMetadata:
    for name, value in values.items():
        needless = isinstance(value, Mapping) and value.get("must_understand") is False
        if name not in _FIELDS_3 and not needless and value is not None:
            raise check.refused(f"the extension {name!r}", "arrays are read without extensions")
    if values.get("node_type") != "array":
        raise check.damaged("node_type", values.get("node_type"))
    if values.get("storage_transformers") not in (None, []):
        raise check.refused("storage transformers", "arrays are read without them")
    shape = check.lengths("shape", values.get("shape"), least=0)
    dtype = np.dtype(check.choice("data_type", values.get("data_type"), _TYPES_3))
    _, grid = check.named("chunk grid", values.get("chunk_grid"), ("regular",))
    chunks = check.lengths("chunk_shape", grid.get("chunk_shape"), least=1, axes=len(shape))
    encoding, keys = check.named("chunk key encoding", values.get("chunk_key_encoding"), ("default", "v2"))
    separator = check.choice("separator", keys.get("separator", "/" if encoding == "default" else "."), ("/", "."))
    prefix = f"c{separator}" if encoding == "default" else ""
    packing, count = _codecs_3(values.get("codecs"), chunks, check)
    check.chunk_size(shape, chunks, dtype)
    document = {name: values[name] for name in _FIELDS_3 if name in values and name != "attributes"}
    return ArrayMetadata(3, shape, chunks, dtype, separator, prefix, packing, count, document)


def _codecs_3(value: object, chunks: tuple[int, ...], check: _Check, *, inside: bool = False) -> tuple[str, int]:
    """Name of the compressor, empty without one, and number of chunks in a file; ``inside``: codecs of a shard."""
    packing, count = "", 1
    for entry in check.list_of("codecs", value):
        name, settings = check.named("codec", entry, CODECS)
        if name in COMPRESSORS:
            if packing:
                raise check.refused("several compressors, one inside the other", "one is read")
            packing = name
        elif name == "sharding_indexed":
            if inside:
                raise check.refused("shards in shards", "shards of chunks are read")
            inner = check.lengths("chunk_shape", settings.get("chunk_shape"), least=1, axes=len(chunks))
            count = math.prod(-(-whole // part) for whole, part in zip(chunks, inner, strict=True))
            if count > _MOST_CHUNKS_OF_A_SHARD:
                raise check.refused(f"shards of {count} chunks", f"at most {_MOST_CHUNKS_OF_A_SHARD} are read")
            _codecs_3(settings.get("codecs"), inner, check, inside=True)
            for each in check.list_of("index_codecs", settings.get("index_codecs")):
                check.named("index codec", each, _INDEX_CODECS)
    return packing, count


class _Check:
    """Checks of single values; ``where`` is the file they stand in."""

    def __init__(self, where: str) -> None:
        self.where = where

    def damaged(self, name: str, value: object) -> PictureError:
        """The error for a value that no array has."""
        return PictureError(f"is damaged: {name} is {_quote(value)}", where=self.where, fix="make it anew")

    def refused(self, what: str, rule: str) -> PictureError:
        """The error for what a sound array may name, but none that is read here."""
        return PictureError(f"names {what}", where=self.where, rule=rule)

    def list_of(self, name: str, value: object) -> Sequence[Any]:
        """A short list."""
        if not isinstance(value, list) or len(value) > _MOST_CODECS:
            raise self.damaged(name, value)
        return value

    def lengths(self, name: str, value: object, *, least: int, axes: int | None = None) -> tuple[int, ...]:
        """Whole numbers, one for each axis."""
        lengths = self.list_of(name, value)
        whole = all(type(length) is int and least <= length < _MOST_LENGTH for length in lengths)
        if not lengths or not whole or (axes is not None and len(lengths) != axes):
            raise self.damaged(name, value)
        return tuple(lengths)

    def choice(self, name: str, value: object, known: Sequence[str]) -> str:
        """A text out of a few."""
        if not isinstance(value, str) or value not in known:
            raise self.refused(f"the {name} {_quote(value)}", f"read are {', '.join(known)}")
        return value

    def type_2(self, name: str, value: object) -> StoredType:
        """A type in the words of the second version: numbers and booleans."""
        if not isinstance(value, str) or not _TYPE_2.fullmatch(value):
            raise self.refused(f"the {name} {_quote(value)}", "arrays of numbers are read")
        return np.dtype(value)

    def codec_2(self, kind: str, value: object, known: Sequence[str]) -> str:
        """Name of a compressor or filter of the second version."""
        if not isinstance(value, Mapping):
            raise self.damaged(kind, value)
        return self.choice(kind, value.get("id"), known)

    def named(self, kind: str, value: object, known: Sequence[str]) -> tuple[str, Document]:
        """Name and settings of an entry of the third version."""
        values = {"name": value} if isinstance(value, str) else value
        settings = values.get("configuration") or {} if isinstance(values, Mapping) else None
        if not isinstance(values, Mapping) or not isinstance(settings, Mapping):
            raise self.damaged(kind, value)
        return self.choice(kind, values.get("name"), known), settings

    def chunk_size(self, shape: tuple[int, ...], chunks: tuple[int, ...], dtype: StoredType) -> None:
        """Refuse chunks that fill the memory, or that are absurd beside their array."""
        size, whole = (math.prod(lengths) * dtype.itemsize for lengths in (chunks, shape))
        most = min(MOST_CHUNK_BYTES, max(whole, _FREE_CHUNK_BYTES))
        if size > most:
            rule = f"at most {most} are read of an array of {whole}"
            raise PictureError(f"its chunks have {size} bytes each", where=self.where, rule=rule)


def _quote(value: object) -> str:
    """A value for a message, cut where it is long or nested."""
    if isinstance(value, Mapping):
        return "{...}"
    if isinstance(value, list):
        return f"[{', '.join('...' if isinstance(entry, (list, dict)) else _quote(entry) for entry in value[:8])}]"
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:60]}..."
