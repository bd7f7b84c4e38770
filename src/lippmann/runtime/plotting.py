"""Matplotlib with its own settings, whatever the working folder, the user or the program set.

While Matplotlib is imported it reads the file ``matplotlibrc`` of the working folder, before that of ``MATPLOTLIBRC``
and that of the user. The file may be anybody's and can change the whole process, such as its locale. If there is one,
Matplotlib is imported from another folder.
"""

from __future__ import annotations

import importlib.util
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The file that Matplotlib reads its settings from.
_SETTINGS = "matplotlibrc"


@contextmanager
def plain_matplotlib(*, salt: str = "") -> Iterator[None]:
    """Draw with Matplotlib's own settings, as SVG whose text stays text.

    Parameters
    ----------
    salt:
        Makes the names of an SVG's parts unlike those of others on one page, and the same in every run.
    """
    import_matplotlib()
    import matplotlib.style

    with matplotlib.style.context(["default", {"svg.fonttype": "none", "svg.hashsalt": salt, "path.simplify": False}]):
        yield


def svg_of(figure: Figure) -> str:
    """The ``<svg>`` element of a figure, the same in every run."""
    drawing = io.StringIO()
    figure.savefig(drawing, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    text = drawing.getvalue()
    return text[text.index("<svg") :]


def import_matplotlib() -> None:
    """Import Matplotlib without the settings of the working folder.

    If that folder holds some, the process is in another folder for a moment.
    """
    if "matplotlib" not in sys.modules and os.path.isfile(_SETTINGS):
        with _working_folder(_own_settings().parent):
            import matplotlib
    else:
        import matplotlib  # noqa: F401


def _own_settings() -> Path:
    """Folder of Matplotlib's own settings, located without importing it."""
    package = importlib.util.find_spec("matplotlib")
    assert package is not None
    assert package.origin is not None
    return Path(package.origin).parent / "mpl-data" / _SETTINGS


@contextmanager
def _working_folder(folder: Path) -> Iterator[None]:
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
