"""Views brought to the shape of a panel."""

import numpy as np
import pytest

from lippmann.image.metadata import Provenance
from lippmann.quilts.fit_views import fit_views
from lippmann.quilts.quilt import Quilt, QuiltLayout


def quilt(width, height, aspect=None, dtype=np.uint8, transfer="srgb"):
    """2 x 2 views whose red is the column and green the row."""
    view = np.zeros((height, width, 3), dtype)
    view[..., 0], view[..., 1] = np.arange(width), np.arange(height)[:, None]
    layout = QuiltLayout(2, 2, aspect)
    return Quilt(np.tile(view, (2, 2, 1)), layout, np.dtype(dtype).name, Provenance(transfer=transfer))


@pytest.mark.parametrize(("fit", "columns", "cut"), [("cover", range(5, 15), 0.5), ("contain", range(20), 0.0)])
def test_wide_views_on_a_square_panel(fit, columns, cut):
    fitted, cropped = fit_views(quilt(20, 10), 1.0, fit)
    side = len(columns)
    assert fitted.view_size == (side, side)
    assert fitted.layout == (2, 2, 1.0)
    assert cropped == pytest.approx((cut, 0.0))
    above = (side - 10) // 2
    for number in range(4):
        view = fitted.view_values(number)
        np.testing.assert_array_equal(view[above : above + 10, :, 0], np.tile(columns, (10, 1)))
        assert (view[:above] == 255).all()
        assert (view[above + 10 :] == 255).all()


def test_pixels_that_are_not_square_count_by_the_stated_aspect():
    """20 x 10 pixels shown 1 : 2 on a square panel: as wide as it, half of their height."""
    fitted, cropped = fit_views(quilt(20, 10, aspect=0.5), 1.0, "cover")
    assert fitted.view_size == (20, 5)
    assert cropped == pytest.approx((0.0, 0.5))


def test_paper_is_white_in_linear_light_too():
    fitted, _ = fit_views(quilt(20, 10, dtype=np.float32), 1.0, "contain")
    assert (fitted.view(0)[:5] == 1.0).all()


@pytest.mark.parametrize(("shape", "fit"), [(2.02, "cover"), (1.98, "contain"), (0.5, "stretch")])
def test_what_nearly_fits_or_is_stretched_is_kept(shape, fit):
    given = quilt(20, 10)
    fitted, cropped = fit_views(given, shape, fit)
    assert fitted.values is given.values
    assert fitted.layout.aspect == shape
    assert cropped == (0.0, 0.0)
