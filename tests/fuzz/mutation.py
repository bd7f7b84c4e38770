"""Damage to files: bytes, words, lines and JSON trees changed at random, from an explicit seed."""

from __future__ import annotations

import json
import random
import re
import struct
from collections.abc import Callable, Sequence
from typing import Any

#: Inputs are cut at this length.
LONGEST = 1 << 19

#: Damage makes inputs longer than this only where it is meant to: what is long is slow to read, seldom odder.
_USUAL = 1 << 16

#: Share of inputs that are made long, so that what readers do in pieces and tables meets damage, too.
_LONG = 1 / 500

#: Words are looked for in so many bytes, somewhere: in all of a long input that would take longer than reading it.
_PART = 2048

_WORD = re.compile(rb'[-+]?[0-9][0-9.]*(?:[eE][-+]?[0-9]+)?|[A-Za-z_][A-Za-z_0-9]*|"[^"\n]*"|[^\s]')

_NUMBERS = [
    *(b"0", b"-0", b"1", b"-1", b"0.5", b"2", b"3", b"7", b"255", b"256", b"65535", b"65536", b"1e99", b"1e38"),
    *(b"3.5e38", b"1e308", b"1e400", b"-1e400", b"1e-45", b"1e-320", b"nan", b"inf", b"-inf", b"NaN", b"Infinity"),
    *(b"2147483647", b"2147483648", b"-2147483648", b"4294967295", b"4294967296", b"9223372036854775807"),
    *(b"99999999999999999999", b"9" * 5000, b"1_0", b"0x10", b"1.", b".5", b"+", b"-", b"1e", "٣".encode(), b"1,5"),
]
_PLAIN = [
    *(b"", b'""', b"''", b"{}", b"[]", b"null", b"true", b"false", b"\0", b"\xff", b"\xef\xbb\xbf", b"\r", b"\r\n"),
    *(b"\\", b"/", b"..", b"../", b"#", b"=", b":", b",", b"{", b"}", b"[", b"]", b'"', b"\x7f", b"\xc3\xa9", b"\t"),
    *("\u2028".encode(), "\ud800".encode("utf-8", "surrogatepass"), b"%00", b"%s", b"~", b"*", b"x" * 300),
]
_VALUES: list[Any] = [
    *(None, True, False, 0, 1, -1, 2, 3, 5, 255, 65536, 1 << 31, 1 << 32, 1 << 63, 10**30, 10**400, 0.5, -0.5, 1e99),
    *(1e308, 1e-308, -0.0, float("nan"), float("inf"), "", "x", "\0", "\ud800", "a/../b", "data:,", [], {}, [[]]),
    *([0], [0, 0, 0], [None], [1, 2, 3, 4], {"": 0}, "x" * 300),
]


class Mutator:
    """Makes damaged inputs out of sound ones.

    Parameters
    ----------
    seeds:
        Sound inputs, at least one; :meth:`keep` adds to them.
    words:
        Words that mean something to the reader.
    tree:
        For inputs with a JSON tree: gives it, and what makes an input of a changed one.
    repair:
        What mends check sums and lengths, so that damage reaches what lies behind them; done to half of the inputs.
    seed:
        Of the random numbers.
    """

    def __init__(
        self,
        seeds: Sequence[bytes],
        words: Sequence[bytes] = (),
        *,
        tree: Callable[[bytes], tuple[Any, Callable[[bytes], bytes]]] | None = None,
        repair: Callable[[bytes], bytes] | None = None,
        seed: int = 0,
    ) -> None:
        self._random = random.Random(seed)
        self._pool = list(seeds)
        self._sound = len(self._pool)
        self._words = [*_NUMBERS, *_PLAIN, *words, *words]
        self._tree = tree
        self._repair = repair

    def keep(self, data: bytes) -> None:
        """Let further inputs be made of this one, too."""
        self._pool.append(data)

    def next(self) -> bytes:
        """A damaged input."""
        pick = self._random
        # Half of all inputs come straight from a sound one: many kinds of damage at once end early.
        data = pick.choice(self._pool[: self._sound] if pick.random() < 0.5 else self._pool)
        longest = len(data)
        for _ in range(pick.choice((1, 1, 1, 2, 2, 3, 5, 8))):
            if self._tree is not None and pick.random() < 0.4:
                data = self._in_tree(data)
            else:
                data = pick.choice((self._in_bytes, self._in_bytes, self._in_words, self._in_words, self._in_lines))(
                    data
                )
            data = data[: max(_USUAL, longest)]
        if pick.random() < _LONG:
            data = self._long(data)
        if self._repair is not None and pick.random() < 0.5:
            data = self._repair(data)
        return data

    def _span(self, length: int) -> tuple[int, int]:
        start = self._random.randint(0, length)
        size = self._random.choice((1, 1, 2, 4, 8, 16, 64, 256, length))
        return start, min(length, start + size)

    def _long(self, data: bytes) -> bytes:
        """A part repeated until the whole is longer than 64 KiB, some of it damaged."""
        pick, (start, stop) = self._random, self._span(len(data))
        part = data[start:stop] or b"\0"
        times = (pick.randrange(_USUAL, LONGEST) - len(data)) // len(part)
        return (data[:start] + self._in_bytes(part * max(2, times)) + data[stop:])[:LONGEST]

    def _in_bytes(self, data: bytes) -> bytes:
        pick, changed = self._random, bytearray(data)
        start, stop = self._span(len(data))
        how = pick.randrange(8)
        if how == 0 and data:
            changed[pick.randrange(len(data))] ^= 1 << pick.randrange(8)
        elif how == 1:
            changed[start:stop] = pick.randbytes(stop - start)
        elif how == 2:
            del changed[start:stop]
        elif how == 3:
            changed[start:start] = data[start:stop] * pick.choice((1, 2, 16))
        elif how == 4:
            del changed[start:]
        elif how == 5:
            code = pick.choice("bBhHiIqQ")
            size = struct.calcsize(code)
            top = 1 << (8 * size)
            odd = (0, 1, 2, 3, 4, 16, 255, top // 2 - 1, top // 2, top - 1, top - 2)
            number = pick.choice((*odd, pick.randrange(top)))
            changed[start : start + size] = (number % top).to_bytes(size, pick.choice(("little", "big")))
        elif how == 6:
            changed[start:stop] = pick.choice((b"\0", b"\xff", b" ", b"\n")) * (stop - start)
        else:
            other = pick.choice(self._pool)
            changed[start:stop] = other[slice(*self._span(len(other)))]
        return bytes(changed)

    def _in_words(self, data: bytes) -> bytes:
        pick = self._random
        first = pick.randrange(max(1, len(data) - _PART))
        places = [match.span() for match in _WORD.finditer(data, first, first + _PART)]
        if not places:
            return data + pick.choice(self._words)
        start, stop = pick.choice(places)
        how, word = pick.randrange(8), data[start:stop]
        if how <= 2:
            word = pick.choice(self._words)
        elif how == 3:
            word = b""
        elif how == 4:
            word = pick.choice(self._words) + pick.choice((b"", b" ", b"\n")) + word
        elif how == 5:
            word = b" ".join([word] * pick.choice((2, 3, 20)))
        elif how == 6:
            word = word[:100] * pick.choice((2, 30, 3000))  # deep nesting, long names
        else:
            other = slice(*pick.choice(places))
            word = data[other]
        return data[:start] + word + data[stop:]

    def _in_lines(self, data: bytes) -> bytes:
        pick, lines = self._random, data.split(b"\n")
        at, other = pick.randrange(len(lines)), pick.randrange(len(lines))
        how = pick.randrange(5)
        if how == 0:
            del lines[at]
        elif how == 1:
            lines[at:at] = [lines[other][:1000]] * pick.choice((1, 1, 5, 200))
        elif how == 2:
            lines[at], lines[other] = lines[other], lines[at]
        elif how == 3:
            del lines[min(at, other) : max(at, other)]
        else:
            lines.insert(at, pick.choice(pick.choice(self._pool).split(b"\n")))
        return b"\n".join(lines)

    def _in_tree(self, data: bytes) -> bytes:
        assert self._tree is not None
        try:
            tree, rebuilt = self._tree(data)
            places = list(_places(tree))
            if not places:
                return data
            holder, key = self._random.choice(places)
            self._change(tree, holder, key)
            return rebuilt(json.dumps(tree, ensure_ascii=True).encode())
        except (ValueError, OverflowError, RecursionError):  # no tree is left in it, or a number of absurd size
            return data

    def _change(self, tree: Any, holder: Any, key: Any) -> None:
        pick = self._random
        how = pick.randrange(7)
        if how <= 2:
            holder[key] = pick.choice(_VALUES)
        elif how == 3:
            del holder[key]
        elif how == 4:
            other, name = pick.choice(list(_places(tree)))
            holder[key] = json.loads(json.dumps(other[name]))  # a copy: trees have no loops
        elif how == 5 and isinstance(holder, list):
            holder.insert(key, json.loads(json.dumps(holder[key])))
        elif isinstance(holder[key], int | float) and not isinstance(holder[key], bool):
            holder[key] = holder[key] + pick.choice((-1, 1, 0.5)) if pick.random() < 0.6 else -holder[key]
        elif isinstance(holder, dict):
            holder[pick.choice(self._words).decode("latin-1")] = holder.pop(key)


def json_tree(data: bytes) -> tuple[Any, Callable[[bytes], bytes]]:
    """The tree of a JSON text, for :class:`Mutator`."""
    return json.loads(data), lambda text: text


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """Every value of a tree, as the list or dictionary that holds it and its place there."""
    found: list[tuple[Any, Any]] = []
    left = [tree]
    while left:
        holder = left.pop()
        keys = range(len(holder)) if isinstance(holder, list) else holder if isinstance(holder, dict) else ()
        for key in keys:
            found.append((holder, key))
            left.append(holder[key])
    return found
