"""``functools.cached_property`` without the lock that it has before Python 3.12.

That lock is shared by the property of all objects. A thread that waits for another lock while it holds it, or a fork
while any thread holds it, deadlocks every access to the property.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING or sys.version_info >= (3, 12):
    from functools import cached_property
else:

    class cached_property:  # noqa: N801 - stands in for that of functools
        """If two threads access the property at once, both compute it, and both get the value that was stored first."""

        def __init__(self, compute):
            self.compute = compute
            self.__doc__ = compute.__doc__

        def __set_name__(self, owner, name):
            self.name = name

        def __get__(self, instance, owner=None):
            # For an object this is called only until the value is in its dictionary.
            return self if instance is None else vars(instance).setdefault(self.name, self.compute(instance))


__all__ = ["cached_property"]
