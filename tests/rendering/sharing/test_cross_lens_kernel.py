"""The mean over all places that show a point, against one that follows its definition pixel by pixel."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")

#: Pixels of the picture, lens pitch in pixels, and the gap in millimetres.
HEIGHT, WIDTH, PITCH, GAP = 17, 30, 5, 3.0


def shared_light(light, normal, height, lens, centers, reach, stop):
    """The mean of ``light`` with the weight ``(1 - d / 10)^8`` over all places that show the same point.

    A point at height z that pixel q shows through lens C lies at ``q + (C' - C) (1 + g / z)`` under lens C'; the 3 x 3
    pixels there count, as far as they are that lens's. The distance d is a sum of squares: of pixels, of heights in
    units of a fiftieth of z and the gap, of normals (10 times), and of light relative to the pixel's own (``stop``
    times).
    """
    result = np.zeros(light.shape)
    lens_rows, lens_columns = centers.shape[:2]
    for row, column in np.ndindex(height.shape):
        here, z = (row, column), float(height[row, column])
        own = divmod(int(lens[here]), lens_columns)
        if not np.abs(normal[here]).any():
            result[here] = light[here]
            continue
        is_flat = abs(z) < 1e-3 * GAP
        total = 0.0
        for dj, di in product(range(-reach[1], reach[1] + 1), range(-reach[0], reach[0] + 1)):
            other = own[0] + dj, own[1] + di
            is_lens = 0 <= other[0] < lens_rows and 0 <= other[1] < lens_columns
            # A point is seen through |z| / g lenses, and no other.
            if not is_lens or max(abs(dj), abs(di)) > abs(z) / GAP + 2 or (is_flat and (dj or di)):
                continue
            place = np.array([column, row]) + 0.5
            if not is_flat:
                place += (centers[other] - centers[own]) * (1 + GAP / z)
            x, y = math.floor(place[0]), math.floor(place[1])
            for there in product(range(y - 1, y + 2), range(x - 1, x + 2)):
                inside = 0 <= there[0] < HEIGHT and 0 <= there[1] < WIDTH
                if not inside or divmod(int(lens[there]), lens_columns) != other:
                    continue
                across, down = there[1] + 0.5 - place[0], there[0] + 0.5 - place[1]
                apart = across**2 + down**2
                apart += ((float(height[there]) - z) / (0.02 * abs(z) + GAP)) ** 2
                apart += 10.0 * np.square(normal[there] - normal[here], dtype=np.float64).sum()
                apart += stop * np.square(light[there] - light[here]).sum() / (1e-3 + np.square(light[here]).sum())
                weight = max(0.0, 1 - apart / 10) ** 8
                total += weight
                result[here] += weight * light[there]
        result[here] /= total
    return result


def surface(seed):
    """Two surfaces with some noise, one in front of and one behind the lens plane, and nothing at all in a corner."""
    random = np.random.default_rng(seed)
    height = np.where(np.arange(WIDTH) < 18, -8.0, 5.0) + random.normal(0, 0.3, (HEIGHT, WIDTH))
    height[:, 8] = 0.0
    normal = random.normal([0.0, 0.0, 1.0], 0.1, (HEIGHT, WIDTH, 3))
    normal[-3:, -4:] = 0
    return normal.astype(np.float32), height.astype(np.float32)


@pytest.mark.slow
@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("stop", [0.0, 40.0])
@pytest.mark.parametrize(("cylindrical", "reach"), [(True, (4, 0)), (False, (3, 3))])
def test_the_mean_is_the_slow_one(cylindrical, reach, stop, channels, monkeypatch):
    from lippmann.rendering.sharing import cross_lens
    from lippmann.rendering.sharing.cross_lens import _Picture

    monkeypatch.setattr(cross_lens, "PREFERRED_LANES", 100)  # several parts
    random = np.random.default_rng(7)
    normal, height = surface(8)
    light = random.lognormal(0, 0.2, (HEIGHT, WIDTH, channels)).astype(np.float32)
    down = HEIGHT if cylindrical else PITCH
    rows, columns = -(-HEIGHT // down), WIDTH // PITCH
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    lens = (y // down * columns + x // PITCH).astype(np.int32)
    j, i = np.mgrid[:rows, :columns]
    # Cylinders have no place along their axes, and lenses need not stand on whole pixels.
    centers = np.stack([(i + 0.5) * (PITCH + 0.05), 0 * j if cylindrical else (j + 0.5) * (PITCH - 0.05)], axis=-1)
    centers = np.ascontiguousarray(centers, dtype=np.float64)
    arrays = (light, normal, height, lens, centers)
    found = cross_lens.light_of_pixels(_Picture(*arrays, GAP, reach, stop).mean_light, light.shape)
    expected = shared_light(*arrays, reach, stop)
    np.testing.assert_allclose(found, expected, rtol=2e-5)
    assert np.abs(expected - light).mean() > 0.01
