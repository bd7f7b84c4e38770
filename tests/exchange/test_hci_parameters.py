"""``parameters.cfg``: the benchmark's own file is understood, ours has its keys, bad ones are refused by key."""

from __future__ import annotations

import configparser

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.errors import PictureError
from lippmann.exchange.cameras import Cameras
from lippmann.exchange.hci_parameters import NAME, Parameters, read_parameters, write_parameters

#: As the benchmark's scenes have it, in its own way of writing.
PUBLISHED = """\
[intrinsics]
focal_length_mm = 100.0
image_resolution_x_px = 512
image_resolution_y_px = 384
sensor_size_mm = 35.0
fstop = 100.0

[extrinsics]
num_cams_x = 9
num_cams_y = 9
baseline_mm = 40.0
focus_distance_m = 8.0
center_cam_x_m = 1.0
center_cam_y_m = -2.0
center_cam_z_m = 3.0
center_cam_rx_rad = 1.5707963267948966
center_cam_ry_rad = 0.0
center_cam_rz_rad = 1.5707963267948966
offset = 14.6

[meta]
scene = 50 % of it
disp_min = -1.5
"""


def written(tmp_path, text):
    path = tmp_path / NAME
    path.write_text(text, encoding="utf-8")
    return path


def test_the_benchmark_s_own_file(tmp_path):
    found = read_parameters(written(tmp_path, PUBLISHED))
    assert (found.across, found.down, found.width, found.height) == (9, 9, 512, 384)
    cameras = found.cameras
    assert (cameras.baseline, cameras.focus_distance, cameras.parallel) == (40.0, 8000.0, False)
    # A pixel of the focus plane: 35 mm / 512 at 100 mm, seen at 8 m.
    assert cameras.pixel_pitch == pytest.approx(35 / 512 * 80)
    # Z = 4 m: (40 * 100 * 8000 * 512 / 4000 - 40 * 100 * 512) / (8000 * 35), by hand.
    assert cameras.disparity(np.array(4000.0)) == pytest.approx(7.314285714)
    assert cameras.disparity(np.array(8000.0)) == 0


def test_the_cameras_pose_places_the_display(tmp_path):
    placed = read_parameters(written(tmp_path, PUBLISHED)).cameras.world_from_display
    # Turned by 90 degrees about x and then about z, a camera looks along -x with z up and y to its right.
    np.testing.assert_allclose(placed @ [0, 0, 8000, 1], [1, -2, 3, 1], atol=1e-12)
    np.testing.assert_allclose(placed @ [0, 0, 0, 1], [1 - 8, -2, 3, 1], atol=1e-12)
    np.testing.assert_allclose(placed @ [1000, 0, 8000, 1], [1, -1, 3, 1], atol=1e-12)
    np.testing.assert_allclose(placed @ [0, 1000, 8000, 1], [1, -2, 4, 1], atol=1e-12)


LENGTHS = st.floats(1e-3, 1e6)


@settings(deadline=None, max_examples=20)
@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 999), st.integers(1, 999), LENGTHS, LENGTHS, LENGTHS)
def test_what_is_written_is_read(tmp_path_factory, across, down, width, height, baseline, focus, pitch):
    path = tmp_path_factory.getbasetemp() / NAME
    write_parameters(
        path, Parameters(across, down, width, height, Cameras(baseline, focus, pitch)), {"scene": "a\n= %"}
    )
    found = read_parameters(path)
    assert (found.across, found.down, found.width, found.height) == (across, down, width, height)
    cameras = found.cameras
    assert (cameras.baseline, cameras.focus_distance, cameras.pixel_pitch) == pytest.approx((baseline, focus, pitch))
    np.testing.assert_allclose(cameras.world_from_display, np.diag([1e-3, 1e-3, 1e-3, 1]), atol=1e-9 * focus)


def test_all_keys_that_the_benchmark_s_readers_ask_for(tmp_path):
    meta = dict.fromkeys(("scene", "category", "date", "version", "authors", "contact"), "x")
    meta |= dict.fromkeys(("cycles_seed", "disp_min", "disp_max", "frustum_disp_min", "frustum_disp_max"), 1)
    write_parameters(tmp_path / NAME, Parameters(2, 2, 3, 3, Cameras(1, 2, 3)), {**meta, "depth_map_scale": 1.0})
    parser = configparser.ConfigParser()
    parser.read(tmp_path / NAME)
    assert list(parser["intrinsics"]) == [
        "focal_length_mm",
        "image_resolution_x_px",
        "image_resolution_y_px",
        "sensor_size_mm",
        "fstop",
    ]
    assert set(parser["extrinsics"]) == {
        *("num_cams_x", "num_cams_y", "baseline_mm", "focus_distance_m", "offset"),
        *("center_cam_x_m", "center_cam_y_m", "center_cam_z_m"),
        *("center_cam_rx_rad", "center_cam_ry_rad", "center_cam_rz_rad"),
    }
    assert set(parser["meta"]) == {*meta, "depth_map_scale"}


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("baseline_mm = 40.0\n", "", "baseline_mm is missing"),
        ("baseline_mm = 40.0", "baseline_mm = 0", "baseline_mm is 0; it must be above zero"),
        ("baseline_mm = 40.0", "baseline_mm = nan", "baseline_mm is 'nan'; it must be a number"),
        ("focus_distance_m = 8.0", "focus_distance_m = far", "focus_distance_m is 'far'"),
        ("num_cams_x = 9", "num_cams_x = 8.5", "num_cams_x is 8.5; it must be a whole number"),
        ("num_cams_x = 9", "num_cams_x = 1e9", "num_cams_x is 1e+09"),
        ("center_cam_x_m = 1.0", "center_cam_x_m = inf", "center_cam_x_m is 'inf'"),
        ("[extrinsics]\n", "", "[extrinsics]: num_cams_x is missing"),
        ("[intrinsics]\n", "", "is no list of parameters"),
    ],
)
def test_bad_values_are_refused_by_key(tmp_path, old, new, what):
    assert old in PUBLISHED
    with pytest.raises(PictureError) as refused:
        read_parameters(written(tmp_path, PUBLISHED.replace(old, new)))
    assert what in str(refused.value)
    assert NAME in str(refused.value)


def test_a_binary_file_is_refused(tmp_path):
    (tmp_path / NAME).write_bytes(b"\xff\xfe[\0")
    with pytest.raises(PictureError, match="is no list of parameters"):
        read_parameters(tmp_path / NAME)
