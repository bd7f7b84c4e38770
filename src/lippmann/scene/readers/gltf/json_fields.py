"""JSON objects whose members are checked as they are read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

from lippmann.errors import SceneError

# Products of two numbers of a file (a colour and its strength) must stay finite in single precision.
LARGEST_NUMBER = 1e18


@dataclass(frozen=True, eq=False)
class Fields:
    """One JSON object of a glTF file.

    A member that is ``null`` counts as absent. Each method raises :class:`SceneError`, naming file, place and value,
    when the member is of another kind than asked for.

    Attributes
    ----------
    place:
        Where the object stands in the file, such as ``materials[3].pbrMetallicRoughness``; empty for the whole file.
    file:
        The file's name.
    """

    values: Mapping[str, object]
    place: str
    file: str

    def error(self, key: str, rule: str) -> SceneError:
        """The error that member ``key`` breaks ``rule``."""
        value = self.values.get(key)
        state = "is missing" if value is None else f"is {_shorten(value)}"
        return SceneError(f"{self._place_of(key)} {state}", where=self.file, rule=rule)

    def has(self, key: str) -> bool:
        """Whether the member is there."""
        return self.values.get(key) is not None

    def names(self) -> list[str]:
        """The names of all members."""
        return list(self.values)

    def integer(self, key: str) -> int:
        """A required whole number, 0 or more."""
        value = self.optional_integer(key)
        if value is None:
            raise self.error(key, "it is required")
        return value

    def optional_integer(self, key: str) -> int | None:
        """A whole number, 0 or more, or None where absent."""
        value = self.values.get(key)
        return None if value is None else self._whole(key, value)

    def integers(self, key: str) -> list[int]:
        """A list of whole numbers, 0 or more; empty where absent."""
        return [self._whole(key, value) for value in self._list(key)]

    def number(
        self, key: str, default: float, *, minimum: float = -LARGEST_NUMBER, maximum: float = LARGEST_NUMBER
    ) -> float:
        """A number within [minimum, maximum]."""
        number = self.optional_number(key)
        if number is None:
            return default
        if not minimum <= number <= maximum:
            limits = f"at least {minimum:g}" if maximum == LARGEST_NUMBER else f"from {minimum:g} to {maximum:g}"
            raise self.error(key, f"it must be {limits}")
        return number

    def optional_number(self, key: str) -> float | None:
        """A number, or None where absent."""
        value = self.values.get(key)
        return None if value is None else self._number(key, value)

    def numbers(self, key: str, count: int) -> list[float] | None:
        """A list of ``count`` numbers, or None where absent."""
        if not self.has(key):
            return None
        values = self._list(key)
        if len(values) != count:
            raise self.error(key, f"{count} numbers belong here")
        return [self._number(key, value) for value in values]

    def text(self, key: str) -> str | None:
        """A string, or None where absent."""
        value = self.values.get(key)
        if value is not None and not isinstance(value, str):
            raise self.error(key, "a string belongs here")
        return value

    def flag(self, key: str, default: bool = False) -> bool:
        """A boolean."""
        value = self.values.get(key)
        if value is None:
            return default
        if not isinstance(value, bool):
            raise self.error(key, "true or false belongs here")
        return value

    def child(self, key: str) -> Fields | None:
        """An object, or None where absent."""
        value = self.values.get(key)
        if value is None:
            return None
        if not isinstance(value, dict):
            raise self.error(key, "an object belongs here")
        return Fields(value, self._place_of(key), self.file)

    def children(self, key: str) -> list[Fields]:
        """A list of objects; empty where absent."""
        children = []
        for i, value in enumerate(self._list(key)):
            if not isinstance(value, dict):
                raise self.error(key, "a list of objects belongs here")
            children.append(Fields(value, f"{self._place_of(key)}[{i}]", self.file))
        return children

    def texts(self, key: str) -> list[str]:
        """A list of strings; empty where absent."""
        texts = []
        for value in self._list(key):
            if not isinstance(value, str):
                raise self.error(key, "a list of strings belongs here")
            texts.append(value)
        return texts

    def extension(self, name: str) -> Fields | None:
        """The object that extension ``name`` adds, or None where absent."""
        extensions = self.child("extensions")
        return None if extensions is None else extensions.child(name)

    def _list(self, key: str) -> list[object]:
        value = self.values.get(key)
        if value is None:
            return []
        if not isinstance(value, list):
            raise self.error(key, "a list belongs here")
        return value

    def _whole(self, key: str, value: object) -> int:
        # JSON does not tell 3 from 3.0, and some writers print the latter.
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= LARGEST_NUMBER:
            raise self.error(key, "a whole number, 0 or more, belongs here")
        return value

    def _number(self, key: str, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.error(key, "a number belongs here")
        if not abs(value) <= LARGEST_NUMBER:  # Python's JSON reader lets NaN and Infinity pass
            raise self.error(key, f"numbers up to {LARGEST_NUMBER:g} are understood")
        return float(value)

    def _place_of(self, key: str) -> str:
        return f"{self.place}.{key}" if self.place else key


def _shorten(value: object) -> str:
    if isinstance(value, dict):
        return "an object"
    if isinstance(value, list) and (len(value) > 16 or any(isinstance(item, (dict, list)) for item in value)):
        return f"a list of {len(value)}"
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
