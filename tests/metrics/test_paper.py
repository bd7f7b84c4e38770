"""The paper's figures under their own names, its slip included."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lippmann.metrics import compare, paper_psnr, paper_rmse


def test_the_printed_numbers_belong_together():
    assert paper_psnr(13.5795) == pytest.approx(36.802, abs=5e-4)


def test_its_rmse_has_no_root():
    assert paper_rmse([10, 20, 30], [10, 23, 34]) == pytest.approx((9 + 16) / 3)


def test_codes_are_not_wrapped():
    assert paper_rmse(np.array([0], dtype=np.uint8), np.array([255], dtype=np.uint8)) == 255**2
    assert paper_psnr(255**2) == 0
    assert paper_psnr(0) == math.inf


def test_figures_are_per_lens_and_averaged_over_lenses_with_an_error(display, picture):
    plain = display("lenticular", 64, 32)  # eight lenses of eight pixels
    codes = np.full((32, 64, 3), 100 / 255)
    changed = codes.copy()
    changed[:, 0:8] += 2 / 255  # lens 0: error 4 in every value
    changed[0:16, 8:16, 0] += 6 / 255  # lens 1: 36 in a sixth of the values
    figures = compare(picture(plain, codes), picture(plain, changed)).paper
    np.testing.assert_allclose(figures.rmse, [[4, 6, 0, 0, 0, 0, 0, 0]])
    assert figures.unchanged == 6
    assert figures.mean_rmse == pytest.approx(10 / 8)
    assert figures.mean_psnr == pytest.approx((paper_psnr(4) + paper_psnr(6)) / 2)
    assert figures.psnr[0, 2] == math.inf


def test_values_are_rounded_to_whole_codes(display, picture):
    plain = display()
    figures = compare(picture(plain, 100.2 / 255), picture(plain, 99.8 / 255)).paper
    assert figures.mean_psnr == math.inf
    assert figures.unchanged == 8
