"""Metadata of Zarr arrays, admitted by an allow list before the library sees them.

A Zarr array names the codecs that decode it. The library runs whichever of them it knows, ``pickle`` among them, which
executes what the file says. Only arrays of numbers, packed by plain compressors, come through here. The metadata that
the library gets is written anew from the admitted values, so that nothing else of the file reaches it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lippmann.codecs.types import Attributes, Document, StoredType
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

_MOST_AXES = 8
_MOST_CODECS = 8
_MOST_SHARDS_IN_SHARDS = 3
_MOST_LENGTH = 1 << 48
#: Characters of a fill value that is text: "-Infinity", or the bits of a float.
_MOST_FILL_TEXT = 20

#: Compressors and filters of the second version, codecs of the third, all of which turn bytes into bytes or numbers.
COMPRESSORS = ("zstd", "blosc", "gzip", "zlib", "lz4", "bz2")
FILTERS = ("shuffle", "delta")
CODECS = ("bytes", "transpose", "sharding_indexed", "zstd", "blosc", "gzip", "crc32c")

_TYPE_2 = re.compile(r"[|<>](b1|[iu][1248]|f[248])")
_TYPES_3 = (
    "bool",
    *(f"{kind}int{bits}" for kind in ("", "u") for bits in (8, 16, 32, 64)),
    "float16",
    "float32",
    "float64",
)

_FIELDS_3 = (
    "zarr_format",
    "node_type",
    "shape",
    "data_type",
    "chunk_grid",
    "chunk_key_encoding",
    "fill_value",
    "codecs",
    "attributes",
    "storage_transformers",
    "dimension_names",
)


@dataclass(frozen=True)
class ArrayMetadata:
    """What an array says of itself, admitted.

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
    packing:
        What unpacks a file first; empty if nothing does, or if it holds chunks of its own.
    chunks_of_a_shard:
        How many chunks one file holds; 1 unless it is a shard.
    document:
        For the library: the metadata with nothing but admitted values.
    """

    version: int
    shape: tuple[int, ...]
    chunks: tuple[int, ...]
    dtype: StoredType
    separator: str
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
        between = re.escape(self.separator)
        if self.version == 2:
            return re.compile(between.join([number] * len(self.shape)))
        return re.compile(between.join(["c", *[number] * len(self.shape)]))

    def check_chunks(self, where: str) -> None:
        """Raise :class:`PictureError` where the array is cut into more chunks than any of this size."""
        count = math.prod(-(-length // chunk) for length, chunk in zip(self.shape, self.chunks, strict=True))
        if count * self.chunks_of_a_shard > _MOST_CHUNKS:
            what = f"it is cut into {count * self.chunks_of_a_shard} chunks"
            raise PictureError(what, where=where, rule=f"at most {_MOST_CHUNKS} are read")


def admitted(values: Document, version: int, where: str) -> ArrayMetadata:
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
    return _version_2(values, check) if version == 2 else _version_3(values, check)


def _version_2(values: Document, check: _Check) -> ArrayMetadata:
    shape = check.lengths("shape", values.get("shape"), least=0)
    chunks = check.lengths("chunks", values.get("chunks"), least=1, axes=len(shape))
    typed = check.type_2("dtype", values.get("dtype"))
    separator = check.choice("dimension_separator", values.get("dimension_separator", "."), (".", "/"))
    document = {
        "zarr_format": 2,
        "shape": list(shape),
        "chunks": list(chunks),
        "dtype": typed,
        "fill_value": check.fill_value(values.get("fill_value")),
        "order": check.choice("order", values.get("order"), ("C", "F")),
        "dimension_separator": separator,
        "compressor": None,
        "filters": None,
    }
    packing = ""
    if values.get("compressor") is not None:
        document["compressor"] = check.codec_2("compressor", values["compressor"], COMPRESSORS)
        packing = document["compressor"]["id"]
    if values.get("filters") is not None:
        filters = check.list_of("filters", values["filters"], _MOST_CODECS)
        document["filters"] = [check.codec_2("filter", entry, FILTERS) for entry in filters] or None
    dtype = np.dtype(typed)
    check.chunk_size(shape, chunks, dtype)
    return ArrayMetadata(2, shape, chunks, dtype, separator, packing, 1, document)


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
    typed = check.choice("data_type", values.get("data_type"), _TYPES_3)
    _, grid = check.named("chunk grid", values.get("chunk_grid"), ("regular",))
    chunks = check.lengths("chunk_shape", grid.get("chunk_shape"), least=1, axes=len(shape))
    _, keys = check.named("chunk key encoding", values.get("chunk_key_encoding"), ("default",))
    separator = check.choice("separator", keys.get("separator", "/"), ("/", "."))
    codecs = check.codecs_3(values.get("codecs"), chunks)
    dtype = np.dtype(typed)
    check.chunk_size(shape, chunks, dtype)
    document = {
        "zarr_format": 3,
        "node_type": "array",
        "shape": list(shape),
        "data_type": typed,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(chunks)}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": separator}},
        "fill_value": check.fill_value(values.get("fill_value")),
        "codecs": codecs,
        "attributes": {},
    }
    last = next((codec["name"] for codec in reversed(codecs) if codec["name"] != "crc32c"), "")
    packing = last if last in COMPRESSORS else ""
    return ArrayMetadata(3, shape, chunks, dtype, separator, packing, check.chunks_of_a_shard, document)


class _Check:
    """Checks of single values; ``where`` is the file they stand in.

    ``chunks_of_a_shard`` counts the chunks of a file as :meth:`codecs_3` finds them.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self.chunks_of_a_shard = 1

    def damaged(self, name: str, value: object) -> PictureError:
        """The error for a value that no array has."""
        return PictureError(f"is damaged: {name} is {_quoted(value)}", where=self.where, fix="make it anew")

    def refused(self, what: str, rule: str) -> PictureError:
        """The error for what a sound array may name, but none that is read here."""
        return PictureError(f"names {what}", where=self.where, rule=rule)

    def list_of(self, name: str, value: object, most: int) -> Sequence[Any]:
        """A list of at most so many entries."""
        if not isinstance(value, list) or len(value) > most:
            raise self.damaged(name, value)
        return value

    def lengths(self, name: str, value: object, *, least: int, axes: int | None = None) -> tuple[int, ...]:
        """Whole numbers, one for each axis."""
        found = self.list_of(name, value, _MOST_AXES)
        whole = all(isinstance(length, int) and not isinstance(length, bool) for length in found)
        if not found or not whole or (axes is not None and len(found) != axes):
            raise self.damaged(name, value)
        if not all(least <= length < _MOST_LENGTH for length in found):
            raise self.damaged(name, value)
        return tuple(found)

    def choice(self, name: str, value: object, known: Sequence[str]) -> str:
        """A text out of a few."""
        if not isinstance(value, str) or value not in known:
            raise self.refused(f"the {name} {_quoted(value)}", f"read are {', '.join(known)}")
        return value

    def type_2(self, name: str, value: object) -> str:
        """A type in the words of the second version: numbers and booleans."""
        if not isinstance(value, str) or not _TYPE_2.fullmatch(value):
            raise self.refused(f"the {name} {_quoted(value)}", "arrays of numbers are read")
        return value

    def fill_value(self, value: object) -> Any:
        """A number, or what stands for one."""
        if value is not None and not isinstance(value, (bool, int, float, str)):
            raise self.damaged("fill_value", value)
        if isinstance(value, str) and len(value) > _MOST_FILL_TEXT:
            raise self.damaged("fill_value", value)
        return value

    def plain(self, kind: str, values: Document) -> Attributes:
        """The settings of a codec, which are single numbers or words."""
        if not all(value is None or isinstance(value, (bool, int, float, str)) for value in values.values()):
            raise self.damaged(kind, dict(values))
        return dict(values)

    def codec_2(self, kind: str, value: object, known: Sequence[str]) -> Attributes:
        """A compressor or filter of the second version."""
        if not isinstance(value, Mapping):
            raise self.damaged(kind, value)
        name = self.choice(kind, value.get("id"), known)
        if name == "delta":
            unpacked = self.type_2("dtype of the filter", value.get("dtype"))
            packed = self.type_2("astype of the filter", value.get("astype") or unpacked)
            if np.dtype(packed).itemsize > np.dtype(unpacked).itemsize:  # a file would be larger than its values
                raise self.refused(f"the astype {packed}", f"at most as many bytes as {unpacked} has are read")
        return self.plain(kind, value)

    def named(self, kind: str, value: object, known: Sequence[str]) -> tuple[str, Document]:
        """Name and settings of an entry of the third version."""
        values = {"name": value} if isinstance(value, str) else value
        if not isinstance(values, Mapping):
            raise self.damaged(kind, value)
        settings = values.get("configuration") or {}
        if not isinstance(settings, Mapping):
            raise self.damaged(kind, value)
        return self.choice(kind, values.get("name"), known), settings

    def codecs_3(self, value: object, chunks: tuple[int, ...], depth: int = 0) -> list[Attributes]:
        """A chain of codecs of the third version, which takes chunks of that shape."""
        entries = self.list_of("codecs", value, _MOST_CODECS)
        admitted_entries: list[Attributes] = []
        for entry in entries:
            name, settings = self.named("codec", entry, CODECS)
            if name == "transpose":
                order = self.list_of("order", settings.get("order"), _MOST_AXES)
                if sorted(self.lengths("order", order, least=0, axes=len(chunks))) != [*range(len(chunks))]:
                    raise self.damaged("order", order)
                chunks = tuple(chunks[axis] for axis in order)
                settings = {"order": list(order)}
            elif name == "sharding_indexed":
                settings = self._shard(settings, chunks, depth + 1)
            else:
                settings = self.plain(name, settings)
            admitted_entries.append({"name": name, "configuration": settings})
        if len([entry for entry in admitted_entries if entry["name"] in COMPRESSORS]) > 1:
            raise self.refused("several compressors, one inside the other", "one is read")
        return admitted_entries

    def _shard(self, settings: Document, chunks: tuple[int, ...], depth: int) -> Attributes:
        if depth > _MOST_SHARDS_IN_SHARDS:
            raise self.refused(f"shards in shards, {depth} deep", f"{_MOST_SHARDS_IN_SHARDS} are read")
        inner = self.lengths("chunk_shape", settings.get("chunk_shape"), least=1, axes=len(chunks))
        if any(whole % part for whole, part in zip(chunks, inner, strict=True)):
            raise self.damaged("chunk_shape of a shard", list(inner))
        counts = tuple(whole // part for whole, part in zip(chunks, inner, strict=True))
        self.chunks_of_a_shard *= math.prod(counts)
        if self.chunks_of_a_shard > _MOST_CHUNKS_OF_A_SHARD:
            what = f"shards of {self.chunks_of_a_shard} chunks"
            raise self.refused(what, f"at most {_MOST_CHUNKS_OF_A_SHARD} are read")
        return {
            "chunk_shape": list(inner),
            "codecs": self.codecs_3(settings.get("codecs"), inner, depth),
            # The index is an array of its own: place and length of each chunk.
            "index_codecs": self._index_codecs(settings.get("index_codecs"), (*counts, 2)),
            "index_location": self.choice("index_location", settings.get("index_location", "end"), ("start", "end")),
        }

    def _index_codecs(self, value: object, shape: tuple[int, ...]) -> list[Attributes]:
        for entry in self.list_of("index_codecs", value, _MOST_CODECS):
            self.named("index codec", entry, ("bytes", "transpose", "crc32c"))
        return self.codecs_3(value, shape)

    def chunk_size(self, shape: tuple[int, ...], chunks: tuple[int, ...], dtype: StoredType) -> None:
        """Refuse chunks that fill the memory, or that are absurd beside their array."""
        size, whole = (math.prod(lengths) * dtype.itemsize for lengths in (chunks, shape))
        most = min(MOST_CHUNK_BYTES, max(whole, _FREE_CHUNK_BYTES))
        if size > most:
            rule = f"at most {most} are read of an array of {whole}"
            raise PictureError(f"its chunks have {size} bytes each", where=self.where, rule=rule)


def _quoted(value: object) -> str:
    """A value for a message, cut where it is long or nested."""
    if isinstance(value, Mapping):
        return "{...}"
    if isinstance(value, list):
        return f"[{', '.join('...' if isinstance(entry, (list, dict)) else _quoted(entry) for entry in value[:8])}]"
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:60]}..."
