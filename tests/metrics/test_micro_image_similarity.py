"""SSIM of micro-images against a readable twin, whatever way the rows come."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel
from lippmann.display.micro_image_layout import pixel_lenses
from lippmann.image import IntegralImage
from lippmann.metrics import compare
from lippmann.metrics.micro_image_similarity import ROWS, MicroImageSimilarity

DISPLAYS = {
    "lenticular": Display("lenticular", Panel(40, 50, 0.5), LensArray("lenticular", 4.0), 3.0),
    "slanted": Display("slanted", Panel(40, 50, 0.5), LensArray("lenticular", 3.1, 15.0), 3.0),
    "square": Display("square", Panel(40, 48, 0.5), LensArray("square", 4.0), 3.0),
    "hexagonal": Display("hexagonal", Panel(40, 48, 0.5), LensArray("hexagonal", 4.0), 3.0),
}


def twin(display, reference, test):
    """As the definition says it, pixel by pixel."""
    i, j = (part.astype(int) for part in pixel_lenses(display, (0, display.panel.height)))
    found = np.full((display.lens_grid.rows, display.lens_grid.columns), np.nan)
    rows = np.arange(display.panel.height)[:, None] + 0 * i
    for row, column in np.ndindex(found.shape):
        own = (i == column) & (j == row)
        runs = rows // ROWS if display.lens_array.layout == "lenticular" else 0 * rows
        values, weights = [], []
        for run in np.unique(runs[own]):
            a, b = reference[own & (runs == run)], test[own & (runs == run)]
            covariance = ((a - a.mean(axis=0)) * (b - b.mean(axis=0))).mean(axis=0)
            up = (2 * a.mean(axis=0) * b.mean(axis=0) + 1e-4) * (2 * covariance + 9e-4)
            down = (a.mean(axis=0) ** 2 + b.mean(axis=0) ** 2 + 1e-4) * (a.var(axis=0) + b.var(axis=0) + 9e-4)
            values.append((up / down).mean())
            weights.append(len(a))
        if values:
            found[row, column] = np.average(values, weights=weights)
    return found


@pytest.mark.parametrize("name", DISPLAYS)
def test_it_is_what_the_definition_says(name):
    display, rng = DISPLAYS[name], np.random.default_rng(7)
    reference = rng.random((display.panel.height, display.panel.width, 3))
    test = np.clip(reference + 0.2 * rng.normal(size=reference.shape), 0, 1)
    i, j = (part.astype(np.int64) for part in pixel_lenses(display, (0, display.panel.height)))
    owner = j * display.lens_grid.columns + i
    sums = MicroImageSimilarity(display)
    for first in range(0, display.panel.height, 13):
        part = slice(first, first + 13)
        sums.add(first, owner[part], reference[part], test[part])
    np.testing.assert_allclose(sums.values(), twin(display, reference, test), atol=1e-9)


def test_one_wrong_lens_in_a_thousand_is_named():
    display = Display("many", Panel(160, 160, 0.5), LensArray("square", 2.5), 3.0)
    rng = np.random.default_rng(3)
    pixels = rng.random((160, 160, 3)).astype(np.float32)
    wrong = pixels.copy()
    wrong[35:40, 60:65] = wrong[35:40, 60:65].mean(axis=(0, 1))
    found = compare(IntegralImage(pixels, display), IntegralImage(wrong, display))
    assert found.least_similar[:2] == (12, 7)
    assert found.least_similar[2] < 0.3
    values = found.to_dict()["micro_images"]["ssim"]
    assert values["worst_lens"] == [12, 7]
    assert values["mean"] == pytest.approx((1023 + values["worst"]) / 1024)
    assert min(found.rows(), key=lambda each: each["ssim"])["column"] == 12
