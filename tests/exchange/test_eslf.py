"""ESLF: one PNG of micro-images, each turned about its centre against the display's own."""

from __future__ import annotations

from dataclasses import replace

import imagecodecs
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from lippmann.errors import PictureError
from lippmann.exchange.eslf import read_eslf, write_eslf
from lippmann.exchange.light_field import light_field_of


@settings(max_examples=12, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(st.data(), st.sampled_from(["uint8", "uint16"]))
def test_codes_come_back_exactly(random_displays, picture, same, tmp_path_factory, data, stored):
    image = picture(data.draw(random_displays()), data.draw(st.integers(0, 99)), stored=stored)
    path = tmp_path_factory.getbasetemp() / "x.png"
    write_eslf(light_field_of(image, stored), image.display, path)
    same(read_eslf(path).image(), image)


def test_every_micro_image_is_turned_about_its_centre(display, picture, tmp_path):
    image = picture(display("square", lenses=(4, 3), pixels=3), stored="uint8")
    write_eslf(light_field_of(image, "uint8"), image.display, tmp_path / "x.png")
    image.save(tmp_path / "native.png", bits=8)
    native, eslf = (np.asarray(Image.open(tmp_path / name)) for name in ("native.png", "x.png"))
    for row in range(3):
        for column in range(4):
            box = np.s_[3 * row : 3 * row + 3, 3 * column : 3 * column + 3]
            np.testing.assert_array_equal(eslf[box], native[box][::-1, ::-1])


def test_it_is_not_taken_for_a_native_picture(display, picture, tmp_path):
    from lippmann.image import read_picture

    image = picture(display(), stored="uint8")
    write_eslf(light_field_of(image, "uint8"), image.display, tmp_path / "x.png")
    with pytest.raises(PictureError, match="has no display in it"):
        read_picture(tmp_path / "x.png")
    image.save(tmp_path / "native.png")
    with pytest.raises(
        PictureError, match=r"native.png: is the native picture of a display; in ESLF every micro-image"
    ):
        read_eslf(tmp_path / "native.png")


def test_another_program_s_file(tmp_path, display):
    codes = np.random.default_rng(0).integers(0, 255, (28, 42, 3), dtype=np.uint8)
    Image.fromarray(codes).save(tmp_path / "x.png")
    found = read_eslf(tmp_path / "x.png")
    assert found.shape == (14, 14, 2, 3)
    # As the toolbox takes it apart: pixel (t, s) of every lens.
    for t, s in ((0, 0), (3, 13), (13, 5)):
        np.testing.assert_array_equal(found.values[t, s], codes[t::14, s::14])
    with pytest.raises(
        PictureError, match=r"its display has 14 x 14 pixels under each lens, for its views, and 3 x 2 lenses"
    ):
        found.image()
    made = display("square", lenses=(6, 4), pixels=7)
    again = read_eslf(tmp_path / "x.png", grid=(7, 7))
    assert again.shape == (7, 7, 4, 6)
    shown = again.image(made, where="a/x.png", layout="eslf")
    assert shown.display == made
    made_by = (shown.provenance.method, shown.provenance.scene, shown.provenance.options)
    assert made_by == ("import", "x", {"layout": "eslf"})


def test_the_weight_is_alpha(display, picture, tmp_path):
    made = display()
    codes = np.random.default_rng(1).integers(0, 255, (9, 12), endpoint=True)
    image = picture(made, stored="uint8", maps={"weight": (codes / 255).astype(np.float32)})
    write_eslf(light_field_of(image, "uint8"), made, tmp_path / "x.png")
    assert imagecodecs.png_decode((tmp_path / "x.png").read_bytes()).shape == (9, 12, 4)
    found = read_eslf(tmp_path / "x.png").image()
    np.testing.assert_array_equal(found.maps["weight"], image.maps["weight"])
    np.testing.assert_array_equal(found.pixels, image.pixels)


def test_wrong_and_half_files_are_refused(display, picture, tmp_path):
    path = tmp_path / "x.png"

    def refused(**options):
        with pytest.raises(PictureError) as error:
            read_eslf(path, **options)
        assert str(error.value).startswith(str(path))
        return str(error.value)

    assert "no such file" in refused()
    Image.new("RGB", (28, 30)).save(path)
    assert (
        "has 28 x 30 pixels; with 14 x 14 pixels per lens its sides must be multiples of these; say display=..."
        in refused()
    )
    Image.new("L", (28, 28)).save(path)
    assert "is not in colour" in refused()
    Image.new("RGB", (28, 28)).save(path, format="TIFF")
    assert "is a picture of the format tiff; ESLF is PNG" in refused()
    image = picture(display(), stored="uint8")
    write_eslf(light_field_of(image, "uint8"), image.display, path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    assert "this PNG is damaged" in refused()
    path.write_bytes(whole)
    assert "has 12 x 9 pixels; with 5 x 3 pixels per lens" in refused(grid=(5, 3))
    with pytest.raises(PictureError, match="hexagonal lenses; ESLF takes"):
        write_eslf(light_field_of(picture(display("hexagonal")), "uint8"), display("hexagonal"), path)
    assert path.read_bytes() == whole


@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_the_file_says_srgb_of_srgb_codes_alone(display, picture, tmp_path, transfer):
    image = picture(display("square", lenses=(4, 3), pixels=3), stored="uint8")
    provenance = replace(image.provenance, transfer=transfer)
    write_eslf(light_field_of(replace(image, provenance=provenance), "uint8"), image.display, tmp_path / "x.png")
    with Image.open(tmp_path / "x.png") as found:
        assert ("srgb" in found.info) == (transfer == "srgb")
