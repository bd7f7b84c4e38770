"""What a film shows of a picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel, load_display
from lippmann.errors import OutputError, PictureError
from lippmann.image import IntegralImage, read_picture
from lippmann.quilts.quilt import Quilt, QuiltLayout
from lippmann.quilts.weave import view_fraction
from lippmann.viewing.replay import default_eye, replay
from lippmann.viewing.video_frames import WIDEST_QUILT, projection_of, quilt_of, quilt_of_video, view_toward


@pytest.fixture(scope="module")
def image(engine, tmp_path_factory):
    from lippmann import api

    return api.render("primitives", integrator="normal", spp=1, device="cpu")


@pytest.mark.long
def test_a_plain_name_shows_what_an_eye_sees(image):
    assert np.array_equal(projection_of(Path("film.mp4"))(image), replay(image))
    eye = (20.0, 0.0, 900.0)
    assert np.array_equal(projection_of(Path("film.png"), eye)(image), replay(image, eye))


@pytest.mark.slow
def test_a_quilts_name_shows_a_quilt(image):
    seen = projection_of(Path("film_qs4x2a1.mp4"))(image)
    assert seen.shape == (1024, 2048, 3)
    assert np.array_equal(seen, quilt_of(image, QuiltLayout(4, 2, 1.0)).pixels)


def test_the_views_of_a_quilt_go_from_left_to_right_across_the_field(image):
    quilt = quilt_of(image, QuiltLayout(3, 1, None))
    x, y, z = default_eye(image.display)
    reach = 2 * z * np.tan(np.radians(image.display.field_of_view / 2))
    size = quilt.view_size
    for number, place in enumerate((-1 / 3, 0, 1 / 3)):
        assert np.array_equal(quilt.view(number), replay(image, (x + place * reach, y, z), size=size))
    assert not np.array_equal(quilt.view(0), quilt.view(2))


def test_the_views_of_a_slanted_panels_quilt_are_those_of_its_cone():
    """Level eyes cross the slanted lenses by the cosine of what they move: at 30 degrees 2 of 20 views were missing."""
    panel = Panel(240, 90, 0.1)
    display = Display("d", panel, LensArray("lenticular", 4.8, slant=30.0), 6.0, viewing_distance=300.0)
    x, y = display.panel_point(*np.meshgrid(np.arange(240) + 0.5, np.arange(90) + 0.5))
    numbers = np.repeat(20 * view_fraction(display, x, y)[..., None], 3, axis=-1)
    quilt = quilt_of(IntegralImage(numbers, display), QuiltLayout(20, 1, None))
    for number in (0, 9, 19):
        assert np.median(quilt.view(number)) == pytest.approx(number + 0.5, abs=0.2)


def test_what_a_quilt_leaves_free_on_the_right_and_on_top_is_left_out():
    values = np.arange(7 * 9, dtype=np.uint8).repeat(3).reshape(7, 9, 3)
    assert np.array_equal(quilt_of_video(Quilt(values, QuiltLayout(2, 2, None), "uint8")), values[1:, :8])


def test_an_eye_on_the_right_sees_a_view_on_the_right():
    display = load_display("looking-glass-portrait")
    assert [view_toward(display, 48, (x, 0.0, 600.0)) for x in (-900, -1, 1, 900)] == [0, 23, 24, 47]


def test_quilts_keep_within_what_players_take(image):
    assert quilt_of(image, QuiltLayout(12, 4, None)).pixels.shape[1] <= WIDEST_QUILT


@pytest.mark.parametrize(
    ("name", "kind", "message"),
    [
        ("film.avi", OutputError, "unknown ending of an animation '.avi'"),
        ("film_qs.mp4", PictureError, "does not say how many views"),
        ("film_qs0x4a1.mp4", PictureError, "columns"),
    ],
)
def test_other_names_are_refused(name, kind, message):
    with pytest.raises(kind, match=message):
        projection_of(Path(name))


def test_a_picture_from_a_file_is_shown_alike(image, tmp_path):
    image.save(tmp_path / "x.exr", bits=32)
    show = projection_of(Path("film.mp4"))
    assert np.array_equal(show(read_picture(tmp_path / "x.exr")), show(image))
