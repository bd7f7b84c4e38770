"""Types of the values that JSON can hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias, Union

#: A value that :mod:`json` writes: a number, a string, a boolean, null, or a list or an object of such values.
JsonValue: TypeAlias = Union[str, float, bool, Sequence["JsonValue"], Mapping[str, "JsonValue"], None]  # noqa: UP007  # strings have no |

#: A JSON object.
JsonObject: TypeAlias = dict[str, JsonValue]
