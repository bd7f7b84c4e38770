"""Properties computed once, without the lock that ``functools.cached_property`` has before Python 3.12.

One lock serves a property of all objects there: a thread that holds it while it waits for another lock, or a fork while
any thread holds it, stops all who ask any object for that property.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING or sys.version_info >= (3, 12):
    from functools import cached_property
else:

    class cached_property:  # noqa: N801 - stands in for that of functools
        """Of two threads that ask at once both compute, and both get what the first one kept."""

        def __init__(self, compute):
            self.compute = compute
            self.__doc__ = compute.__doc__

        def __set_name__(self, owner, name):
            self.name = name

        def __get__(self, instance, owner=None):
            # Of a class this answers with itself; of an object only until the value lies in its dictionary.
            return self if instance is None else vars(instance).setdefault(self.name, self.compute(instance))


__all__ = ["cached_property"]
