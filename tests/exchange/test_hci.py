"""Folders of the 4D Light Field Benchmark: there and back, read by the rules of the layout, half ones refused."""

from __future__ import annotations

import configparser
import shutil

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from lippmann.codecs.pfm import read_pfm, write_pfm
from lippmann.errors import LippmannError, PictureError
from lippmann.exchange.cameras import Cameras
from lippmann.exchange.hci import read_hci, write_hci
from lippmann.exchange.hci_parameters import read_parameters
from lippmann.exchange.light_field import light_field_of

FOLDERS = settings(max_examples=12, suppress_health_check=[HealthCheck.too_slow], deadline=None)


def there_and_back(image, folder, stored, **options):
    shutil.rmtree(folder, ignore_errors=True)
    write_hci(light_field_of(image, stored), image.display, folder, **options)
    return read_hci(folder)


@FOLDERS
@given(st.data(), st.sampled_from(["uint8", "uint16"]))
def test_codes_come_back_exactly_and_depth_to_rounding(random_displays, picture, same, tmp_path_factory, data, stored):
    display = data.draw(random_displays())
    image = picture(display, data.draw(st.integers(0, 99)), stored=stored, depth=True)
    found = there_and_back(image, tmp_path_factory.getbasetemp() / "hci", stored).image()
    same(found, image, maps=False)
    focus = Cameras.of_display(display).focus_distance
    np.testing.assert_allclose(found.maps["depth"], image.maps["depth"], rtol=0, atol=2e-7 * focus)


def test_values_above_white_are_the_brightest_code(display, picture, tmp_path):
    image = picture(display(distance=500))
    found = there_and_back(image, tmp_path / "hci", "uint8").image()
    assert found.stored == "uint8"
    # Half a code, where the coding curve is steepest in linear light.
    np.testing.assert_allclose(found.pixels, image.pixels.clip(0, 1), atol=0.5 * 2.3 / 255)


def test_files_and_their_order(display, picture, tmp_path):
    made = display("square", lenses=(4, 3), pixels=3, distance=500)
    image = picture(made, stored="uint8", depth=True)
    there_and_back(image, tmp_path / "hci", "uint8")
    names = {path.name for path in (tmp_path / "hci").iterdir()}
    assert {f"input_Cam{number:03}.png" for number in range(9)} <= names
    assert {f"gt_{kind}_{size}.pfm" for kind in ("disp", "depth") for size in ("lowres", "highres")} <= names
    views = image.views()
    for number in range(9):
        t, s = divmod(number, 3)
        # The camera on top sees the lowest pixel under a lens, the left one the rightmost.
        seen = image.with_pixels(image.pixels).views()[2 - t, 2 - s]
        codes = np.asarray(Image.open(tmp_path / "hci" / f"input_Cam{number:03}.png"))
        assert codes.shape == (3, 4, 3)
        np.testing.assert_allclose(
            codes / 255, np.where(seen <= 0.0031308, 12.92 * seen, 1.055 * seen ** (1 / 2.4) - 0.055), atol=1e-6
        )
    assert views.shape == (3, 3, 3, 4, 3)


@pytest.mark.parametrize("pixels", [3, 4])
def test_the_middle_s_ground_truth_is_that_of_its_view(display, picture, tmp_path, pixels):
    image = picture(display("square", pixels=pixels), stored="uint8", depth=True)
    there_and_back(image, tmp_path / "hci", "uint8")
    middle = (pixels // 2) * pixels + pixels // 2
    for kind in ("depth", "disp"):
        own = read_pfm(tmp_path / "hci" / f"gt_{kind}_lowres_Cam{middle:03}.pfm")
        for size in ("lowres", "highres"):
            np.testing.assert_array_equal(read_pfm(tmp_path / "hci" / f"gt_{kind}_{size}.pfm"), own)


def test_the_middle_s_heights_are_shades_for_eyes(display, picture, tmp_path):
    made = display("square", lenses=(12, 9), pixels=3, distance=500)
    image = picture(made, stored="uint8", depth=True)
    there_and_back(image, tmp_path / "hci", "uint8")
    shown = np.asarray(Image.open(tmp_path / "hci" / "depth_in_mm.png"))
    heights = light_field_of(image, "uint8").maps["depth"][1, 1]
    times = -(-128 // 9)
    assert shown.shape == (9 * times, 12 * times + 96, 3)
    shades = shown[times // 2 :: times, times // 2 : 12 * times : times, 0]
    seen = np.isfinite(heights)
    found = heights[seen]
    share = (found - found.min()) / np.ptp(found)
    np.testing.assert_allclose(shades[seen] / 255, 0.15 + 0.85 * share, atol=1 / 255)
    assert (shades[~seen] == 0).all()
    assert (shown[:, 12 * times :] == 255).any()


@pytest.mark.parametrize("distance", [np.inf, 400.0])
def test_depth_and_disparity_agree_by_the_file_s_own_parameters(display, picture, tmp_path, distance):
    image = picture(display("square", distance=distance), stored="uint8", depth=True)
    there_and_back(image, tmp_path / "hci", "uint8")
    cameras = read_parameters(tmp_path / "hci" / "parameters.cfg").cameras
    for number in range(9):
        depth = read_pfm(tmp_path / "hci" / f"gt_depth_lowres_Cam{number:03}.pfm").astype(float)
        disparity = read_pfm(tmp_path / "hci" / f"gt_disp_lowres_Cam{number:03}.pfm")
        hit = np.isfinite(depth)
        np.testing.assert_allclose(disparity[hit], cameras.disparity(1000 * depth[hit]), rtol=1e-5, atol=3e-5)


def test_empty_places_and_nothing_are_infinitely_far(display, picture, tmp_path):
    made = display("square", lenses=(3, 2), pixels=4, offset=(0.3, 0.1), distance=500)
    image = picture(made, stored="uint8", maps={"depth": np.full((8, 12), 5.0, dtype=np.float32)})
    field = light_field_of(image, "uint8")
    write_hci(field, made, tmp_path / "hci")
    depth = np.stack([read_pfm(tmp_path / "hci" / f"gt_depth_lowres_Cam{number:03}.pfm") for number in range(16)])
    assert np.isinf(depth).sum() == (~field.mask).sum() > 0
    assert np.unique(depth[np.isfinite(depth)]).tolist() == [np.float32(0.495)]
    names = [f"gt_disp_{end}.pfm" for end in ("lowres", "highres", *(f"lowres_Cam{number:03}" for number in range(16)))]
    disparity = np.concatenate([read_pfm(tmp_path / "hci" / name).ravel() for name in names])
    assert np.array_equal(np.isnan(disparity[-depth.size :]), np.isinf(depth).ravel())
    written = configparser.ConfigParser()
    written.read(tmp_path / "hci" / "parameters.cfg")
    low, high = (float(written["meta"][key]) for key in ("disp_min", "disp_max"))
    assert (low, high) == (np.nanmin(disparity), np.nanmax(disparity))
    assert low == pytest.approx(float(read_parameters(tmp_path / "hci" / "parameters.cfg").cameras.disparity(495.0)))


def test_disparity_alone_says_where_nothing_is_hit(display, picture, tmp_path):
    heights = np.full((9, 12), 5.0, dtype=np.float32)
    heights[2:7, 3:8] = -np.inf
    there_and_back(picture(display("square", distance=500), maps={"depth": heights}), tmp_path / "hci", "uint8")
    for path in (tmp_path / "hci").glob("gt_depth_*"):
        path.unlink()
    found = read_hci(tmp_path / "hci").image().maps["depth"]
    np.testing.assert_allclose(found, heights, atol=1e-3)


def test_without_depth_there_is_no_ground_truth(display, picture, tmp_path):
    found = there_and_back(picture(display(), stored="uint8"), tmp_path / "hci", "uint8")
    assert not list((tmp_path / "hci").glob("*.pfm"))
    assert (dict(found.maps), found.notes) == ({}, ())


def test_a_folder_of_the_benchmark_itself(display, picture, tmp_path):
    """Nothing in it speaks of a display; ground truth is the middle's alone."""
    made = display("square", distance=500)
    image = picture(made, stored="uint8", depth=True)
    there_and_back(image, tmp_path / "hci", "uint8")
    (tmp_path / "hci" / "lippmann.json").unlink()
    for path in (tmp_path / "hci").glob("gt_*_Cam*.pfm"):
        path.unlink()
    found = read_hci(tmp_path / "hci")
    assert found.notes == ("ground truth of a single view is left out",)
    shown = found.image()
    np.testing.assert_array_equal(shown.pixels, image.pixels)
    # Its cameras are those of the display it came from, so the display made of them has the same optics.
    again = shown.display
    assert again.name == "cameras-3x3"
    optics = (made.gap, made.panel.pixel_pitch, made.lens_array.pitch, made.viewing_distance)
    assert (again.gap, again.panel.pixel_pitch, again.lens_array.pitch, again.viewing_distance) == pytest.approx(optics)
    np.testing.assert_allclose(shown.world_from_display, np.diag([1e-3, 1e-3, 1e-3, 1]), atol=1e-12)
    np.testing.assert_array_equal(found.image(made).pixels, image.pixels)


def test_disparity_alone_gives_depth(display, picture, tmp_path):
    image = picture(display("square", distance=500), stored="uint8", depth=True)
    there_and_back(image, tmp_path / "hci", "uint8")
    for path in (tmp_path / "hci").glob("gt_depth_*"):
        path.unlink()
    np.testing.assert_allclose(read_hci(tmp_path / "hci").image().maps["depth"], image.maps["depth"], atol=1e-3)


def damage(name, content=None):
    def apply(folder):
        if content is None:
            (folder / name).unlink()
        else:
            (folder / name).write_bytes(content)

    return apply


def resize(name):
    return lambda folder: Image.new("RGB", (9, 9)).save(folder / name)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (damage("parameters.cfg"), "parameters.cfg: no such file"),
        (damage("input_Cam004.png"), "input_Cam004.png: no such file"),
        (damage("input_Cam004.png", b""), "input_Cam004.png: is empty"),
        (damage("input_Cam004.png", b"\x89PNG\r\n\x1a\n123"), "input_Cam004.png: this PNG is damaged"),
        (resize("input_Cam004.png"), "input_Cam004.png: has 9 x 9 pixels; the first view, input_Cam000.png, has 4 x 3"),
        (resize("input_Cam009.png"), "input_Cam009.png: is one view too many; parameters.cfg says 3 x 3 views"),
        (damage("gt_depth_lowres_Cam007.pfm"), "gt_depth_lowres_Cam007.pfm: no such file"),
        (damage("gt_disp_lowres.pfm", b"Pf\n4 3\n-1\n12"), "gt_disp_lowres.pfm: is cut short"),
        (
            lambda f: write_pfm(f / "gt_depth_lowres.pfm", np.zeros((2, 2), np.float32)),
            "has 2 x 2 values; parameters.cfg says 4 x 3",
        ),
        (
            lambda f: write_pfm(f / "gt_depth_lowres.pfm", np.full((3, 4), np.nan, np.float32)),
            "gt_depth_lowres.pfm: holds NaN",
        ),
        (damage("lippmann.json", b"{}"), "lippmann.json: the JSON text that describes the display is damaged"),
        (damage("lippmann.json", b'{"lippmann": 1, "layout": "views"}'), "the layout is 'views'; it must be 'hci'"),
        (
            lambda f: [resize(f"input_Cam{n:03}.png")(f) for n in range(9)],
            "has 9 x 9 pixels; parameters.cfg says 4 x 3",
        ),
        (
            lambda f: Image.fromarray(np.zeros((3, 4), np.uint16)).save(f / "input_Cam004.png"),
            "input_Cam004.png: holds uint16 values; the first view, input_Cam000.png, holds uint8",
        ),
    ],
)  # fmt: skip
def test_half_and_wrong_folders_are_refused_by_file(display, picture, tmp_path, change, what):
    folder = tmp_path / "hci"
    there_and_back(picture(display(), stored="uint8", depth=True), folder, "uint8")
    change(folder)
    with pytest.raises(PictureError) as refused:
        read_hci(folder)
    assert what in str(refused.value)


def test_what_the_layout_cannot_hold_is_refused_and_nothing_written(display, picture, tmp_path):
    deep = picture(display(), maps={"depth": np.full((9, 12), -99.0, dtype=np.float32)})
    for image, options, what in (
        (picture(display("hexagonal")), {}, "hexagonal lenses"),
        (picture(display(distance=500)), {"distance": 100.0}, "is for parallel views"),
        (deep, {"distance": 50.0}, "a surface lies 99 mm behind the lens plane"),
    ):
        with pytest.raises(LippmannError, match=what):
            write_hci(light_field_of(image, "uint8"), image.display, tmp_path / "hci", **options)
        assert not list(tmp_path.iterdir())
