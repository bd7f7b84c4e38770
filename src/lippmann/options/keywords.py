"""Keywords of calls, made from option dataclasses: signatures and docstrings say each option.

Type checkers know the keywords by a ``TypedDict`` beside each dataclass (``**options: Unpack[SceneKeywords]``).
"""

import inspect
import textwrap
from collections.abc import Callable
from typing import Any, TypeVar

from lippmann.options.option import Options, default_of, options_of

F = TypeVar("F", bound=Callable[..., Any])


def takes(*kinds: type[Options], without: tuple[str, ...] = (), **defaults: Any) -> Callable[[F], F]:
    """Say in a function's signature and docstring which options its ``**options`` are: those of the dataclasses.

    ``defaults`` are those that the function has in place of theirs.
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
        return function

    return decorate
