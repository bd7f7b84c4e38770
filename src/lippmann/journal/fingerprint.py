"""What a picture is made of, in a few words each, so that one begun can tell whether it is still the same."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

_LONGEST = 60


def content_hash(value: object) -> str:
    """SHA-256 of a plain value: dataclasses, mappings, sequences, arrays, text and numbers, however nested.

    Equal values have equal sums in every process and on every machine. Of a path it is the content of the file that
    counts, not where it lies. Fields whose names begin with an underscore do not count.

    Raises
    ------
    TypeError
        If some part is no plain value.
    OSError
        If a file that a path names cannot be read.
    """
    digest = hashlib.sha256()
    _feed(digest, value)
    return digest.hexdigest()


def differences(old: Mapping[str, str], new: Mapping[str, str]) -> list[str]:
    """What differs between two fingerprints, a phrase each: ``spp (was 4, is 8)``; texts too long to show are named.

    One of them comes from a file: what it holds is shown without control characters.
    """
    found = []
    for key in [*old, *(key for key in new if key not in old)]:
        before, after, name = old.get(key), new.get(key), _printable(key)
        if before == after:
            continue
        if before is None or after is None:
            found.append(f"{name} ({'is new' if before is None else 'is gone'})")
        elif max(len(before), len(after)) > _LONGEST or _is_sum(before):
            found.append(name)
        else:
            found.append(f"{name} (was {_printable(before)}, is {_printable(after)})")
    return found


def in_words(values: Mapping[str, Any], before: str = "") -> dict[str, str]:
    """Names and texts of nested plain values, for a fingerprint."""
    found: dict[str, str] = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            found |= in_words(value, f"{before}{name} ")
        else:
            found[f"{before}{name.replace('_', ' ')}"] = repr(value)
    return found


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)


def _is_sum(text: str) -> bool:
    return len(text) == 64 and all(letter in "0123456789abcdef" for letter in text)


def _feed(digest: Any, value: object) -> None:
    """Each part with its kind and length, so that no two different values give the same stream of bytes."""
    if value is None or isinstance(value, bool | int | str | bytes):
        text = value if isinstance(value, bytes) else str(value).encode()
        _head(digest, type(value).__name__, len(text))
        digest.update(text)
    elif isinstance(value, float):
        _head(digest, "float", 0)
        digest.update(value.hex().encode() + b"\n")
    elif isinstance(value, Enum):
        _head(digest, "enum", 0)
        _feed(digest, value.value)
    elif isinstance(value, np.ndarray):
        _head(digest, f"array {value.dtype.str} {value.shape}", value.nbytes)
        digest.update(np.ascontiguousarray(value).data if value.size else b"")
    elif isinstance(value, np.generic):
        _head(digest, f"scalar {value.dtype.str}", value.nbytes)
        digest.update(value.tobytes())
    elif isinstance(value, Path):
        data = value.read_bytes()
        _head(digest, "file", len(data))
        digest.update(data)
    elif is_dataclass(value) and not isinstance(value, type):
        parts = [part.name for part in fields(value) if not part.name.startswith("_")]
        _head(digest, type(value).__name__, len(parts))
        for name in parts:
            _feed(digest, name)
            _feed(digest, getattr(value, name))
    elif isinstance(value, Mapping):
        _head(digest, "mapping", len(value))
        for key in sorted(value, key=repr):
            _feed(digest, key)
            _feed(digest, value[key])
    elif isinstance(value, frozenset | set):
        _head(digest, "set", len(value))
        for item in sorted(value, key=repr):
            _feed(digest, item)
    elif isinstance(value, Sequence):
        _head(digest, "sequence", len(value))
        for item in value:
            _feed(digest, item)
    else:
        raise TypeError(f"a {type(value).__name__} is no plain value")


def _head(digest: Any, kind: str, length: int) -> None:
    digest.update(f"{kind}:{length}\n".encode())
