"""Fingerprints of pictures: names and short texts of all settings, compared before an unfinished picture is resumed."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path

import numpy as np

_LONGEST = 60


def content_hash(value: object) -> str:
    """SHA-256 of a plain value: nested dataclasses, mappings, sequences, arrays, texts and numbers.

    Equal values have equal sums in every process and on every machine. A path contributes the content of its file.
    Fields of dataclasses whose names begin with an underscore are left out.

    Raises
    ------
    TypeError
        If a part is no plain value.
    OSError
        If the file of a path cannot be read.
    """
    digest = hashlib.sha256()
    _feed(digest, value)
    return digest.hexdigest()


def differences(old: Mapping[str, str], new: Mapping[str, str]) -> list[str]:
    """Differences of two fingerprints, a phrase each: ``spp (was 4, is 8)``; long texts are named only.

    Control characters are escaped, since one fingerprint comes from a file.
    """
    phrases = []
    for key in [*old, *(key for key in new if key not in old)]:
        before, after, name = old.get(key), new.get(key), _printable(key)
        if before == after:
            continue
        if before is None or after is None:
            phrases.append(f"{name} ({'is new' if before is None else 'is gone'})")
        elif max(len(before), len(after)) > _LONGEST or _is_sum(before):
            phrases.append(name)
        else:
            phrases.append(f"{name} (was {_printable(before)}, is {_printable(after)})")
    return phrases


def in_words(values: Mapping[str, object], before: str = "") -> dict[str, str]:
    """Fingerprint of nested plain values: names with the prefix ``before``, and texts of the values."""
    texts: dict[str, str] = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            texts |= in_words(value, f"{before}{name} ")
        else:
            texts[f"{before}{name.replace('_', ' ')}"] = repr(value)
    return texts


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)


def _is_sum(text: str) -> bool:
    return len(text) == 64 and all(letter in "0123456789abcdef" for letter in text)


def _feed(digest: hashlib._Hash, value: object) -> None:
    """Feed each part with its kind and length, so that different values give different streams of bytes."""
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


def _head(digest: hashlib._Hash, kind: str, length: int) -> None:
    digest.update(f"{kind}:{length}\n".encode())
