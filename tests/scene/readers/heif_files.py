"""HEIF files with depth, which no library writes: two pictures, the second of which is made the first one's depth."""

import io

import numpy as np
import pillow_heif


def heif(pixels, depth=None, *, representation=None):
    """Bytes of a HEIF file of ``pixels`` (h, w, 3) uint8, with ``depth`` (h, w) uint8 beside.

    ``representation`` is a depth_representation_type of H.265; without one nothing is said.
    """
    file = pillow_heif.from_bytes("RGB", pixels.shape[1::-1], pixels.tobytes())
    if depth is not None:
        file.add_frombytes("L", depth.shape[::-1], depth.tobytes())
    held = io.BytesIO()
    file.save(held, quality=-1)
    data = held.getvalue()
    return data if depth is None else _as_depth(data, representation)


def _as_depth(data, representation):
    kind = b"urn:mpeg:hevc:2015:auxid:2\0" + (b"" if representation is None else _representation(representation))
    auxiliary = _box(b"auxC", bytes(4) + kind)
    reference = _box(b"iref", bytes(4) + _box(b"auxl", b"\0\2\0\1\0\1"))
    meta = data.index(b"meta") - 4
    properties, container, association = (data.index(name, meta) - 4 for name in (b"iprp", b"ipco", b"ipma"))
    count = _children(data[container + 8 : association])
    end = association + _size(data, association)
    # The second item's list is the last one of the box; its length stands before it.
    entry = data.rindex(b"\0\2", association, end)
    listed = data[association : entry + 2] + bytes([data[entry + 2] + 1])
    listed += data[entry + 3 : entry + 3 + data[entry + 2]] + bytes([0x80 | count + 1])
    grown = _resized(listed, len(listed))
    held = _resized(data[container:association] + auxiliary, _size(data, container) + len(auxiliary))
    inside = _resized(data[properties : properties + 8], 8 + len(held) + len(grown)) + held + grown
    before = _moved(data[meta:properties], len(inside) + len(reference) - _size(data, properties))
    whole = before + inside + reference
    return data[:meta] + _resized(whole, len(whole)) + data[meta + _size(data, meta) :]


def _moved(head, by):
    """Places of both items in the file, as they are once what stands before them has grown."""
    place = head.index(b"iloc") + 4
    assert head[place : place + 6] == b"\0\0\0\0D@"  # offsets, lengths and bases of four bytes each
    head, first = bytearray(head), place + 8
    for number in range(2):
        base = first + number * 18 + 4
        head[base : base + 4] = (int.from_bytes(head[base : base + 4], "big") + by).to_bytes(4, "big")
    return bytes(head)


def _representation(kind):
    """A message of depth representation (payload 177): nothing but its type, an Exp-Golomb code."""
    code = format(kind + 1, "b")
    bits = "0000" + "0" * (len(code) - 1) + code + "1"
    bits += "0" * (-len(bits) % 8)
    payload = int(bits, 2).to_bytes(len(bits) // 8, "big")
    unit = b"\x4e\x01\xb1" + bytes([len(payload)]) + payload + b"\x80"
    message = len(unit).to_bytes(4, "big") + unit
    return len(message).to_bytes(4, "big") + message


def _children(body):
    count, place = 0, 0
    while place < len(body):
        place += _size(body, place)
        count += 1
    return count


def _size(data, place):
    return int.from_bytes(data[place : place + 4], "big")


def _box(name, body):
    return (8 + len(body)).to_bytes(4, "big") + name + body


def _resized(box, size):
    return size.to_bytes(4, "big") + box[4:]


def gradient(height=48, width=64):
    """Colours and a depth that grows to the right."""
    across = np.linspace(0, 255, width).astype(np.uint8)
    depth = np.broadcast_to(across, (height, width)).copy()
    return np.stack([depth, depth[:, ::-1], depth // 2], -1), depth
