"""Words of text scene files: a cursor that reads keywords and numbers, and names the line of an error."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.runtime.engine_lock import cached_property
from lippmann.scene.parsing.files import decode_text, read_bytes

# One way to read any word: two ways to split digits would take time by the square of their number.
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?").fullmatch
_INTEGER = re.compile(r"[+-]?[0-9]{1,18}").fullmatch
_FOREIGN = re.compile(r"[^-+.0-9eE]").search  # what no number holds
_WORD = re.compile(r"\S+")
_BREAK = re.compile("\n")
_ONE, _THREE = struct.Struct("=f"), struct.Struct("=3f")
_LONGEST_QUOTED = 40

FLOAT_LIMIT = float(np.finfo(np.float32).max)
"""Numbers of scene files are single precision; larger ones are refused."""


class Words:
    """The words of one file, with a cursor.

    Parameters
    ----------
    text:
        The whole file.
    where:
        Its name, for errors.
    comment:
        Pattern of the text that is no part of the file's meaning; it must not match line breaks.
    single:
        Round numbers to single precision as they are read, which is what the Tachyon program does.
    """

    def __init__(self, text: str, where: str, *, comment: re.Pattern[str], single: bool = False) -> None:
        self.where = where
        self._text = comment.sub("", text)
        self._words = self._text.split()
        self._count = len(self._words)
        self._words.extend([""] * 4)  # reading past the end gives empty words
        self._at = 0
        self._single = single

    @classmethod
    def of_file(cls, path: Path, where: str, *, comment: re.Pattern[str], single: bool = False) -> Words:
        """The words of a file.

        Raises
        ------
        SceneError
            The file is missing, unreadable, empty or not text.
        """
        return cls(decode_text(read_bytes(path), where), where, comment=comment, single=single)

    @property
    def left(self) -> int:
        """Number of unread words."""
        return self._count - self._at

    def peek(self) -> str:
        """The next word, unread; empty at the end of the file."""
        return self._words[self._at]

    def take(self) -> str:
        """The next word; empty at the end of the file."""
        word = self._words[self._at]
        if self._at < self._count:
            self._at += 1
        return word

    def line(self, back: int = 0) -> int:
        """Line (from 1) of the next word, or of the one that was read ``back`` words ago."""
        index = min(self._at - back, self._count - 1)
        if index < 0:
            return 1
        starts, breaks = self._offsets
        return int(np.searchsorted(breaks, starts[index])) + 1

    @cached_property
    def _offsets(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Offsets of words and of line breaks in the text; computed when a line number is first needed."""
        starts = (match.start() for match in _WORD.finditer(self._text))
        breaks = (match.start() for match in _BREAK.finditer(self._text))
        return np.fromiter(starts, np.int64), np.fromiter(breaks, np.int64)

    def place(self, back: int = 0) -> str:
        """File and line of the next word, or of the one read ``back`` words ago."""
        return f"{self.where}:{self.line(back)}"

    def wrong(self, expected: str, *, back: int = 0) -> SceneError:
        """The error that the next word (or the one ``back`` words ago) is not what was expected."""
        index = self._at - back
        word = self._words[index] if index < self._count else ""
        if len(word) > _LONGEST_QUOTED:
            word = word[:_LONGEST_QUOTED] + "..."
        text = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in word)
        what = f"found '{text}'" if word else "the file ends too early"
        return SceneError(what, where=self.place(back), rule=f"expected {expected}")

    def keyword(self, name: str) -> None:
        """Read ``name`` (given in capitals, found in any case)."""
        if self._words[self._at].upper() != name:
            raise self.wrong(name)
        self._at += 1

    def has(self, name: str) -> bool:
        """Read ``name`` if it comes next; whether it did."""
        if self._words[self._at].upper() != name:
            return False
        self._at += 1
        return True

    def name(self, what: str) -> str:
        """A word of free choice, such as the name of a texture."""
        word = self._words[self._at]
        if not word:
            raise self.wrong(what)
        self._at += 1
        return word

    def number(self, keyword: str = "") -> float:
        """A finite number, after ``keyword`` if one is given."""
        if keyword:
            self.keyword(keyword)
        word = self._words[self._at]
        if not _NUMBER(word) or not -FLOAT_LIMIT <= (value := float(word)) <= FLOAT_LIMIT:
            raise self.wrong("a finite number")
        self._at += 1
        return float(_ONE.unpack(_ONE.pack(value))[0]) if self._single else value

    def vector(self, keyword: str = "") -> tuple[float, float, float]:
        """Three finite numbers, after ``keyword`` if one is given."""
        if keyword:
            self.keyword(keyword)
        at = self._at
        a, b, c = self._words[at : at + 3]
        if _NUMBER(a) and _NUMBER(b) and _NUMBER(c):
            x, y, z = float(a), float(b), float(c)
            if max(abs(x), abs(y), abs(z)) <= FLOAT_LIMIT:
                self._at = at + 3
                if self._single:
                    x, y, z = _THREE.unpack(_THREE.pack(x, y, z))
                return x, y, z
        return self.number(), self.number(), self.number()  # the one that is wrong says so

    def check(self, is_valid: Callable[[float], bool], rule: str, keyword: str = "") -> float:
        """A number for which ``is_valid`` holds; ``rule`` names the condition for the error."""
        value = self.number(keyword)
        if not is_valid(value):
            raise self.wrong(rule, back=1)
        return value

    def positive(self, keyword: str = "") -> float:
        """A number above 0."""
        return self.check(lambda value: value > 0, "a number above 0", keyword)

    def radius(self, keyword: str = "") -> float:
        """A number of 0 or more."""
        return self.check(lambda value: value >= 0, "a number of 0 or more", keyword)

    def direction(self, keyword: str = "") -> tuple[float, float, float]:
        """Three numbers that are not all 0."""
        value = self.vector(keyword)
        if not any(value):
            raise self.wrong("a direction, not 0 0 0", back=3)
        return value

    def integer(self, low: int, high: int, keyword: str = "") -> int:
        """A whole number from ``low`` to ``high``, after ``keyword`` if one is given."""
        if keyword:
            self.keyword(keyword)
        word = self._words[self._at]
        if not _INTEGER(word) or not low <= int(word) <= high:
            raise self.wrong(f"a whole number from {low} to {high}")
        self._at += 1
        return int(word)

    def count(self, words_each: int, keyword: str = "") -> int:
        """A whole number of things that follow in the file; it must not promise more words than there are."""
        value = self.integer(0, 2**31 - 1, keyword)
        if value * words_each > self.left:
            raise self.wrong(f"a count that the file can hold (only {self.left} words follow)", back=1)
        return value

    def floats(self, count: int) -> list[float]:
        """``count`` finite numbers, not rounded."""
        words = self._words[self._at : min(self._at + count, self._count)]
        if len(words) == count and not _FOREIGN("".join(words)):  # else float() would read 1_000 and nan
            with suppress(ValueError):
                values = list(map(float, words))
                if not values or (max(values) <= FLOAT_LIMIT and min(values) >= -FLOAT_LIMIT):
                    self._at += count
                    return values
        while True:  # one is wrong, and says so
            self.number()

    def numbers(self, rows: int, columns: int) -> NDArray[np.float64]:
        """``rows`` x ``columns`` finite numbers."""
        values = np.array(self.floats(rows * columns), np.float64).reshape(rows, columns)
        return values.astype(np.float32).astype(np.float64) if self._single else values

    def indices(self, rows: int, columns: int, below: int) -> NDArray[np.int64]:
        """``rows`` x ``columns`` whole numbers from 0 to ``below`` - 1."""
        words = self._words[self._at : min(self._at + rows * columns, self._count)]
        if len(words) == rows * columns and all(map(_INTEGER, words)):
            values = np.array(list(map(int, words)), np.int64)
            if not words or (values.min() >= 0 and values.max() < below):
                self._at += len(words)
                return values.reshape(rows, columns)
        while True:  # one is wrong, and says so
            self.integer(0, below - 1)
