"""Display of a picture in a Jupyter notebook: as the viewer, where the extra ``notebook`` is installed."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

from lippmann.progress_bar import in_notebook

if TYPE_CHECKING:
    from lippmann.image import IntegralImage


def mimebundle(image: IntegralImage) -> object:
    """MIME bundle of the picture's widget for IPython; None outside notebooks or without the extra."""
    if not in_notebook() or find_spec("anywidget") is None:
        return None
    from lippmann.viewer.widget import PictureWidget

    bundle = PictureWidget(image)._repr_mimebundle_()
    data = bundle[0] if isinstance(bundle, tuple) else bundle
    assert data is not None  # of a widget that has a view
    data["text/plain"] = repr(image)  # where widgets are not shown
    return bundle
