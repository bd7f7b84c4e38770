"""The views of two pictures: each judged as a picture of its own, a few rows at a time and by several threads."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.metrics import ssim, view_similarity
from lippmann.metrics import view_metrics as views
from lippmann.metrics.view_metrics import view_figures


def random_pair(display, picture, seed, size=(32, 64)):
    random = np.random.default_rng(seed)
    codes = random.uniform(0, 1, (*size, 3))
    return picture(display, codes), picture(display, np.clip(codes + random.normal(0, 0.1, codes.shape), 0, 1))


def test_every_view_is_judged_as_a_picture_of_its_own(any_display, picture):
    reference, test = random_pair(any_display, picture, 7)
    (a, mask), (b, _) = reference.views_and_mask(), test.views_and_mask()
    found = view_similarity(reference, test)
    expected = [[ssim(a[ky, kx], b[ky, kx], mask[ky, kx]) for kx in range(a.shape[1])] for ky in range(a.shape[0])]
    np.testing.assert_allclose(found.values, expected, rtol=1e-6, equal_nan=True)
    assert found.exact == reference.views_are_exact


def test_flicker_is_that_of_the_views_side_by_side_and_one_above_the_other(any_display, picture):
    reference, test = random_pair(any_display, picture, 11)
    (a, mask), (b, _) = reference.views_and_mask(), test.views_and_mask()
    error = (a - b).astype(float)
    changes, own = [], []
    for low, high in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        both = mask[low] & mask[high]
        changes.append(np.square(error[low] - error[high])[both])
        own.append(0.5 * (np.square(error[low]) + np.square(error[high]))[both])
    _, found = view_figures(reference, test)
    assert found.squared == pytest.approx(np.concatenate(changes).mean(), rel=1e-6)
    assert found.error == pytest.approx(np.concatenate(own).mean(), rel=1e-6)


@pytest.mark.parametrize("cores", [1, 3])
@pytest.mark.parametrize("kind", ["lenticular", "square"])
def test_figures_do_not_depend_on_how_much_is_worked_on_at_a_time(display, picture, monkeypatch, kind, cores):
    pair = random_pair(display(kind, 64, 400), picture, 3, (400, 64))
    expected = view_figures(*pair)
    monkeypatch.setattr(views, "_BLOCK", 1)
    monkeypatch.setattr(views, "usable_cores", lambda: cores)
    shares = []
    found = view_figures(*pair, lambda progress: shares.append(progress.done / progress.total))
    np.testing.assert_allclose(found[0].values, expected[0].values, rtol=1e-12)
    assert found[1].squared == pytest.approx(expected[1].squared, rel=1e-12)
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert len(shares) > 1


def test_only_the_view_that_differs_is_less_than_one(display, picture):
    plain = display("lenticular", 128, 32)
    codes = np.random.default_rng(2).uniform(0, 1, (32, 128, 3))
    changed = codes.copy()
    changed[:, 5::8] = 1 - changed[:, 5::8]  # view 5: the sixth pixel of every lens
    views = view_similarity(picture(plain, codes), picture(plain, changed))
    assert views.exact
    assert views.values.shape == (1, 8)
    assert views.worst == (0, 5)
    others = np.delete(views.values[0], 5)
    np.testing.assert_allclose(others, 1.0, atol=1e-12)
    assert views.values[0, 5] < 0.5
    assert views.mean == pytest.approx((7 + views.values[0, 5]) / 8)


def test_views_of_every_layout_are_one_for_equal_pictures(any_display, picture):
    image = picture(any_display, np.random.default_rng(3).uniform(0, 1, (32, 64, 3)))
    views = view_similarity(image, image)
    present = views.values[np.isfinite(views.values)]
    assert present.size > 0
    np.testing.assert_allclose(present, 1.0, atol=1e-9)
