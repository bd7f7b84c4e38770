"""Entry points by which other packages add readers, displays, exports and integrators (``docs/how-to/extend.md``).

They are looked for only where a word is none of Lippmann's own: that reads the metadata of all that is installed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Generic, TypeVar

from lippmann.errors import LippmannError

#: A function, or ``"module:function"``, which is imported when it is first called.
Target = Callable[..., Any] | str

P = TypeVar("P", bound="Extension")


class Extension:
    """The object that an entry point names."""

    #: Its group of entry points.
    group: ClassVar[str]

    def claims(self, name: str) -> tuple[str, ...]:
        """Words by which users ask for it; ``name`` is that of its entry point."""
        return (name,)

    def fault(self) -> str:
        """The fault in its fields; empty if all is well."""
        return ""


@dataclass(frozen=True)
class Plugin(Generic[P]):
    """An extension, and where it comes from.

    Attributes
    ----------
    name:
        Of its entry point.
    distribution:
        Name and version of the package that it belongs to; empty for Lippmann's own.
    claims:
        Words by which users ask for it; none where it is broken.
    problem:
        Why it is broken, in one line.
    extension:
        The extension; None where it is broken.
    """

    name: str
    distribution: str
    claims: tuple[str, ...] = ()
    problem: str = ""
    extension: P | None = None

    @property
    def value(self) -> P:
        """The extension of one that is not broken."""
        assert self.extension is not None, self.problem
        return self.extension

    def __str__(self) -> str:
        return f"{self.name} of {self.distribution}"

    @contextmanager
    def guard(self, error: type[LippmannError], where: str = "") -> Iterator[None]:
        """Context manager for code of another package: turns its exceptions into ``error``."""
        try:
            yield
        except LippmannError:
            raise
        except Exception as fault:
            if not self.distribution:
                raise
            raise error(f"the plugin {self} failed ({_words(fault)})", where=where) from fault


@dataclass(frozen=True)
class Door(Generic[P]):
    """All extensions of one kind: Lippmann's own, which no other may replace, and those of other packages.

    Attributes
    ----------
    kind:
        Their class.
    own:
        Lippmann's, by the names that their entry points would have.
    """

    kind: type[P]
    own: Mapping[str, P]

    @cached_property
    def own_claims(self) -> dict[str, Plugin[P]]:
        """Lippmann's own by what they claim."""
        own = (Plugin(name, "", value.claims(name), extension=value) for name, value in self.own.items())
        return {claim: each for each in own for claim in each.claims}

    @cached_property
    def plugins(self) -> tuple[Plugin[P], ...]:
        """Those of other packages, broken ones too, by name."""
        from importlib.metadata import entry_points  # slow to import, and to ask

        plugins: list[Plugin[P]] = []
        owners = dict.fromkeys(self.own_claims, "Lippmann")
        for entry in sorted(entry_points(group=self.kind.group), key=lambda each: (each.name, each.value)):
            distribution = "an unknown package" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"
            try:
                value = entry.load()
                problem = self._fault(value)
                claims = () if problem else value.claims(entry.name)
            except Exception as fault:  # noqa: BLE001  # code of others
                problem, claims = _words(fault), ()
            problem = problem or next((f"'{each}' belongs to {owners[each]}" for each in claims if each in owners), "")
            plugin: Plugin[P] = Plugin(entry.name, distribution, problem=problem)
            if not problem:
                plugin = Plugin(entry.name, distribution, claims, extension=value)
            owners.update(dict.fromkeys(plugin.claims, str(plugin)))
            plugins.append(plugin)
        return tuple(plugins)

    def find(self, claim: str) -> Plugin[P] | None:
        """The extension of a word, Lippmann's own first; None if there is none."""
        return self.own_claims.get(claim) or next((each for each in self.plugins if claim in each.claims), None)

    def claims(self) -> list[str]:
        """All words by which extensions are asked for."""
        return [*self.own_claims, *(claim for each in self.plugins for claim in each.claims)]

    @property
    def problems(self) -> str:
        """Problems of other packages' broken plugins, for the error of an unknown word."""
        broken = [f"the plugin {each} is broken ({each.problem})" for each in self.plugins if each.problem]
        return ", and ".join(broken)

    def _fault(self, value: object) -> str:
        if not isinstance(value, self.kind):
            return f"it names a {type(value).__name__}, and has to name a lippmann.plugins.{self.kind.__name__}"
        return value.fault()


def function_of(target: Target) -> Callable[..., Any]:
    """The function, imported if need be."""
    if callable(target):
        return target
    from pkgutil import resolve_name

    target_object: Callable[..., Any] = resolve_name(target)
    return target_object


def _words(fault: BaseException) -> str:
    """An exception in one line."""
    return " ".join(f"{type(fault).__name__}: {fault}".split())
