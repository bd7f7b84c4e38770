"""Refocused pictures against the formula of shift and sum, and against planes that were drawn by hand."""

import math

import numpy as np
import pytest

from lippmann.display import NUMPY, Display, LensArray, Panel
from lippmann.errors import UsageError
from lippmann.image import IntegralImage
from lippmann.image.streamed import ChunkedPixels, LargePicture
from lippmann.viewing.refocus import refocus

PIXELS, PITCH, GAP = 5, 1.25, 6.0
PIXEL = PITCH / PIXELS


def square(columns=11, rows=9, distance=math.inf, layout="square", height=None):
    magnification = (distance + GAP) / distance if math.isfinite(distance) else 1.0
    panel = Panel(columns * PIXELS, height or rows * PIXELS, PIXEL)
    row_pitch = 4 * PIXEL / magnification if layout == "hexagonal" else None
    lenses = LensArray(layout, PITCH / magnification, row_pitch=row_pitch)
    return Display(layout, panel, lenses, gap=GAP, viewing_distance=distance)


def random_picture(display, seed=0):
    panel = display.panel
    return IntegralImage(np.random.default_rng(seed).random((panel.height, panel.width, 3)), display)


def shift_and_sum(views, alpha):
    """``mean over t, s of L(t, s, v + alpha (t - t0), u + alpha (s - s0))``, over the samples that there are."""
    ny, nx, rows, columns, _ = views.shape
    total, count = np.zeros((rows, columns, 3)), np.zeros((rows, columns, 1))
    for t in range(ny):
        for s in range(nx):
            for v in range(rows):
                for u in range(columns):
                    row = math.floor(v + alpha * (t - (ny - 1) / 2) + 0.5)
                    column = math.floor(u + alpha * (s - (nx - 1) / 2) + 0.5)
                    if 0 <= row < rows and 0 <= column < columns:
                        total[v, u] += views[t, s, row, column]
                        count[v, u] += 1
    return total / count


@pytest.mark.parametrize("alpha", [0, 1, -1, 2, 0.3, -1.4])
def test_shift_and_sum(alpha):
    image = random_picture(square(6, 5))
    plane = alpha * GAP * PITCH / PIXEL
    np.testing.assert_allclose(refocus(image, plane, size=(6, 5)), shift_and_sum(image.views(), alpha), rtol=1e-5)


def test_shift_and_sum_of_a_lenticular_sheet_goes_across_only():
    image = random_picture(square(6, layout="lenticular", height=7))
    views = image.views()
    # As many "lens rows" as pixels, which all views share.
    np.testing.assert_allclose(refocus(image, GAP * PITCH / PIXEL, size=(6, 7)), shift_and_sum(views, 1), rtol=1e-5)


@pytest.mark.parametrize("layout", ["square", "hexagonal", "lenticular"])
@pytest.mark.parametrize("distance", [math.inf, 40.0])
def test_in_the_lens_plane_it_is_the_mean_of_each_micro_image(layout, distance):
    display = square(8, 8, distance, layout)
    image = random_picture(display)
    micro_images, mask = image.micro_images(), image.micro_image_mask()
    width, height = 28, 24
    picture = refocus(image, 0.0, size=(width, height))
    checked = 0
    for row, column in np.ndindex(height, width):
        u, v = (column + 0.5) / width * display.panel.width, (row + 0.5) / height * display.panel.height
        # A point of the lens plane, the lens that holds it, and the panel point behind it as seen from the distance.
        x, y = (k * display.magnification for k in display.panel_point(u, v))
        panel_u, panel_v = display.pixel_coordinates(x, y)
        if not (0 < panel_u < display.panel.width and 0 < panel_v < display.panel.height):
            continue
        i, j = (int(k) for k in display.lens_of(x, y, NUMPY))
        if layout == "lenticular":
            expected = micro_images[0, i, int(panel_v)].mean(axis=0)
        else:
            # A lens of which the panel has no pixel shows nothing.
            expected = micro_images[j, i][mask[j, i]].sum(axis=0) / max(1, mask[j, i].sum())
        np.testing.assert_allclose(picture[row, column], expected, rtol=1e-5)
        checked += 1
    assert checked > 0.6 * width * height


def drawn_at(display, z):
    """What the display shows of a plane at z with stripes 4 mm wide: sampled along the rays of the pixels."""
    v, u = np.indices((display.panel.height, display.panel.width)) + 0.5
    origin, direction = display.light_ray(*display.panel_point(u, v), NUMPY)
    x = origin[0] + direction[0] * (z - origin[2]) / direction[2]
    return IntegralImage(np.repeat(stripes(x)[..., None], 3, axis=2), display)


def stripes(x):
    return (np.floor(x / 4) % 2).astype(np.float32)


@pytest.mark.slow
@pytest.mark.parametrize("z", [-25.0, -8.0, 8.0, 25.0])
@pytest.mark.parametrize(
    "display",
    [
        square(41, 15),
        square(41, 15, 250.0),
        square(41, 15, layout="hexagonal"),
        square(41, layout="lenticular", height=40),
        Display("slanted", Panel(205, 75, PIXEL), LensArray("lenticular", 1.31, slant=15.0), gap=GAP),
        Display("broken", Panel(205, 75, PIXEL), LensArray("hexagonal", 1.31), gap=GAP),
    ],
    ids=["square", "near square", "hexagonal", "lenticular", "slanted", "broken hexagonal"],
)
def test_a_drawn_plane_is_sharp_at_its_own_depth_only(display, z):
    image = drawn_at(display, z)
    width, height = display.panel.width, display.panel.height
    x, _ = display.panel_point(*np.meshgrid(np.arange(width) + 0.5, [0.0]))
    inner = slice(width // 5, -width // 5)

    def error_at(plane):
        picture = refocus(image, plane, size=(width, height))[height // 3 : -height // 3, inner, 0]
        return np.abs(picture - stripes(x)[:, inner]).mean()

    errors = {plane: error_at(plane) for plane in (z, -z, z / 3, 2 * z)}
    assert min(errors, key=errors.get) == z
    assert errors[z] < 0.2
    assert errors[-z] > 2 * errors[z]


@pytest.mark.slow
@pytest.mark.parametrize(("plane", "size"), [(0.0, (9, 7)), (-8.0, (97, 61)), (5.0, (230, 90)), (11.0, (1, 1))])
@pytest.mark.parametrize(
    "display",
    [
        square(11, 9),
        square(11, 9, 40.0),
        square(11, 9, layout="hexagonal"),
        Display("broken", Panel(57, 43, PIXEL), LensArray("hexagonal", 1.31), gap=GAP, viewing_distance=90.0),
        Display("flat", Panel(57, 43, PIXEL), LensArray("hexagonal", 1.31, row_pitch=0.655), gap=GAP),
    ],
    ids=["square", "near square", "hexagonal", "broken hexagonal", "flat hexagonal"],
)
def test_compiled_runs_are_the_look_ups_of_single_points(display, plane, size):
    image = random_picture(display)
    shape = image.pixels.shape[:2]
    source = ChunkedPixels(shape[::-1], shape, image.pixels.dtype, lambda row, column: image.pixels)
    single = LargePicture(source, display, np.eye(4), image.provenance, "float32")
    np.testing.assert_array_equal(refocus(image, plane, size=size), refocus(single, plane, size=size))


@pytest.mark.long
def test_one_colour_stays_that_colour_where_anything_is_seen():
    for layout in ("square", "hexagonal", "lenticular"):
        display = square(8, 8, layout=layout)
        shape = (display.panel.height, display.panel.width, 3)
        picture = refocus(IntegralImage(np.broadcast_to(np.float32([0.1, 0.2, 0.3]), shape), display), 12.0)
        assert picture.shape == (display.panel.height, display.panel.width, 3)
        seen = picture[picture.any(axis=2)]
        np.testing.assert_allclose(seen, np.broadcast_to(np.float32([0.1, 0.2, 0.3]), seen.shape), rtol=1e-6)
        assert len(seen) > 0.9 * picture.shape[0] * picture.shape[1]


def test_the_method_of_the_picture():
    image = random_picture(square(4, 4))
    np.testing.assert_array_equal(image.refocus(3.0, size=(9, 9)), refocus(image, 3.0, size=(9, 9)))


@pytest.mark.parametrize("plane", [300.0, 400.0, math.inf, math.nan, -math.inf])
def test_planes_that_cannot_be(plane):
    with pytest.raises(UsageError, match=r"plane: .* below the viewing distance of 300 mm"):
        refocus(random_picture(square(3, 3, 300.0)), plane)
    with pytest.raises(UsageError, match=r"plane: .* must be above -1e\+12 mm and below 1e\+12 mm"):
        refocus(random_picture(square(3, 3)), 1e12)
    with pytest.raises(UsageError, match="size: "):
        refocus(random_picture(square(3, 3)), 0.0, size=(0, 3))
