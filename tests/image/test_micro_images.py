import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.display import NUMPY, Display, LensArray, Panel
from lippmann.errors import PictureError
from lippmann.image import IntegralImage
from lippmann.image.micro_images import Permutation, micro_images_as_views


def numbered(display):
    panel = display.panel
    return np.arange(panel.height * panel.width).reshape(panel.height, panel.width) + 1


@settings(deadline=None, max_examples=30)
@given(data=st.data())
def test_splitting_and_joining_any_display_loses_nothing(data, random_displays):
    display = data.draw(random_displays())
    permutation, values = Permutation(display), numbered(display)
    micro_images = permutation.split(values)
    assert micro_images.shape == permutation.shape
    # Every pixel is there exactly once, and the mask says where.
    np.testing.assert_array_equal(np.sort(micro_images[permutation.mask]), values.ravel())
    assert not micro_images[~permutation.mask].any()
    np.testing.assert_array_equal(permutation.join(micro_images), values)


@settings(deadline=None, max_examples=30)
@given(data=st.data())
def test_a_micro_image_holds_the_pixels_of_its_lens_in_their_order(data, random_displays):
    display = data.draw(random_displays())
    permutation, panel = Permutation(display), display.panel
    v, u = np.indices((panel.height, panel.width)) + 0.5
    i, j = display.lens_of(*display.panel_point(u, v), NUMPY)
    rows, columns, ny, nx = permutation.shape
    mask = permutation.mask
    j_here, i_here, _, _ = np.indices((rows, columns, ny, nx))
    np.testing.assert_array_equal(permutation.split(i)[mask], i_here[mask])
    np.testing.assert_array_equal(permutation.split(j)[mask], j_here[mask])
    # One place to the right (down) is one pixel to the right (down).
    for values, axis in ((u, 3), (v, 2)):
        boxes, filled = permutation.split(values), mask
        before, after = (
            np.take(a, range(start, a.shape[axis] - 1 + start), axis) for a in (boxes,) for start in (0, 1)
        )
        both = np.take(filled, range(filled.shape[axis] - 1), axis) & np.take(
            filled, range(1, filled.shape[axis]), axis
        )
        if axis == 3 or display.lens_array.slant == 0:
            np.testing.assert_array_equal((after - before)[both], 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("excess", [0.0, 1e-9, 3e-9, 1e-8, 1e-7, 9e-7, -1e-8, -9e-7])
@pytest.mark.parametrize("layout", ["lenticular", "square", "hexagonal"])
@pytest.mark.parametrize("offset", [None, (0.0, 0.0), (0.875, 0.875)])
def test_boxes_a_hair_above_or_below_whole_pixels_lose_nothing(layout, excess, offset):
    # A hexagon half as high as wide is (7 + excess) pixels high from tip to tip, and pixels lie right on the tips.
    across = 7 + (excess if layout != "hexagonal" else 0)
    row_pitch = 0.5 * (7 + max(excess, 0)) * 0.25 if layout == "hexagonal" else None
    lenses = LensArray(layout, across * 0.25, offset=offset, row_pitch=row_pitch)
    for width, height in ((7, 7), (14, 14), (21, 8), (8, 21)):
        if layout != "lenticular" and height * 0.25 < lenses.row_spacing * (1 - 1e-6):
            continue
        display = Display("hair", Panel(width, height, 0.25), lenses, gap=1.0)
        permutation, values = Permutation(display), numbered(display)
        micro_images = permutation.split(values)
        np.testing.assert_array_equal(np.sort(micro_images[permutation.mask]), values.ravel())
        np.testing.assert_array_equal(permutation.join(micro_images), values)
        image = IntegralImage(np.repeat(values[..., None], 3, axis=2), display)
        np.testing.assert_array_equal(
            IntegralImage.from_micro_images(image.micro_images(), display).pixels, image.pixels
        )
        if image.views_are_exact:
            np.testing.assert_array_equal(IntegralImage.from_views(image.views(), display).pixels, image.pixels)


def test_whole_lenticular_lenses_by_hand(display):
    sheet = display("lenticular", lenses=(2, 2), pixels=3)  # 6 x 6 pixels
    values = numbered(sheet)
    micro_images = Permutation(sheet).split(values)
    assert micro_images.shape == (1, 2, 6, 3)
    np.testing.assert_array_equal(micro_images[0, 1], values[:, 3:])
    views = micro_images_as_views(micro_images, sheet)
    assert views.shape == (1, 3, 6, 2)
    np.testing.assert_array_equal(views[0, 1], values[:, [1, 4]])


def test_whole_square_lenses_by_hand(display):
    array = display("square", lenses=(3, 2), pixels=4)
    values = numbered(array)
    micro_images = Permutation(array).split(values)
    assert micro_images.shape == (2, 3, 4, 4)
    np.testing.assert_array_equal(micro_images[1, 2], values[4:8, 8:12])
    views = micro_images_as_views(micro_images, array)
    assert views.shape == (4, 4, 2, 3)
    np.testing.assert_array_equal(views[3, 0], values[3::4, 0::4])


def test_whole_rectangles_share_memory_and_agree_with_the_general_way(display):
    for layout in ("lenticular", "square"):
        array = display(layout, lenses=(3, 4), pixels=2)
        values, permutation = numbered(array), Permutation(array)
        micro_images = permutation.split(values)
        assert np.shares_memory(micro_images, values)
        np.testing.assert_array_equal(micro_images.ravel()[permutation._places], values)


def test_hexagonal_lenses_of_whole_pixels_by_hand(display):
    # 4 pixels from lens to lens, 3 from row to row, odd rows half a lens to the right: a lens's own pixels are, row by
    # row, 2 above, 4, 4 and 2 below, as far as the panel goes.
    array = display("hexagonal", lenses=(4, 4), pixels=4)
    mask = Permutation(array).mask
    counts = mask.sum(axis=3)
    inner = counts[1:-1, 1:-1].reshape(-1, counts.shape[2])
    assert (inner.sum(axis=1) == 12).all()  # 4 x 3 pixels for each lens
    assert (inner == inner[0]).all()
    assert inner[0].max() == 4


def test_trailing_axes_and_types_are_kept(display):
    array = display("hexagonal", lenses=(3, 3), pixels=3)
    shape = (array.panel.height, array.panel.width)
    for values in (np.ones(shape, np.uint32), np.ones((*shape, 3), np.float32), np.ones((*shape, 2, 2), bool)):
        micro_images = Permutation(array).split(values)
        assert micro_images.dtype == values.dtype
        assert micro_images.shape[4:] == values.shape[2:]
        np.testing.assert_array_equal(Permutation(array).join(micro_images), values)


def test_another_size_is_refused(display):
    permutation = Permutation(display("square"))
    with pytest.raises(PictureError, match=r"11 x 9 pixels; .* has 12 x 9"):
        permutation.split(np.zeros((9, 11)))
    with pytest.raises(PictureError, match="shape"):
        permutation.join(np.zeros((3, 4, 3, 2)))
