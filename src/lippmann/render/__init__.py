"""The renderers. The package is itself the call ``lippmann.render(scene, display, ...)``.

Importing any module of a package puts that package's name into its parent: once a render has run, ``lippmann.render``
is this package, whatever it was before. So the package answers the call, too.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _RenderPackage(ModuleType):
    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Render a scene into the native pixels of a display; see :func:`lippmann.api.render`."""
        from lippmann.api import render

        return render(*arguments, **options)


sys.modules[__name__].__class__ = _RenderPackage
