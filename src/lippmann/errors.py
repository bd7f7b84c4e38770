"""Errors that a user can act on.

Every error is one line: where it happened, what was found, the rule it breaks and how to mend it. The command line
prints that line alone and leaves with the error's exit code; a library caller catches :class:`LippmannError`.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable
from typing import TypeVar

from lippmann.printable import one_line

E = TypeVar("E", bound="LippmannError")

#: Names that a line lists at most.
_MOST_LISTED = 40
#: Names that are listed beside a likely one at most.
_MOST_BESIDE_LIKELY = 12
#: Letters of an unknown name that a line quotes at most.
_MOST_QUOTED = 80


class LippmannError(Exception):
    """Base of all errors that Lippmann raises on purpose.

    Parameters
    ----------
    what:
        What was found, with the offending value.
    where:
        The file (with line where known); empty if there is none.
    parameter:
        The function's parameter concerned, by its Python name; empty if there is none. ``rule`` and ``fix`` write
        values of parameters as Python does: ``method="full"``. The command line translates both into its options.
    rule:
        What would have been right.
    fix:
        What the user can do about it.

    Examples
    --------
    >>> try:
    ...     lippmann.render("teapot", spp=0)
    ... except lippmann.LippmannError as error:
    ...     print(error.parameter)
    spp
    """

    exit_code = 2

    def __init__(self, what: str, *, where: str = "", parameter: str = "", rule: str = "", fix: str = "") -> None:
        self.what = what
        self.where = where
        self.parameter = parameter
        self.rule = rule
        self.fix = fix
        super().__init__(str(self))

    @classmethod
    def unknown(
        cls: type[E],
        kind: str,
        name: object,
        known: Iterable[str],
        *,
        where: str = "",
        parameter: str = "",
        rule: str = "",
        fix: str = "",
    ) -> E:
        """The error of a ``kind`` of thing called ``name``, which is none of those known: the likeliest come first.

        ``rule`` stands for the list of all that are known; a long one is left out where likely names are said.
        """
        names = list(known)
        quoted = str(name)[:_MOST_QUOTED]
        likely = suggestion(quoted, names)
        listed = ", ".join(names[:_MOST_LISTED]) + (", ..." if len(names) > _MOST_LISTED else "")
        if not rule and not (likely and len(names) > _MOST_BESIDE_LIKELY):
            rule = f"known are {listed}" if names else "there is none"
        what = f"unknown {kind} '{quoted}'{likely}" if quoted else f"no {kind}"
        return cls(what, where=where, parameter=parameter, rule=rule, fix=fix)

    @classmethod
    def refuse_unknown(
        cls, kind: str, names: Iterable[object], known: Collection[str], *, where: str = "", parameter: str = ""
    ) -> None:
        """Raise :meth:`unknown` of the first name, if any, that is not known."""
        for name in names:
            if name not in known:
                raise cls.unknown(kind, name, known, where=where, parameter=parameter)

    def __str__(self) -> str:
        head = ": ".join(part for part in (self.where, self.parameter, self.what) if part)
        line = "; ".join(part for part in (head, self.rule, self.fix) if part)
        # A value quoted from a file may hold line breaks, and what commands a terminal.
        return one_line(" ".join(line.split()))

    def __reduce__(self) -> tuple[object, ...]:
        # Keyword-only fields are lost by the default pickling, which worker processes rely on.
        return (_rebuild, (type(self), self.what, self.where, self.parameter, self.rule, self.fix))


def suggestion(name: object, known: Iterable[str]) -> str:
    """``, did you mean 'x'?`` with the known names that are most like ``name``; empty if none is."""
    names = list(known)
    near = [each for each in names if each.lower() == str(name).lower()] or difflib.get_close_matches(
        str(name), names, n=3
    )
    return f", did you mean {' or '.join(repr(each) for each in near)}?" if near else ""


def _rebuild(kind: type[LippmannError], what: str, where: str, parameter: str, rule: str, fix: str) -> LippmannError:
    return kind(what, where=where, parameter=parameter, rule=rule, fix=fix)


class UsageError(LippmannError):
    """A parameter whose value cannot be honoured."""


class SceneError(LippmannError):
    """A scene file that is missing, damaged, foreign or beyond what can be rendered.

    Examples
    --------
    >>> print(lippmann.plugins.SceneError("is no OFF file", where="gem.off", rule="its first line is OFF"))
    gem.off: is no OFF file; its first line is OFF
    """


class DisplayError(LippmannError):
    """A display description that is unknown, incomplete or physically impossible.

    Examples
    --------
    >>> lippmann.load_display("portait")
    Traceback (most recent call last):
    ...
    lippmann.errors.DisplayError: display: unknown display 'portait', did you mean 'portrait'...
    """


class PictureError(LippmannError):
    """A picture that cannot be read, or that does not fit what is asked of it.

    Examples
    --------
    >>> lippmann.read_picture("none.png")
    Traceback (most recent call last):
    ...
    lippmann.errors.PictureError: none.png...
    """


class OutputError(LippmannError):
    """A place that cannot be written: unknown format, missing permission, full disk.

    Examples
    --------
    >>> lippmann.render("teapot", integrator="normal", spp=1).save("teapot.bmp")
    Traceback (most recent call last):
    ...
    lippmann.errors.OutputError: teapot.bmp...
    """


class MemoryLimitError(LippmannError):
    """The memory limit is too small for the smallest piece of work."""


class EngineError(LippmannError):
    """The rendering engine cannot run on this machine as it is."""

    exit_code = 1


class ClusterError(LippmannError):
    """A cluster that cannot be reached, was lost, or could not render all tiles."""

    exit_code = 1
