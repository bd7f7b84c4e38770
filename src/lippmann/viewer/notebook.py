"""How a picture shows itself in a notebook: as the page, where the extra ``notebook`` is installed."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lippmann.image import IntegralImage


def mimebundle(image: IntegralImage) -> Any:
    """The widget as IPython asks for it; None where none can be shown, and a plain picture has to do."""
    if not in_notebook() or find_spec("anywidget") is None:
        return None
    from lippmann.viewer.widget import PictureWidget

    return PictureWidget(image)._repr_mimebundle_()


def in_notebook() -> bool:
    """Whether a notebook's kernel runs this program: a terminal shows no widgets."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return getattr(shell, "kernel", None) is not None
