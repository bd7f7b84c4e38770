"""Two eyes: their order, the sign and size of disparity, no crosstalk, and the anaglyph's colours."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lippmann.display import NUMPY, Display, LensArray, Panel
from lippmann.errors import UsageError
from lippmann.image import IntegralImage
from lippmann.viewing import stereo
from lippmann.viewing.replay import replay
from lippmann.viewing.stereo import (
    DUBOIS_LEFT,
    DUBOIS_RIGHT,
    anaglyph,
    eyes_of,
    head_path,
    replay_stereo,
    side_by_side,
    stereo_pair,
)

#: 160 lenses of 0.5 mm with 21 pixels each; at 300 mm a field of 200 mm, in which both eyes are.
FINE = Display("fine", Panel(160 * 21, 4, 0.5 / 21), LensArray("lenticular", 0.5), gap=0.75)


def bar_at(z: float, half_width: float = 1.0) -> IntegralImage:
    """The display's picture of a white upright bar at x = 0, ``z`` mm in front of the lens plane."""
    row, column = np.indices((FINE.panel.height, FINE.panel.width)).astype(float)
    x, y = FINE.panel_point(column + 0.5, row + 0.5)
    (ox, _, oz), (dx, _, dz) = FINE.light_ray(x, y, NUMPY)
    hits = np.abs(ox + (z - oz) / dz * dx) < half_width
    return IntegralImage(np.repeat(hits[..., None], 3, axis=-1).astype(np.float32), FINE)


def middle(picture) -> float:
    """Centre of the white in mm from the picture's centre."""
    weights = picture[..., 0].sum(axis=0)
    return float((weights * (np.arange(weights.size) + 0.5)).sum() / weights.sum() / weights.size - 0.5) * 80


@pytest.mark.parametrize("z", [-30.0, -15.0, 0.0, 15.0, 30.0])
def test_disparity_is_that_of_the_point_s_depth(z):
    pair = replay_stereo(bar_at(z), (0, 0, 300), eyes=60, size=(1600, 4))
    left, right = np.split(pair, 2, axis=1)
    # By similar triangles about the point; crossed (the left eye's is farther right) in front of the screen.
    expected = 60 * z / (300 - z)
    # Each eye's place is known to half a lens.
    assert middle(left) - middle(right) == pytest.approx(expected, abs=0.8)


def test_the_left_half_is_the_left_eye_s_picture_alone():
    image = bar_at(4)
    left, right = eyes_of((10, 5, 300), 63)
    assert left == (10 - 31.5, 5, 300)
    assert right == (10 + 31.5, 5, 300)
    pair = replay_stereo(image, (10, 5, 300), size=(320, 4))
    assert pair.shape == (4, 640, 3)
    np.testing.assert_array_equal(pair[:, :320], replay(image, left, size=(320, 4)))
    np.testing.assert_array_equal(pair[:, 320:], replay(image, right, size=(320, 4)))


def test_half_width_halves_the_columns_in_linear_light():
    rng = np.random.default_rng(5)
    left, right = rng.random((2, 3, 7, 3), dtype=np.float32)
    pair = side_by_side(left, right, half=True)
    assert pair.shape == (3, 8, 3)
    np.testing.assert_allclose(pair[:, 1], (left[:, 2] + left[:, 3]) / 2, rtol=1e-6)
    np.testing.assert_allclose(pair[:, 3], left[:, 6], rtol=1e-6)
    np.testing.assert_allclose(pair[:, 4], (right[:, 0] + right[:, 1]) / 2, rtol=1e-6)


def test_each_eye_has_its_own_place_and_no_other_light():
    def see(eye):
        return np.full((2, 4, 3), 1.0 if eye[0] < 0 else 0.0, dtype=np.float32)

    for kind, width in (("full", 8), ("half", 4)):
        pair = stereo_pair(see, (0, 0, 600), kind)
        assert pair.shape == (2, width, 3)
        assert np.all(pair[:, : width // 2] == 1)
        assert np.all(pair[:, width // 2 :] == 0)


def test_grey_stays_grey_in_an_anaglyph_and_each_eye_sees_its_own():
    white, black = np.ones((1, 1, 3), np.float32), np.zeros((1, 1, 3), np.float32)
    np.testing.assert_allclose(anaglyph(white, white), 1.0, atol=0.05)
    np.testing.assert_allclose(anaglyph(white * 0.2, white * 0.2), 0.2, atol=0.02)
    red, cyan = anaglyph(white, black)[0, 0], anaglyph(black, white)[0, 0]
    assert red[0] > 0.95
    assert red[1:].max() == 0
    assert cyan[0] == 0
    assert cyan[1:].min() > 0.95
    assert anaglyph(white * 50, black).max() <= 1
    # Light that a display cannot show adds to no other colour.
    np.testing.assert_array_equal(anaglyph(white * 50, white), anaglyph(white, white))
    np.testing.assert_array_equal(anaglyph(white, white * 50), anaglyph(white, white))


def test_the_anaglyph_s_matrices_are_the_least_squares_solution():
    # Spectra of a display's primaries and of both glasses, in CIE XYZ, as Sanders and McAllister publish them.
    left = [[5.42327, 0.807004, 0.047325], [2.70972, 0.50201, 0.0250529], [5.50941e-5, 4.11221e-4, 2.40686e-3]]
    right = [[0.180431, 1.6395, 2.00309], [0.448214, 6.31551, 1.35757], [0.289201, 2.3925, 11.062]]
    screen = [[11.6638, 8.3959, 4.65843], [7.10807, 16.6845, 2.45008], [0.527874, 3.79124, 24.0604]]
    seen = np.concatenate([left, right])
    wanted = np.kron(np.eye(2), screen)
    solution = np.linalg.pinv(seen) @ wanted
    solution /= solution.sum(axis=1, keepdims=True)  # white stays white
    np.testing.assert_allclose(np.concatenate([DUBOIS_LEFT, DUBOIS_RIGHT], axis=1), solution, atol=2e-5)


@pytest.mark.parametrize("eyes", [0, -63, float("nan"), float("inf"), 1001])
def test_a_distance_between_the_eyes_out_of_range(eyes):
    with pytest.raises(UsageError, match="out of range; it must be above 0 and at most 1000 mm"):
        eyes_of((0, 0, 600), eyes)


def test_an_unknown_kind_of_pair():
    with pytest.raises(UsageError, match="unknown form 'top'; known are full, half, anaglyph"):
        replay_stereo(bar_at(0), stereo="top")


def test_a_head_path_is_read(tmp_path):
    path = tmp_path / "path.csv"
    path.write_text("# x,y,z\n0,0,600\n\n -10.5, 2e1, 550 \n")
    assert head_path(path) == [(0, 0, 600), (-10.5, 20, 550)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0,0,600\n1,2\n", r":2: '1,2' is no position; each line is X,Y,Z in mm, z above 0"),
        ("0,0,-5\n", r":1: '0,0,-5' is no position"),
        ("0,0,nan\n", r":1: '0,0,nan' is no position"),
        ("x,y,z\n", r":1: 'x,y,z' is no position"),
        ("# nothing\n", r"there is no position in it"),
        ("\x00\xff", r":1: .* is no position"),
    ],
)
def test_bad_head_paths_are_refused_in_one_line(tmp_path, text, said):
    path = tmp_path / "path.csv"
    path.write_text(text)
    with pytest.raises(UsageError, match=said) as caught:
        head_path(path)
    assert "\n" not in str(caught.value)


def test_a_head_path_that_is_too_long(tmp_path, monkeypatch):
    path = tmp_path / "path.csv"
    path.write_text("0,0,600\n" * 5)
    monkeypatch.setattr(stereo, "MOST_POSITIONS", 4)
    with pytest.raises(UsageError, match="too many positions; at most 4"):
        head_path(path)
    monkeypatch.setattr(stereo, "MOST_BYTES", 39)
    with pytest.raises(UsageError, match="is too large; at most 39 bytes"):
        head_path(path)
    with pytest.raises(UsageError, match="is a device, no file"):
        head_path(Path("/dev/zero"))


def test_a_head_path_that_cannot_be_read(tmp_path):
    with pytest.raises(UsageError, match="no such file"):
        head_path(tmp_path / "none.csv")
    (tmp_path / "path.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UsageError, match="is no text"):
        head_path(tmp_path / "path.csv")
