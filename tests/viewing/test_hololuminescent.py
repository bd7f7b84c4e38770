import numpy as np
import pytest

from lippmann.viewing.hololuminescent import for_hololuminescent


@pytest.mark.parametrize("size", [(90, 160), (400, 200)])
def test_a_picture_stands_in_the_safe_area_on_black(size):
    width, height = size
    picture = np.full((height, width, 3), 200, np.uint8)
    picture[: height // 2] = (255, 0, 0)
    turned = for_hololuminescent(picture)
    assert turned.shape == (2160, 3840, 3)
    upright = np.rot90(turned, -1)  # as the player turns it: clockwise
    rows, columns = (np.flatnonzero(upright.any(axis=(2, axis))) for axis in (1, 0))
    # The maker: 355 pixels on the top, 100 on the bottom, 108 on either side.
    assert rows[0] >= 355
    assert rows[-1] == 3840 - 101
    assert columns[0] >= 108
    assert columns[-1] <= 2160 - 109
    assert rows[0] <= 356 or columns[0] <= 109
    np.testing.assert_array_equal(upright[rows[0] + 20, 1080], (255, 0, 0))
    np.testing.assert_array_equal(upright[rows[-1] - 20, 1080], (200, 200, 200))
