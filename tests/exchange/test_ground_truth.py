"""A rendered scene, exported: its disparity moves every view's pixels onto the middle view.

The folder is read here by the layout's published rules alone; nothing of the writer's is used.
"""

from __future__ import annotations

import configparser
import math

import numpy as np
import pytest
from PIL import Image

from lippmann.display import Display, LensArray, Panel
from lippmann.exchange import export_image
from lippmann.options.placement import PlacementOptions

VIEWS, SIZE = 5, 96


def display_at(distance):
    gap, pixel_pitch = 4.0, 0.2
    return Display(
        name="views",
        panel=Panel(VIEWS * SIZE, VIEWS * SIZE, pixel_pitch),
        lens_array=LensArray("square", VIEWS * pixel_pitch / (1 + gap / distance)),
        gap=gap,
        viewing_distance=distance,
        aperture_distance=100.0,
    )


def truth(path):
    with path.open("rb") as file:
        assert file.readline() == b"Pf\n"
        width, height = map(int, file.readline().split())
        assert float(file.readline()) < 0
        return np.frombuffer(file.read(), "<f4").reshape(height, width)[::-1].astype(float)


def sampled(values, v, u):
    """Bilinear values ``(H, W, ...)`` at places in pixels, and which of them lie inside."""
    inside = (v >= 0) & (v <= SIZE - 1) & (u >= 0) & (u <= SIZE - 1)
    v, u = v.clip(0, SIZE - 1.001), u.clip(0, SIZE - 1.001)
    row, column = v.astype(int), u.astype(int)
    down, right = (part.reshape(part.shape + (1,) * (values.ndim - 2)) for part in (v - row, u - column))
    upper = values[row, column] * (1 - right) + values[row, column + 1] * right
    lower = values[row + 1, column] * (1 - right) + values[row + 1, column + 1] * right
    return upper * (1 - down) + lower * down, inside


def wavy_cloth():
    """A cloth in soft colours that hides nothing of itself and hangs through the lens plane, millimetres."""
    import trimesh

    reach, count = 90.0, 400
    x, y = np.meshgrid(np.linspace(-reach, reach, count), np.linspace(-reach, reach, count))
    z = -6 + 9 * np.sin(x / 17) + 0.2 * y
    colors = [0.5 + 0.45 * np.sin(x / a + y / b) for a, b in ((3.1, 9.0), (-8.0, 2.9), (4.3, 4.1))]
    corner = np.arange(count * count).reshape(count, count)
    first, right, below, last = (corner[i:, j:][: count - 1, : count - 1] for i in (0, 1) for j in (0, 1))
    faces = np.concatenate([np.stack(f, axis=-1).reshape(-1, 3) for f in ((first, right, below), (below, right, last))])
    shades = (255 * np.stack(colors, axis=-1).reshape(-1, 3)).astype(np.uint8)
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return trimesh.Trimesh(points, faces, vertex_colors=shades, process=False)


@pytest.fixture(scope="module", params=[600.0, math.inf], ids=["finite", "parallel"])
def folder(request, engine, tmp_path_factory):
    """The cloth as its surface is, without light, so that nothing changes from view to view."""
    from lippmann import api

    display = display_at(request.param)
    image = api.render(
        wavy_cloth(), display, placement=PlacementOptions(place="display"), integrator="albedo", spp=4, layers=True
    )
    folder = tmp_path_factory.mktemp("truth") / "cloth"
    export_image(image, folder, "hci")
    return folder


def views_of(folder):
    names = [f"Cam{number:03}" for number in range(VIEWS**2)]
    views = np.stack([np.asarray(Image.open(folder / f"input_{name}.png")) / 255 for name in names])
    disparities = np.stack([truth(folder / f"gt_disp_lowres_{name}.pfm") for name in names])
    return views, disparities


@pytest.mark.long
def test_disparity_moves_every_view_onto_the_middle_one(folder):
    views, _ = views_of(folder)
    middle = VIEWS // 2
    center, disparity = views[VIEWS * middle + middle], truth(folder / "gt_disp_lowres.pfm")
    assert disparity.min() < -0.3
    assert disparity.max() > 0.1
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)

    def psnr(right, down):
        """Of the views, moved by so much of the disparity, against the middle view."""
        squared = []
        for number, (t, s) in enumerate(np.ndindex(VIEWS, VIEWS)):
            moved, inside = sampled(
                views[number], v - down * disparity * (t - middle), u - right * disparity * (s - middle)
            )
            squared.append(((moved - center) ** 2)[inside])
        return -10 * math.log10(np.concatenate(squared).mean())

    found = psnr(1, 1)
    assert found > 38
    for wrong in ((0, 0), (-1, -1), (-1, 1), (1, -1), (0.8, 0.8), (1.2, 1.2)):
        assert psnr(*wrong) < found - 3, wrong


@pytest.mark.long_cases("parallel")
@pytest.mark.slow
def test_the_same_point_has_the_same_disparity_in_every_view(folder):
    _, disparities = views_of(folder)
    middle = VIEWS // 2
    disparity = truth(folder / "gt_disp_lowres.pfm")
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)
    for number, (t, s) in enumerate(np.ndindex(VIEWS, VIEWS)):
        seen, inside = sampled(disparities[number], v - disparity * (t - middle), u - disparity * (s - middle))
        assert inside.mean() > 0.9
        np.testing.assert_allclose(seen[inside], disparity[inside], atol=2e-3)


@pytest.mark.slow
def test_depth_is_related_to_disparity_as_published(folder):
    values = configparser.ConfigParser()
    values.read(folder / "parameters.cfg")
    inside, outside = values["intrinsics"], values["extrinsics"]
    f, S = float(inside["focal_length_mm"]), float(inside["sensor_size_mm"])
    B, F = float(outside["baseline_mm"]), 1000 * float(outside["focus_distance_m"])
    R = max(int(inside["image_resolution_x_px"]), int(inside["image_resolution_y_px"]))
    depth, disparity = truth(folder / "gt_depth_lowres.pfm"), truth(folder / "gt_disp_lowres.pfm")
    seen = np.isfinite(depth)
    assert seen.all()
    expected = (B * f * F * R / (1000 * depth[seen]) - B * f * R) / (F * S)
    np.testing.assert_allclose(disparity[seen], expected, atol=3e-5)
    assert float(outside["offset"]) == pytest.approx(B * f * R / (F * S))
