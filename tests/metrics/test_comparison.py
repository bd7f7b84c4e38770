"""Two pictures side by side: what the figures catch, and what is refused."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.display import Display, LensArray, Panel
from lippmann.errors import PictureError
from lippmann.image import IntegralImage, Provenance
from lippmann.metrics import compare, error_map, psnr
from lippmann.metrics.error_image import SCALE


@pytest.fixture(scope="module")
def wide():
    """A thousand lenses of four pixels."""
    return Display("wide", Panel(4000, 12, 0.25), LensArray("lenticular", 1.0), gap=3.0)


def test_one_wrong_lens_in_a_thousand_is_caught(wide, picture):
    good = picture(wide, 0.5)
    codes = good.pixels.copy()
    codes[:, 4 * 617 : 4 * 618] += 0.3
    found = compare(good, picture(wide, codes))
    assert found.psnr > 40  # the mean sees nothing
    assert (found.worst.column, found.worst.row) == (617, 0)
    assert found.worst.psnr == pytest.approx(psnr(0.09), abs=1e-4)
    assert found.percentile_1.psnr == math.inf  # nor does the best of the ten worst


def test_the_first_percentile_is_the_tenth_worst_of_a_thousand(wide, picture):
    good = picture(wide, 0.5)
    codes = good.pixels.copy()
    for place in range(10):
        codes[:, 40 * place : 40 * place + 4] += 0.01 * (place + 1)
    found = compare(good, picture(wide, codes))
    assert (found.worst.column, found.percentile_1.column) == (90, 0)
    assert found.percentile_1.psnr == pytest.approx(40.0, abs=1e-4)


def test_psnr_pools_all_errors(display, picture):
    plain = display()
    codes = np.full((32, 64, 3), 0.5)
    codes[:16, :, 1] = 0.8
    found = compare(picture(plain, 0.5), picture(plain, codes))
    assert found.mean_squared_error == pytest.approx(0.09 / 6)
    assert found.psnr == pytest.approx(10 * math.log10(6 / 0.09))


def test_errors_on_silhouettes_are_left_out(display, picture):
    codes = np.full((32, 64, 3), 0.2)
    codes[16:] = 0.8
    wrong = codes.copy()
    wrong[16] = 0.2  # the outline one row too low
    wrong[5, 5] = 0.3
    found = compare(picture(display(), codes), picture(display(), wrong))
    assert found.silhouettes.share == pytest.approx(2 / 32)
    assert found.psnr_off_silhouettes == pytest.approx(psnr(0.01 / (30 * 64)), abs=1e-4)
    assert found.psnr < found.psnr_off_silhouettes


def test_equal_pictures_are_json_too(any_display, picture):
    image = picture(any_display, np.random.default_rng(0).uniform(0, 1, (32, 64, 3)))
    found = compare(image, image)
    values = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert values["identical"] is True
    assert values["psnr"] is None
    assert values["micro_images"]["worst"]["psnr"] is None
    assert values["paper"]["paper_mean_psnr"] is None
    assert values["paper"]["unchanged_micro_images"] == values["micro_images"]["count"]
    assert values["ssim"]["mean"] == pytest.approx(1.0)


def test_no_pixel_off_silhouettes(display, picture):
    checker = np.indices((32, 64)).sum(axis=0)[..., None] % 2
    found = compare(picture(display(), checker), picture(display(), 0.5))
    assert found.silhouettes.share == 1
    assert found.to_dict()["psnr_off_silhouettes"] is None


@pytest.mark.long
@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**31), kind=st.sampled_from(["lenticular", "slanted", "square", "hexagonal"]))
def test_what_always_holds(display, picture, seed, kind):
    generator = np.random.default_rng(seed)
    panel = display(kind)
    a, b = (picture(panel, generator.uniform(0, 1, (32, 64, 3))) for _ in range(2))
    found, reverse = compare(a, b), compare(b, a)
    assert found.psnr == pytest.approx(reverse.psnr)
    assert found.worst == reverse.worst
    assert found.worst.psnr <= found.percentile_1.psnr
    assert found.worst.psnr <= found.psnr + 1e-9
    rows = list(found.rows())
    pooled = sum(row["mean_squared_error"] * row["pixels"] for row in rows) / sum(row["pixels"] for row in rows)
    assert pooled == pytest.approx(found.mean_squared_error)
    assert min(row["psnr"] for row in rows) == found.worst.psnr
    # 8-bit codes differ from the values by half a code at most.
    assert all(row["paper_psnr"] == pytest.approx(row["psnr"], abs=0.2) for row in rows)
    assert sum(row["paper_psnr"] for row in rows) / len(rows) == pytest.approx(found.paper.mean_psnr)


def test_different_sizes_are_refused(display, picture):
    with pytest.raises(PictureError, match=r"64 x 32 and 72 x 32 pixels; only pictures of one display"):
        compare(picture(display(), 0.5), picture(display(width=72), 0.5))


@pytest.mark.parametrize(("name", "what"), [("other", "test and other"), ("test", "lens_array.layout is lenticular")])
def test_different_displays_are_refused(display, picture, name, what):
    with pytest.raises(PictureError, match=what):
        compare(picture(display(), 0.5), picture(display("square", name=name), 0.5))


def test_the_name_of_a_display_does_not_matter(display, picture):
    assert compare(picture(display(name="a"), 0.5), picture(display(name="b"), 0.5)).identical


def test_readers_are_told_what_may_mislead(display, picture):
    plain = display()
    assert compare(picture(plain, 0.5), picture(plain, 0.4)).notes == ()

    def made(scene="teapot", move=0.0, transfer="srgb"):
        place = np.eye(4)
        place[0, 3] = move
        return IntegralImage(np.zeros((32, 64, 3)), plain, place, Provenance("full", scene=scene, transfer=transfer))

    assert "linear" in compare(made(), made(transfer="linear")).notes[0]
    assert "teapot and tree" in compare(made(), made("tree")).notes[0]
    assert "different place" in compare(made(), made(move=1.0)).notes[0]


def test_the_error_map_shows_where_and_how_much(display, picture):
    codes = np.full((32, 64, 3), 0.5)
    codes[3, 20] = [0.5, 0.5, 0.8]
    codes[9, 33] = 0.0
    found = compare(picture(display(), 0.5), picture(display(), codes))
    shown = error_map(found)
    assert shown.provenance.transfer == "linear"
    np.testing.assert_allclose(shown.maps["error"][3, 20], 0.3 / math.sqrt(3), rtol=1e-5)
    assert np.count_nonzero(shown.maps["error"]) == 2
    lens = shown.maps["micro_image_psnr"]
    assert lens[0, 16] == pytest.approx(psnr(0.03 / 256), abs=1e-3)
    assert lens[0, 0] == 999
    assert shown.maps["silhouettes"].max() == 0  # the reference is plain
    np.testing.assert_allclose(shown.pixels[9, 33], SCALE[-1], atol=1e-6)
    np.testing.assert_allclose(shown.pixels[0, 0], SCALE[0], atol=1e-6)
    assert shown.pixels[0, 0].sum() < shown.pixels[3, 20].sum() < shown.pixels[9, 33].sum()
