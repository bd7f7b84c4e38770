"""Views brought to the shape of a panel, so that nothing on it is stretched."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np

from lippmann.image.encoding import converted_values
from lippmann.image.stored_values import Stored
from lippmann.quilts.photos import NO_SHIFT, Fit, fit_window
from lippmann.quilts.quilt import Quilt
from lippmann.quilts.weave import ASPECT_TOLERANCE


def fit_views(quilt: Quilt, shape: float, fit: Fit) -> tuple[Quilt, tuple[float, float]]:
    """A quilt whose views have the shape of a panel, and the shares of their width and height that are cut off.

    Parameters
    ----------
    quilt:
        The views; their shape is the aspect ratio that the layout states, or else that of square pixels.
    shape:
        Width over height of the panel. Views of nearly this shape are left as they are.
    fit:
        ``cover`` crops what is too long, ``contain`` leaves white paper, ``stretch`` changes the proportions.
    """
    width, height = quilt.view_size
    aspect = quilt.layout.aspect or width / height
    layout = quilt.layout._replace(aspect=shape)
    if fit == "stretch" or abs(aspect / shape - 1.0) <= ASPECT_TOLERANCE:
        return replace(quilt, layout=layout), (0.0, 0.0)
    window = fit_window((aspect * height, height), (shape, 1.0), 0, 1, fit, NO_SHIFT)
    scale = width / (aspect * height)
    left, top = round(window.box[0] * scale), round(window.box[1])
    right, bottom = left + round((window.box[2] - window.box[0]) * scale), top + round(window.box[3] - window.box[1])
    size = (bottom - top) * layout.rows, (right - left) * layout.columns
    held = cast(Stored, quilt.values.dtype.name)
    white = converted_values(np.ones((1, 1, 3), np.float32), held, quilt.provenance.transfer)
    fitted = replace(quilt, values=np.full((*size, 3), white[0, 0], quilt.values.dtype), layout=layout)
    for number in range(layout.views):
        part = quilt.view_values(number)[max(top, 0) : bottom, max(left, 0) : right]
        view = fitted.view_values(number)[max(-top, 0) :, max(-left, 0) :]
        view[: part.shape[0], : part.shape[1]] = part
    return fitted, window.cropped
