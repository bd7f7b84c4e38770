"""An option: a field of a frozen dataclass that knows its meaning, its range, and how the command line shows it.

A field of a subclass of :class:`Options` that is made by :func:`option` becomes an option of the commands that take its
class (:mod:`lippmann.cli.shared.command_options`), a keyword of the calls that do (:func:`takes`),
and a setting of the studio and its files. It has the same name everywhere, with ``-`` for ``_`` on the command line.

Annotations of such classes are types, not texts: their modules do without ``from __future__ import annotations``.

Arguments of a call that are no options are :func:`checked` by their annotations.
"""

import inspect
import math
import re
import textwrap
import types
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from functools import wraps
from numbers import Integral, Real
from operator import index
from pathlib import Path
from typing import Any, ClassVar, Literal, TypeVar, Union, get_args, get_origin

from lippmann.errors import UsageError
from lippmann.printable import shorten

T = TypeVar("T", bound="Options")

#: Key of a field's metadata.
_KEY = "option"
#: An upper end that keeps numbers representable alone, and tells people nothing.
_UNTOLD = 1e15
#: Another option, named in a help text.
_OPTION = re.compile(r"`(\w+)`")


@dataclass(frozen=True)
class Option:
    """Facts of an option beside its name, its type and its default.

    Parameters
    ----------
    help:
        What it does. Another option is written as `` `spp` ``.
    group:
        Heading under which help lists it.
    first:
        Whether the first help shows it; else the help of all options does.
    low, high:
        Range of a number; ``excludes_low`` leaves the lowest out.
    rule:
        The range in words, for errors.
    metavar:
        What stands for the value in help.
    default_text:
        What help calls a default of None.
    read:
        Value of the words of the command line; they and the option's flag are handed over.
    words:
        Type of the words, where it is not that of the field, or with ``read`` not one text.
    is_file:
        Whether it names a file.
    flag:
        Name on the command line, where it is not the field's.
    door:
        ``"module:name"`` of the :class:`~lippmann.runtime.plugins.Door` whose further words are taken, too.
    """

    help: str
    group: str
    first: bool = False
    low: float = -math.inf
    high: float = math.inf
    excludes_low: bool = False
    rule: str = ""
    metavar: str | None = None
    default_text: str | None = None
    read: Callable[[Any, str], Any] | None = None
    words: Any = None
    is_file: bool = False
    flag: str = ""
    door: str = ""

    @property
    def help_in_flags(self) -> str:
        """The help with other options as the command line names them."""
        return _OPTION.sub(lambda match: flag_of(match[1]), self.help)

    def flag_of(self, name: str) -> str:
        """The option of the command line that sets the field ``name``."""
        return flag_of(self.flag or name)

    @property
    def help_in_python(self) -> str:
        """The help with other options as keywords, and the range."""
        least = f"Above {self.low:g}, at most" if self.excludes_low else f"{self.low:g} to"
        text = f"{least} {self.high:.10g}."
        is_left_out = self.low == -math.inf or self.high > _UNTOLD or text in self.help
        return _OPTION.sub(r"``\1``", self.help) + ("" if is_left_out else f" {text}")

    def check(self, name: str, value: object, kind: Any) -> None:
        """Refuse a value that is not of the annotated type ``kind``, or out of range.

        Raises
        ------
        UsageError
            Of the parameter ``name``.
        """
        kinds = kinds_of(kind)
        choices = [word for each in kinds if get_origin(each) is Literal for word in get_args(each)]
        if (value is None and type(None) in kinds) or (isinstance(value, str) and value in choices):
            return
        if any(get_origin(each) is Mapping for each in kinds):
            if not isinstance(value, Mapping):
                raise UsageError(f"{value!r}", parameter=name, rule=self.rule or "must be a dict of texts by name")
        elif bool in kinds:
            if value not in (True, False):
                raise UsageError(f"{value!r}", parameter=name, rule=self.rule or "must be True, False or None")
        elif int in kinds or float in kinds:
            self._check_number(name, value, int in kinds)
        elif count := len(_parts_of(kind)):
            if not (isinstance(value, tuple) and len(value) == count and all(map(self._is_finite_in_range, value))):
                raise UsageError(f"{value!r}", parameter=name, rule=self.rule or f"must be {count} finite numbers")
        elif choices:
            self._check_word(name, value, choices)

    def _check_word(self, name: str, value: object, choices: list[str]) -> None:
        """Only words that are no choices are looked for among those of plugins."""
        if not self.door:
            raise UsageError.unknown(name, value, choices, parameter=name)
        from pkgutil import resolve_name

        door = resolve_name(self.door)
        if door.find(value) is None:
            known = [*dict.fromkeys((*choices, *door.claims()))]
            raise UsageError.unknown(name, value, known, parameter=name, fix=door.problems)

    def _check_number(self, name: str, value: object, is_whole: bool) -> None:
        if not self._is_in_range(value, int if is_whole else Real):
            rule = f"must be {f'a whole number from {self.low}' if is_whole else f'a number from {self.low:g}'}"
            raise UsageError(f"{value!r}", parameter=name, rule=self.rule or f"{rule} to {self.high}")

    def _is_in_range(self, value: Any, kind: type) -> bool:
        is_number = isinstance(value, kind) and not isinstance(value, bool)
        return is_number and self.low <= value <= self.high and (value != self.low or not self.excludes_low)

    def _is_finite_in_range(self, value: Any) -> bool:
        return self._is_in_range(value, Real) and math.isfinite(value)


def option(default: Any, help: str, **facts: Any) -> Any:
    """A field of an :class:`Options` class; ``facts`` are those of :class:`Option`."""
    return field(default=default, metadata={_KEY: Option(help, **facts)})


def again(kind: type, name: str, **changes: Any) -> Any:
    """A field of ``kind`` for a subclass that has it with another type or default."""
    each, its = next(entry for entry in options_of(kind) if entry[0].name == name)
    return field(default=changes.get("default", each.default), metadata={_KEY: its})


def _own_number(value: object) -> object:
    """A number of another library, such as NumPy, as Python's own, which JSON takes; other values as they are."""
    if isinstance(value, bool):
        return value
    return int(value) if isinstance(value, Integral) else float(value) if isinstance(value, Real) else value


@dataclass(frozen=True)
class Options:
    """Base of what is asked for: every option is checked by itself."""

    #: Name of the thing that the options belong to, and the keyword that takes them all, for errors.
    noun: ClassVar[str] = "render"
    keyword: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for each, its in options_of(type(self)):
            value = getattr(self, each.name)
            is_list = _parts_of(each.type) and isinstance(value, Iterable)
            value = tuple(map(_own_number, value)) if is_list else _own_number(value)
            its.check(each.name, value, each.type)
            object.__setattr__(self, each.name, value)

    @classmethod
    def of(cls: type[T], values: Mapping[str, object]) -> T:
        """The options of keywords.

        Raises
        ------
        UsageError
            A name or a value is not known.
        """
        known = [each.name for each in fields(cls) if each.compare]
        if unknown := [name for name in values if name not in known]:
            options = [each.name for each, _ in options_of(cls)]
            raise UsageError.unknown(f"option of a {cls.noun}", unknown[0], options, parameter=cls.keyword)
        return cls(**values)

    @classmethod
    def part_of(cls: type[T], values: object) -> T:
        """These options as an object has them that has more."""
        return cls(**{each.name: getattr(values, each.name) for each, _ in options_of(cls)})


def options_of(kind: type) -> Iterator[tuple[Field[Any], Option]]:
    """Fields that are options, and what is known of them."""
    return ((each, each.metadata[_KEY]) for each in fields(kind) if _KEY in each.metadata)


def default_of(each: Field[Any]) -> Any:
    """The default of a field that is an option."""
    assert each.default is not MISSING
    return each.default


def changed_options(options: Options, assumed: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Values by name of the options that differ from the defaults, or from what is ``assumed`` in their place."""
    usual = {each.name: default_of(each) for each, _ in options_of(type(options))} | dict(assumed or {})
    values = {each.name: getattr(options, each.name) for each, _ in options_of(type(options))}
    return {name: value for name, value in values.items() if value != usual[name]}


def kinds_of(kind: Any) -> tuple[Any, ...]:
    """The members of a union, or the one type."""
    return get_args(kind) if get_origin(kind) in (Union, types.UnionType) else (kind,)


def _parts_of(kind: Any) -> tuple[Any, ...]:
    """The types of a tuple's elements, where ``kind`` is one or may be None; else empty."""
    return next((get_args(each) for each in kinds_of(kind) if get_origin(each) is tuple), ())


def flag_of(name: str) -> str:
    """The option of the command line."""
    return f"--{name.replace('_', '-')}"


F = TypeVar("F", bound=Callable[..., Any])


def takes(*kinds: type[Options], without: tuple[str, ...] = (), **defaults: Any) -> Callable[[F], F]:
    """Say in a function's signature and docstring which options its ``**options`` are: those of the dataclasses.

    ``defaults`` are those that the function has in place of theirs. Its other arguments are :func:`checked`.
    """

    def decorate(function: F) -> F:
        chosen = [(each, its) for kind in kinds for each, its in options_of(kind) if each.name not in without]
        signature = inspect.signature(function)
        own = [each for each in signature.parameters.values() if each.kind is not inspect.Parameter.VAR_KEYWORD]
        keywords = [
            inspect.Parameter(
                each.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=defaults.get(each.name, default_of(each)),
                annotation=each.type,
            )
            for each, _ in chosen
        ]
        function.__signature__ = signature.replace(parameters=[*own, *keywords])  # type: ignore[attr-defined]
        entries = "".join(
            f"{each.name}:\n{textwrap.fill(its.help_in_python, 112, initial_indent='    ', subsequent_indent='    ')}\n"
            for each, its in chosen
        )
        before, _, after = inspect.cleandoc(function.__doc__ or "").partition("**options:\n")
        function.__doc__ = f"{before}{entries}{after.partition(chr(10))[2]}"
        return checked(function)

    return decorate


# ---- Arguments that are no options ---------------------------------------------------------------------------------


def checked(function: F) -> F:
    """Refuse arguments of ``function``, or of a dataclass, that are none of the kinds that their annotations name.

    Values become that kind: NumPy's numbers Python's, and texts paths where no text is named before them. Annotations
    are read as written, in modules that import ``annotations`` from ``__future__``. A parameter whose annotation names
    any other type than :data:`_KINDS` is left to the function, and so are options, which have checks of their own.
    """
    if isinstance(function, type):
        function.__init__ = checked(function.__init__)  # type: ignore[misc]
        return function
    parameters = inspect.signature(function).parameters
    written = {name: "bool" if each.annotation is bool else each.annotation for name, each in parameters.items()}
    kinds = {name: text.split(" | ") for name, text in written.items() if isinstance(text, str)}
    known = {name: each for name, each in kinds.items() if _KINDS.keys() >= {*each}}

    @wraps(function)
    def call(*values: Any, **named: Any) -> Any:
        first = [_checked(name, value, known.get(name)) for name, value in zip(parameters, values, strict=False)]
        others = {name: _checked(name, value, known.get(name)) for name, value in named.items()}
        return function(*first, *values[len(first) :], **others)

    return call  # type: ignore[return-value]


def _checked(name: str, value: Any, kinds: list[str] | None) -> Any:
    if kinds is None:
        return value
    for kind in kinds:
        try:
            return _KINDS[kind][1](value)
        except (AttributeError, LookupError, TypeError, ValueError):
            continue
    words = [_KINDS[kind][0] for kind in kinds]
    rule = " or ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)
    fix = next((f"{_MAKERS[kind]} gives one" for kind in kinds if kind in _MAKERS and "str" not in kinds), "")
    raise UsageError(shorten(value), parameter=name, rule=f"must be {rule}", fix=fix)


def _instance(name: str) -> Callable[[Any], Any]:
    """A value of the class of this name: by its name, as the library's own classes are not to be loaded here."""

    def as_it_is(value: Any) -> Any:
        if name not in {each.__name__ for each in type(value).__mro__}:
            raise TypeError
        return value

    return as_it_is


def _function(value: Any) -> Any:
    if not callable(value):
        raise TypeError
    return value


def _number(value: Any) -> float:
    if not isinstance(value, Real):
        raise TypeError
    return float(value)


def _numbers(value: Any) -> list[float]:
    if not len(value):
        raise ValueError
    return [_number(each) for each in value]


def _pair(value: Any) -> tuple[int, int]:
    first, second = value
    return index(first), index(second)


def _colours(value: Any) -> Any:
    if len(value.shape) != 3 or value.shape[2] != 3:
        raise ValueError
    return value


def _titled(value: Any) -> list[tuple[str, Any]]:
    return [(_instance("str")(title), _instance("Picture")(picture)) for title, picture in value]


#: What is said of a kind, by the name that annotations have for it, and what reads a value or raises.
_KINDS: dict[str, tuple[str, Callable[[Any], Any]]] = {
    "None": ("None", _instance("NoneType")),
    "bool": ("True or False", {True: True, False: False}.__getitem__),
    "int": ("a whole number", index),
    "float": ("a number", _number),
    "bytes": ("bytes", _instance("bytes")),
    "str": ("a text", _instance("str")),
    "Path": ("a path", Path),
    "tuple[int, int]": ("two whole numbers", _pair),
    "Sequence[float]": ("numbers, at least one", _numbers),
    "Values": ("an array (height, width, 3)", _colours),
    "Mapping[str, Layer]": ("a mapping of names to arrays", dict),
    "Sequence[tuple[str, Picture]]": ('titles and pictures, such as [("teapot", image)]', _titled),
    **dict.fromkeys(("ProgressCallback", "Runner"), ("a function", _function)),
    **{
        name: (f"a {name}", _instance(name))
        for name in (
            "Display", "LargePicture", "MitsubaSource", "Monitor", "Motion", "Pattern", "Picture",
            "Provenance", "Quilt", "QuiltLayout", "SceneDescription", "TransferFunction",
        )
    },
    **{name: (f"an {name}", _instance(name)) for name in ("Environment", "IntegralImage")},
}  # fmt: skip

#: Where a value comes from that only the library makes, for the fix.
_MAKERS = {
    "Display": "lippmann.load_display",
    "IntegralImage": "lippmann.render",
    "Motion": "lippmann.sequences.motion.open_motion",
    "Picture": "lippmann.read_picture",
}
