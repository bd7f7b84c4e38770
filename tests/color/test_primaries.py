"""Primaries against published matrices."""

import numpy as np
import pytest

from lippmann.color.primaries import REC709, rec709_from_rgb, xyz_from_rgb


def test_rec_709_to_xyz():
    """IEC 61966-2-1, 5.2."""
    published = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    assert xyz_from_rgb(REC709) == pytest.approx(np.array(published), abs=1e-4)


def test_acescg_to_rec_709():
    """ACEScg's white differs: it is adapted (Bradford), as in the ACES reference transforms."""
    published = [[1.70505, -0.62179, -0.08326], [-0.13026, 1.14080, -0.01055], [-0.02400, -0.12897, 1.15297]]
    acescg = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)
    assert rec709_from_rgb(acescg) == pytest.approx(np.array(published), abs=2e-4)
    assert rec709_from_rgb(REC709) == pytest.approx(np.eye(3), abs=1e-12)


def test_primaries_may_be_those_of_xyz_itself():
    xyz = (1, 0, 0, 1, 0, 0, 0.33333334, 0.33333334)
    assert xyz_from_rgb(xyz) == pytest.approx(np.eye(3), abs=1e-6)
    assert rec709_from_rgb(xyz) @ xyz_from_rgb(REC709) == pytest.approx(np.eye(3), abs=1e-9)


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ((0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3, 0.0), "y of white other than 0"),
        ((0.64, np.nan, 0.3, 0.6, 0.15, 0.06, 0.3, 0.3), "finite"),
        ((0.2, 0.2, 0.3, 0.3, 0.4, 0.4, 0.3, 0.3), "must not lie on a line"),
    ],
)
def test_chromaticities_that_mean_nothing(numbers, message):
    with pytest.raises(ValueError, match=message):
        rec709_from_rgb(numbers)
