"""Zarr folders that others wrote: no file of theirs is executed, and none outside their folder is read.

The hostile arrays are forged byte by byte, so that they are the same whatever version of the library is installed.
"""

from __future__ import annotations

import base64
import bz2
import gzip
import json
import os
import pickle
import zlib

import imagecodecs
import numcodecs
import numpy as np
import pytest
import zarr

from lippmann.codecs.zarr_reader import open_array, read_array_metadata
from lippmann.display.panel import PixelWindow
from lippmann.errors import PictureError
from lippmann.exchange.zarr_store import read_zarr
from lippmann.image import open_file, read_picture
from lippmann.image.streamed import pixels_of_file

VALUES = np.random.default_rng(0).integers(0, 256, (4, 6, 3), dtype=np.uint8)
VIEWS = np.random.default_rng(1).integers(0, 256, (2, 2, 2, 3, 3), dtype=np.uint8)

needs_format_3 = pytest.mark.skipif(not hasattr(zarr, "create_array"), reason="this zarr reads format 2 alone")


class Bomb:
    """Makes a folder where it is unpickled: the harmless stand-in for a hostile program."""

    def __init__(self, marker):
        self.marker = marker

    def __reduce__(self):
        return os.mkdir, (str(self.marker),)


def array_2(folder, values=VALUES, data=None, **changed):
    """An array of one chunk in format 2; a field that is ``...`` is left out."""
    folder.mkdir(parents=True, exist_ok=True)
    fields = {
        "zarr_format": 2,
        "shape": list(values.shape),
        "chunks": list(values.shape),
        "dtype": values.dtype.str,
        "compressor": None,
        "fill_value": 0,
        "order": "C",
        "filters": None,
    } | changed
    (folder / ".zarray").write_text(json.dumps({name: value for name, value in fields.items() if value is not ...}))
    name = changed.get("dimension_separator", ".").join("0" * values.ndim)
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(values.tobytes() if data is None else data)
    return folder / name


def array_3(folder, values=VALUES, data=None, **changed):
    """An array of one chunk in format 3."""
    folder.mkdir(parents=True, exist_ok=True)
    fields = {
        "zarr_format": 3,
        "node_type": "array",
        "shape": list(values.shape),
        "data_type": values.dtype.name,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(values.shape)}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": 0,
        "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}],
        "attributes": {},
    } | changed
    (folder / "zarr.json").write_text(json.dumps({name: value for name, value in fields.items() if value is not ...}))
    chunk = folder / "/".join(["c", *"0" * values.ndim])
    chunk.parent.mkdir(parents=True, exist_ok=True)
    chunk.write_bytes(values.tobytes() if data is None else data)
    return chunk


def group_2(folder, **attributes):
    folder.mkdir(exist_ok=True)
    (folder / ".zgroup").write_text('{"zarr_format": 2}')
    (folder / ".zattrs").write_text(json.dumps(attributes))
    return folder


def values_of(folder):
    return open_file(folder).decode()[0]


def refusal(folder, read=values_of):
    with pytest.raises(PictureError) as refused:
        read(folder)
    line = str(refused.value)
    assert len(line.splitlines()) == 1
    assert line.startswith(str(folder))
    return line


PICKLE = {"id": "pickle", "protocol": 5}
OBJECTS = {"dtype": "|O", "filters": [PICKLE], "fill_value": None}

#: Arrays of format 2 that have the library call the codec ``pickle``.
HOSTILE = {
    "objects": OBJECTS,
    "objects, inside blosc": OBJECTS | {"filters": [PICKLE, {"id": "shuffle", "elementsize": 1}]},
    "filter of numbers": {"filters": [PICKLE]},
    "compressor of numbers": {"compressor": PICKLE},
    "texts": {"dtype": "|O", "filters": [{"id": "vlen-utf8"}]},
    "a record": {"dtype": [["a", "|u1"], ["b", "|O"]], "filters": [PICKLE]},
}


@pytest.mark.parametrize("kind", HOSTILE)
@pytest.mark.parametrize(
    "read",
    [
        values_of,
        open_file,
        read_picture,
        lambda folder: pixels_of_file(open_file(folder)).window(PixelWindow(0, 0, 6, 4)),
    ],
    ids=["values", "header", "picture", "pieces"],
)
def test_a_picture_is_not_executed(tmp_path, kind, read):
    marker, folder = tmp_path / "executed", tmp_path / "x.zarr"
    array_2(folder, data=pickle.dumps(Bomb(marker)), **HOSTILE[kind])
    line = refusal(folder, read)
    assert not marker.exists()
    assert "names the " in line


def test_a_fill_value_is_not_executed(tmp_path):
    marker, folder = tmp_path / "executed", tmp_path / "x.zarr"
    packed = base64.b64encode(pickle.dumps(Bomb(marker))).decode()
    array_2(folder, **(OBJECTS | {"fill_value": packed}))
    (folder / "0.0.0").unlink()
    assert "names the dtype '|O'; arrays of numbers are read" in refusal(folder)
    assert not marker.exists()
    array_2(folder, fill_value=packed)
    assert "is damaged: fill_value is " in refusal(folder)


@pytest.mark.parametrize("kind", HOSTILE)
@pytest.mark.parametrize("name", ["LF", "mask", "maps/depth"])
def test_a_light_field_is_not_executed(tmp_path, kind, name):
    marker, folder = tmp_path / "executed", group_2(tmp_path / "x.zarr")
    group_2(folder / "maps")
    array_2(folder / "LF", VIEWS)
    array_2(folder / name, VIEWS if name == "LF" else VIEWS[..., 0], pickle.dumps(Bomb(marker)), **HOSTILE[kind])
    assert "names the " in refusal(folder, read_zarr)
    assert not marker.exists()


BYTES = {"name": "bytes", "configuration": {"endian": "little"}}


def shard(**changed):
    settings = {"chunk_shape": [2, 3, 3], "codecs": [BYTES], "index_codecs": [BYTES, {"name": "crc32c"}]} | changed
    return {"name": "sharding_indexed", "configuration": settings}


@pytest.mark.parametrize(
    ("codecs", "named"),
    [
        ([{"name": "pickle"}], "the codec 'pickle'"),
        ([BYTES, {"name": "numcodecs.pickle"}], "the codec 'numcodecs.pickle'"),
        ([{"name": "vlen-bytes"}], "the codec 'vlen-bytes'"),
        (["pickle"], "the codec 'pickle'"),
        ([shard(codecs=[{"name": "pickle"}])], "the codec 'pickle'"),
        ([shard(index_codecs=[{"name": "pickle"}])], "the index codec 'pickle'"),
        ([shard(index_codecs=[BYTES, {"name": "zstd"}])], "the index codec 'zstd'"),
        ([shard(codecs=[shard(chunk_shape=[1, 3, 3], codecs=[{"name": "pickle"}])])], "shards in shards"),
        ([BYTES, {"name": "zstd"}, {"name": "gzip"}], "several compressors"),
    ],
)
def test_codecs_of_format_3_are_those_of_the_list(tmp_path, codecs, named):
    array_3(tmp_path / "x.zarr", codecs=codecs)
    assert f"names {named}" in refusal(tmp_path / "x.zarr")


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"data_type": "string"}, "names the data_type 'string'"),
        ({"data_type": {"name": "fixed_length_utf32"}}, "names the data_type {...}"),
        ({"storage_transformers": [{"name": "x"}]}, "names storage transformers"),
        ({"chunk_key_encoding": {"name": "v3"}}, "names the chunk key encoding 'v3'"),
        ({"chunk_grid": {"name": "rectilinear"}}, "names the chunk grid 'rectilinear'"),
        ({"codecs": "bytes"}, "codecs is 'bytes'"),
        ({"codecs": [{"name": "bytes", "configuration": 5}]}, "codec is {...}"),
        ({"codecs": [{"name": "transpose", "configuration": {"order": [0, 0, 1]}}]}, "is damaged: "),
        ({"codecs": [shard(chunk_shape=[3, 3, 3])]}, "is damaged: "),
        ({"node_type": "group"}, "is a Zarr group; it holds no arrays"),
        ({"fill_value": [0, 1]}, "fill_value is [0, 1]"),
        ({"another": {"name": "x"}}, "names the extension 'another'"),
        ({"shape": [4, 6, -3]}, "shape is [4, 6, -3]"),
        ({"shape": [4, True, 3]}, "shape is [4, True, 3]"),
        ({"shape": [4, 6.0, 3]}, "shape is [4, 6.0, 3]"),
        ({"shape": [4, 10**30, 3]}, "shape is [4, 1000"),
        ({"shape": [[[]]]}, "shape is [...]"),
        ({"zarr_format": 2}, "zarr_format is 2"),
    ],
)
def test_format_3_is_read_without_extensions(tmp_path, changed, what):
    array_3(tmp_path / "x.zarr", **changed)
    assert what in refusal(tmp_path / "x.zarr")


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"chunks": [0, 6, 3]}, "chunks is [0, 6, 3]"),
        ({"chunks": [4, 6]}, "chunks is [4, 6]"),
        ({"chunks": ...}, "chunks is None"),
        ({"dtype": "<c8"}, "names the dtype '<c8'"),
        ({"dtype": "<M8[s]"}, "names the dtype '<M8[s]'"),
        ({"dtype": "|V3"}, "names the dtype '|V3'"),
        ({"compressor": {"id": "lzma"}}, "names the compressor 'lzma'"),
        ({"compressor": "zstd"}, "compressor is 'zstd'"),
        ({"compressor": {"id": "zstd", "level": [1]}}, "is damaged: "),
        ({"filters": [{"id": "delta", "dtype": "|O"}]}, "the dtype of the filter '|O'"),
        ({"filters": [{"id": "delta", "dtype": "|u1", "astype": "|O"}]}, "the astype of the filter '|O'"),
        ({"filters": [{"id": "delta", "dtype": "|u1", "astype": "<i8"}]}, "names the astype <i8"),
        ({"filters": [{"id": "json2"}]}, "names the filter 'json2'"),
        ({"dimension_separator": "../"}, "names the dimension_separator '../'"),
        ({"order": "K"}, "names the order 'K'"),
        ({"zarr_format": 3}, "zarr_format is 3"),
    ],
)
def test_format_2_is_read_without_surprises(tmp_path, changed, what):
    array_2(tmp_path / "x.zarr")
    fields = json.loads((tmp_path / "x.zarr" / ".zarray").read_text()) | changed
    (tmp_path / "x.zarr" / ".zarray").write_text(json.dumps({k: v for k, v in fields.items() if v is not ...}))
    assert what in refusal(tmp_path / "x.zarr")


@pytest.mark.parametrize("version", [2, 3])
def test_a_group_names_its_arrays(tmp_path, version):
    zarr = pytest.importorskip("zarr", minversion="3")
    group = zarr.open_group(str(tmp_path / "field.zarr"), mode="w", zarr_format=version)
    with pytest.raises(PictureError, match=r"field\.zarr: is a Zarr group; it holds no arrays$"):
        open_file(tmp_path / "field.zarr")
    for name in ("view", "maps/depth"):
        group.create_array(name, shape=(4, 4, 3), dtype="u1")
    with pytest.raises(PictureError, match=r"it holds the arrays view, maps/depth; name an array: .*field\.zarr/view$"):
        open_file(tmp_path / "field.zarr")
    assert open_file(tmp_path / "field.zarr" / "view").width == 4


def test_chunks_have_sane_sizes(tmp_path):
    folder = tmp_path / "x.zarr"
    array_2(folder, chunks=[1 << 20, 1 << 20, 3])
    assert "its chunks have 3298534883328 bytes each; at most 67108864 are read of an array of 72" in refusal(folder)
    array_2(folder, shape=[1 << 15, 1 << 15, 3], chunks=[1 << 15, 1 << 15, 3])
    assert "its chunks have 3221225472 bytes each; at most 2147483647" in refusal(folder)
    array_2(folder, shape=[1 << 15, 1 << 15, 3], chunks=[1, 1, 1])
    assert "it is cut into 3221225472 chunks; at most 4194304 are read" in refusal(folder)
    array_3(folder, codecs=[shard(chunk_shape=[1, 1, 1])], shape=[4096, 4096, 3])
    fields = json.loads((folder / "zarr.json").read_text())
    fields["chunk_grid"]["configuration"]["chunk_shape"] = [4096, 4096, 3]
    (folder / "zarr.json").write_text(json.dumps(fields))
    assert "names shards of 50331648 chunks" in refusal(folder)


def test_metadata_has_a_sane_size_and_is_an_object(tmp_path):
    folder = tmp_path / "x.zarr"
    array_2(folder)
    text = (folder / ".zarray").read_text()
    (folder / ".zarray").write_text(text + " " * (1 << 22))
    assert "is damaged: .zarray has " in refusal(folder)
    for text in ("[1]", "{", "[" * 100_000, "\xff", ""):
        (folder / ".zarray").write_text(text, encoding="latin-1")
        assert "is damaged: .zarray holds no JSON object" in refusal(folder)
    (folder / ".zarray").unlink()
    (folder / ".zarray").mkdir()
    assert refusal(folder)


@pytest.fixture
def secret(tmp_path):
    """A file outside the array's folder with as many bytes as a chunk, and an array there."""
    path = tmp_path / "elsewhere" / "secret"
    path.parent.mkdir()
    path.write_bytes(bytes(range(72)))
    array_2(tmp_path / "elsewhere" / "LF", VIEWS)
    array_3(tmp_path / "elsewhere" / "three")
    return path


def test_no_link_leads_out_of_a_picture(tmp_path, secret):
    folder = tmp_path / "x.zarr"
    chunk = array_2(folder)
    chunk.unlink()
    chunk.symlink_to(secret)
    assert "0.0.0 is a link that leads out of the folder; the files of a Zarr array lie in its" in refusal(folder)
    chunk.unlink()
    chunk.symlink_to("../elsewhere/secret")
    assert "secret" not in refusal(folder)
    chunk = array_2(folder, dimension_separator="/")
    chunk.unlink()
    (folder / "0" / "0").rmdir()
    (folder / "0" / "0").symlink_to(secret.parent)
    secret.rename(secret.parent / "0")
    assert "0/0/0 is a link" in refusal(folder)
    (folder / ".zarray").unlink()
    (folder / ".zarray").symlink_to(secret.parent / "LF" / ".zarray")
    assert ".zarray is a link" in refusal(folder)
    array_3(folder, attributes={})
    (folder / "zarr.json").unlink()
    (folder / "zarr.json").symlink_to(secret.parent / "three" / "zarr.json")
    assert "zarr.json is a link" in refusal(folder, open_file)


def test_attributes_are_no_link_either(tmp_path, secret):
    folder = tmp_path / "x.zarr"
    array_2(folder)
    secret.write_text('{"lippmann": "secret"}')
    (folder / ".zattrs").symlink_to(secret)
    assert ".zattrs is a link" in refusal(folder, open_file)


def test_no_link_leads_out_of_a_light_field(tmp_path, secret):
    folder = group_2(tmp_path / "x.zarr")
    (folder / "LF").symlink_to(secret.parent / "LF")
    assert "is a link that leads out of the folder" in refusal(folder, read_zarr)
    (folder / "LF").unlink()
    array_2(folder / "LF", VIEWS)
    (folder / "LF" / "0.0.0.0.0").unlink()
    (folder / "LF" / "0.0.0.0.0").symlink_to(secret.parent / "LF" / "0.0.0.0.0")
    assert "0.0.0.0.0 is a link" in refusal(folder, read_zarr)


def test_links_inside_the_folder_are_followed(tmp_path):
    folder = tmp_path / "x.zarr"
    chunk = array_2(folder)
    chunk.rename(folder / "kept")
    chunk.symlink_to("kept")
    np.testing.assert_array_equal(values_of(folder), VALUES)
    (tmp_path / "link.zarr").symlink_to(folder)  # the command line may name a link
    np.testing.assert_array_equal(values_of(tmp_path / "link.zarr"), VALUES)
    chunk.unlink()
    chunk.symlink_to("0.0.0")
    assert "0.0.0 " in refusal(folder)
    chunk.unlink()
    chunk.symlink_to("nothing")
    assert "0.0.0 is a link that leads nowhere" in refusal(folder)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names here")
def test_a_pipe_is_not_waited_for(tmp_path):
    chunk = array_2(tmp_path / "x.zarr")
    chunk.unlink()
    os.mkfifo(chunk)
    assert "0.0.0 is no plain file" in refusal(tmp_path / "x.zarr")


BLOSC_OF_A_GIGABYTE = (
    bytes([2, 1, 0x91, 1]) + b"".join(n.to_bytes(4, "little") for n in (1 << 30, 1 << 18, 40)) + bytes(24)
)


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("zlib", zlib.compress(bytes(1 << 20))),
        ("gzip", gzip.compress(bytes(1 << 20))),
        ("bz2", bz2.compress(bytes(1 << 20))),
        ("zstd", imagecodecs.zstd_encode(bytes(1 << 20))),
        ("lz4", (1 << 30).to_bytes(4, "little") + bytes(40)),
        ("blosc", BLOSC_OF_A_GIGABYTE),
    ],
    ids=["zlib", "gzip", "bz2", "zstd", "lz4", "blosc"],
)
def test_a_chunk_unpacks_to_no_more_than_it_holds(tmp_path, name, data):
    array_2(tmp_path / "x.zarr", data=data, compressor={"id": name})
    assert "0.0.0 unpacks to more than the 72 bytes of a chunk" in refusal(tmp_path / "x.zarr")
    array_2(tmp_path / "x.zarr", data=data[:3], compressor={"id": name})
    assert "0.0.0 " in refusal(tmp_path / "x.zarr") or name in ("zlib", "gzip", "bz2")


@pytest.mark.parametrize("name", ["zlib", "gzip", "bz2"])
def test_one_stream_after_the_other_is_refused(tmp_path, name):
    pack = {"zlib": zlib.compress, "gzip": gzip.compress, "bz2": bz2.compress}[name]
    array_2(tmp_path / "x.zarr", data=pack(VALUES.tobytes()) + pack(bytes(1 << 20)), compressor={"id": name})
    assert "0.0.0 is nothing that" in refusal(tmp_path / "x.zarr")


def test_a_file_is_no_larger_than_a_chunk_can_be(tmp_path):
    array_2(tmp_path / "x.zarr", data=bytes(1 << 20))
    assert "0.0.0 has 1048576 bytes, and needs at most" in refusal(tmp_path / "x.zarr")


@pytest.mark.parametrize("filters", [None, [{"id": "shuffle", "elementsize": 2}], [{"id": "delta", "dtype": "<u2"}]])
@pytest.mark.parametrize(
    ("name", "order"), [*((name, "C") for name in (None, "zstd", "blosc", "gzip", "zlib", "lz4", "bz2")), ("zstd", "F")]
)
def test_what_others_write_in_format_2_is_read(tmp_path, name, filters, order):
    values = np.random.default_rng(3).integers(0, 1 << 16, (4, 6, 3)).astype("<u2")
    data = values.tobytes(order)
    for entry in filters or []:
        data = np.asarray(numcodecs.get_codec(dict(entry)).encode(np.frombuffer(data, "<u2"))).tobytes()
    if name is not None:
        data = bytes(numcodecs.get_codec({"id": name}).encode(data))
    compressor = None if name is None else {"id": name}
    array_2(tmp_path / "x.zarr", values, data, compressor=compressor, filters=filters, order=order)
    np.testing.assert_array_equal(values_of(tmp_path / "x.zarr"), values)


@pytest.mark.parametrize("dtype", ["|u1", ">u2", "<u2", ">f4", "<f4"])
def test_bytes_of_either_order_are_read(tmp_path, dtype):
    values = VALUES.astype(dtype)
    array_2(tmp_path / "x.zarr", values, dimension_separator="/")
    np.testing.assert_array_equal(values_of(tmp_path / "x.zarr"), values)


@pytest.mark.parametrize("version", [2, 3])
def test_a_picture_that_lies_on_its_side_is_named(tmp_path, version):
    """Its shape fits a picture, its axes say that it is not one."""
    if version == 2:
        array_2(tmp_path / "x.zarr")
        (tmp_path / "x.zarr" / ".zattrs").write_text(json.dumps({"_ARRAY_DIMENSIONS": ["X", "Y", "rgb"]}))
    else:
        array_3(tmp_path / "x.zarr", dimension_names=["X", "Y", "rgb"])
    assert "has the axes X, Y, rgb; they must be height, width, 3 colours" in refusal(tmp_path / "x.zarr")


@needs_format_3
@pytest.mark.parametrize(
    "options",
    [
        {"compressors": None},
        {"compressors": {"name": "gzip", "configuration": {"level": 1}}},
        {"compressors": {"name": "blosc", "configuration": {"cname": "lz4", "clevel": 1, "shuffle": "bitshuffle"}}},
        {"compressors": [{"name": "zstd", "configuration": {"level": 1, "checksum": True}}, {"name": "crc32c"}]},
        {"filters": [{"name": "transpose", "configuration": {"order": [2, 0, 1]}}]},
        {"shards": (16, 16, 3)},
        {
            "shards": (16, 32, 3),
            "compressors": None,
            "filters": [{"name": "transpose", "configuration": {"order": [1, 2, 0]}}],
        },
        {"chunk_key_encoding": {"name": "default", "separator": "."}},
        {"chunk_key_encoding": {"name": "v2"}},
        {"chunk_key_encoding": {"name": "v2", "separator": "/"}},
        {"dimension_names": ("y", "x", "c")},
        {"fill_value": 7},
    ],
    ids=lambda options: "-".join(options),
)
def test_what_others_write_in_format_3_is_read(tmp_path, options):
    values = np.random.default_rng(3).integers(0, 1 << 16, (20, 30, 3)).astype("<u2")
    values[:8, :8] = options.get("fill_value", 0)  # a chunk without a file
    array = zarr.create_array(tmp_path / "x.zarr", shape=values.shape, chunks=(8, 8, 3), dtype="<u2", **options)
    array[...] = values
    np.testing.assert_array_equal(values_of(tmp_path / "x.zarr"), values)
    window = pixels_of_file(open_file(tmp_path / "x.zarr")).window(PixelWindow(7, 5, 13, 11))
    np.testing.assert_array_equal(window, values[5:16, 7:20])


@pytest.mark.skipif(hasattr(zarr, "create_array"), reason="this zarr reads format 3 too")
def test_format_3_is_refused_by_name_where_the_library_is_too_old(tmp_path):
    array_3(tmp_path / "x.zarr")
    assert "is in format 3 of Zarr; the installed library zarr 2." in refusal(tmp_path / "x.zarr")


def test_consolidated_metadata_is_not_believed(tmp_path):
    folder = group_2(tmp_path / "x.zarr")
    array_2(folder / "LF", VIEWS)
    fields = json.loads((folder / "LF" / ".zarray").read_text())
    entries = {
        ".zgroup": {"zarr_format": 2},
        "LF/.zarray": fields | {"shape": [1, 1, 1, 1, 3], "chunks": [1, 1, 1, 1, 3]},
        "maps/.zgroup": {"zarr_format": 2},
        "maps/depth/.zarray": fields,
    }
    (folder / ".zmetadata").write_text(json.dumps({"zarr_consolidated_format": 1, "metadata": entries}))
    found = read_zarr(folder)
    np.testing.assert_array_equal(found.values, VIEWS)
    assert found.maps == {}


@needs_format_3
def test_consolidated_metadata_inside_a_group_is_not_believed(tmp_path):
    folder = tmp_path / "x.zarr"
    array_3(folder / "LF", VIEWS)
    other = json.loads((folder / "LF" / "zarr.json").read_text()) | {"shape": [1, 1, 1, 1, 3]}
    inline = {"kind": "inline", "must_understand": False, "metadata": {"LF": other}}
    group = {"zarr_format": 3, "node_type": "group", "attributes": {}, "consolidated_metadata": inline}
    (folder / "zarr.json").write_text(json.dumps(group))
    np.testing.assert_array_equal(read_zarr(folder).values, VIEWS)


def test_metadata_that_is_exchanged_after_the_check_is_not_read(tmp_path):
    marker, folder = tmp_path / "executed", tmp_path / "x.zarr"
    values = np.zeros((32, 32, 3), np.uint8)
    array_2(folder, values)
    metadata = read_array_metadata(folder)
    data = pickle.dumps(Bomb(marker)).ljust(values.nbytes, b".")
    array_2(folder, values, data, compressor=PICKLE)
    assert open_array(zarr, folder, metadata)[...].tobytes() == data
    assert not marker.exists()


def test_arrays_cannot_be_changed(tmp_path):
    array_2(tmp_path / "x.zarr")
    with pytest.raises((PermissionError, ValueError, TypeError)):
        open_array(zarr, tmp_path / "x.zarr", read_array_metadata(tmp_path / "x.zarr"))[...] = 0
    np.testing.assert_array_equal(values_of(tmp_path / "x.zarr"), VALUES)


def test_the_stand_in_makes_its_mark_where_it_is_unpickled(tmp_path):
    pickle.loads(pickle.dumps(Bomb(tmp_path / "executed")))
    assert (tmp_path / "executed").is_dir()
