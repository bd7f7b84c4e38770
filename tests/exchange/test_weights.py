"""The fourth colour of some layouts."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.exchange.weights import weight_codes, weights


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_every_code_comes_back(dtype):
    codes = np.arange(np.iinfo(dtype).max + 1, dtype=dtype)
    shares = weights(codes)
    assert shares.dtype == np.float32
    assert (shares.min(), shares.max()) == (0, 1)
    np.testing.assert_array_equal(weight_codes(shares, np.dtype(dtype)), codes)


def test_floats_stay():
    values = np.array([0, 0.1, 1, 7], dtype=np.float32)
    np.testing.assert_array_equal(weight_codes(weights(values), np.dtype(np.float32)), values)


def test_codes_are_limited():
    assert weight_codes(np.array([-1.0, 2.0], np.float32), np.dtype(np.uint8)).tolist() == [0, 255]
