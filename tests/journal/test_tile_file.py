"""Tiles as bytes: whole, or known to be damaged."""

from __future__ import annotations

import hashlib
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.journal import DamagedTile, TileResult, decode, encode
from lippmann.journal.tile_file import MARK


def tile(index=3, dtype="uint8", seed=0):
    rng = np.random.default_rng(seed)
    pixels = rng.integers(0, 200, (5, 7, 3)).astype(dtype)
    sums = {"lenses": np.arange(4), "values": rng.random(4)}
    maps = {"error": rng.random((5, 7), dtype=np.float32)}
    return TileResult(index, pixels, maps, sums, {"primary": 35}, ("the memory was short",))


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float16", "float32"])
def test_bytes_give_the_tile_back(dtype):
    first = tile(dtype=dtype)
    again = decode(encode(first))
    assert (again.index, again.rays, again.notes) == (first.index, first.rays, first.notes)
    for a, b in ((first.pixels, again.pixels), *((first.maps[k], again.maps[k]) for k in first.maps)):
        assert a.dtype == b.dtype
        assert np.array_equal(a, b)
    assert {k: v.tolist() for k, v in again.sums.items()} == {k: v.tolist() for k, v in first.sums.items()}


def test_the_same_tile_gives_the_same_bytes():
    assert encode(tile()) == encode(tile())
    assert encode(tile()) != encode(tile(seed=1))


_WHOLE = encode(tile())


@settings(deadline=None)
@given(place=st.integers(0, len(_WHOLE) - 1), change=st.integers(1, 255))
def test_a_changed_byte_is_found(place, change):
    data = bytearray(_WHOLE)
    data[place] ^= change
    with pytest.raises(DamagedTile):
        decode(bytes(data))


@settings(deadline=None)
@given(length=st.integers(0, len(_WHOLE) - 1), more=st.binary(max_size=3))
def test_a_wrong_length_is_found(length, more):
    with pytest.raises(DamagedTile):
        decode(_WHOLE[:length])
    with pytest.raises(DamagedTile):
        decode(_WHOLE + b"x" + more)


@settings(deadline=None)
@given(data=st.binary(max_size=200))
def test_other_bytes_are_no_tile(data):
    with pytest.raises(DamagedTile):
        decode(data)


@pytest.mark.parametrize(
    "head",
    [
        b"[]",
        b"{}",
        b"\xff",
        b"[" * 5000,
        b'{"index": 0, "rays": {}, "notes": [], "arrays": [["pixels", "", "|O", [1], 8]]}',
        b'{"index": 0, "rays": {}, "notes": [], "arrays": [["pixels", "", "|u1", [99999999999], 0]]}',
        b'{"index": 0, "rays": {}, "notes": [], "arrays": [["pixels", "", "|u1", [-1], 0]]}',
    ],
)
def test_a_sum_that_agrees_with_nonsense_is_damage_too(head):
    body = MARK + struct.pack("<IQ", len(head), 0) + head
    with pytest.raises(DamagedTile):
        decode(body + hashlib.sha256(body).digest())
