"""Maps of where pixels came from, and parts of frames."""

from __future__ import annotations

import base64
import io

import numpy as np
from PIL import Image

from lippmann.color.transfer import quantize
from lippmann.viewing import diagnostic_maps


def image_of(results, key="interpolated-paper"):
    return results.of("teapot", key).image


def test_missed_pixels_are_told_apart(results):
    image = image_of(results)
    status, codes = image.maps["status"], diagnostic_maps.missed_codes(image)
    assert set(np.unique(status)) == {0, 1, 2}
    for value, code in (
        (0, diagnostic_maps.TRACED_CODE),
        (1, diagnostic_maps.REPROJECTED_CODE),
        (2, diagnostic_maps.INTERPOLATED_CODE),
    ):
        assert (codes[status == value] == code).all()


def test_reprojected_and_traced_frames_hold_those_pixels_alone(results):
    image = image_of(results)
    whole, status = quantize(image.pixels, 8, "linear"), image.maps["status"]
    for codes, value in ((diagnostic_maps.reprojected_codes(image), 1), (diagnostic_maps.traced_codes(image), 0)):
        np.testing.assert_array_equal(codes[status == value], whole[status == value])
        assert (codes[status != value] == diagnostic_maps.EMPTY_CODE).all()


def test_a_picture_without_status_has_no_map(results):
    image = results.full("teapot").image
    assert diagnostic_maps.missed_codes(image) is None
    assert diagnostic_maps.reprojected_codes(image) is None
    assert diagnostic_maps.traced_codes(image) is None


def test_what_an_eye_sees_is_smaller_where_the_panel_is_large(results):
    image = image_of(results)
    assert diagnostic_maps.replayed_codes(image).shape == (48, 128, 3)


def test_errors_are_dark_where_there_are_none(results):
    found = results.of("teapot", "interpolated-paper").comparison
    codes = diagnostic_maps.error_codes(found).astype(int).sum(axis=2)
    assert len(np.unique(codes[:, :8])) == 1  # the micro-image on the left has no error
    assert codes[:, 8:].max() > codes[:, :8].max()


def test_data_uris_are_the_pixels(results):
    codes = diagnostic_maps.display_codes(image_of(results))
    head, _, body = diagnostic_maps.data_uri(codes).partition(",")
    assert head == "data:image/png;base64"
    with Image.open(io.BytesIO(base64.b64decode(body))) as picture:
        np.testing.assert_array_equal(np.asarray(picture), codes)
