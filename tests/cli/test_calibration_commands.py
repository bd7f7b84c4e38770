"""``lippmann calibrate pattern``, and what it says of bad input."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.calibration import Pattern, draw
from lippmann.display import Panel
from lippmann.display.formats.monitor import Monitor
from lippmann.image import read_picture

SHORT = "monitor:size=480x264,dpi=84.667,pitch=7.1,slope=-4.7,center=0.31,viewing-distance=700"
MONITOR = Monitor("monitor", Panel(480, 264, 25.4 / 84.667), 7.1, -4.7, 0.31, viewing_distance=700.0)
FILE = """[monitor]
width = 480
height = 264
pixel_pitch = "84.667 dpi"
pitch = 7.1
slope = -4.7
center = 0.31
viewing_distance = 700
"""


@pytest.fixture
def monitor_file(tmp_path):
    path = tmp_path / "monitor.toml"
    path.write_text(FILE)
    return path


def test_stripes_for_a_display_file(lippmann, monitor_file, tmp_path):
    path = tmp_path / "stripes.png"
    outcome = lippmann("calibrate", "pattern", "stripes", "--display", monitor_file, "-o", path)
    assert outcome.code == 0
    assert outcome.out == f"{path}: stripes, pitch 7.1 lpi, slope -4.7, center 0.31\n"
    image = read_picture(path)
    np.testing.assert_array_equal(image.pixels, draw(Pattern("stripes"), MONITOR))
    assert image.provenance.subpixels


def test_a_zarr_picture_is_replaced(lippmann, monitor_file, tmp_path):
    path = tmp_path / "stripes.zarr"
    for views in (3, 5):
        outcome = lippmann("calibrate", "pattern", "stripes", "-d", monitor_file, "--views", views, "-o", path)
        assert outcome.code == 0
    np.testing.assert_array_equal(read_picture(path).pixels, draw(Pattern("stripes", views=5), MONITOR))


def test_values_can_be_turned(lippmann, monitor_file, tmp_path):
    path = tmp_path / "stripes.tif"
    turned = ("--pitch", "7.2", "--slope", "5", "--center", "-0.1", "--views", "5")
    outcome = lippmann("calibrate", "pattern", "stripes", "-d", monitor_file, *turned, "-o", path, "--json")
    assert outcome.json == {
        "output": str(path),
        "size": [480, 264],
        "pitch": 7.2,
        "slope": 5.0,
        "center": -0.1,
        "pattern": "stripes",
        "fields": [],
    }
    other = Monitor("monitor", MONITOR.panel, 7.2, 5.0, -0.1)
    np.testing.assert_array_equal(read_picture(path).pixels, draw(Pattern("stripes", views=5), other))


def test_upright_lenses(lippmann, tmp_path):
    path = tmp_path / "pitch.png"
    outcome = lippmann("calibrate", "pattern", "slope", "-d", SHORT, "--slope", "infinite", "-o", path, "--json")
    assert outcome.json["slope"] is None
    values = outcome.json["fields"]
    assert len(values) == 11
    assert values[5] is None
    assert values[4] < 0 < values[6]


@pytest.mark.parametrize("name", ["pitch", "slope", "center"])
def test_the_values_of_the_fields_are_told(lippmann, tmp_path, name):
    path = tmp_path / "fields.png"
    outcome = lippmann("calibrate", "pattern", name, "-d", SHORT, "--fields", "5", "-o", path)
    assert outcome.code == 0
    assert outcome.out.splitlines()[1].count(", ") == 4
    assert read_picture(path).provenance.options["pattern"] == name


def test_what_an_eye_sees_of_the_pattern(lippmann, monitor_file, tmp_path):
    """Whole commands: drawn with the right values, one colour from each place."""
    path, seen = tmp_path / "stripes.png", tmp_path / "seen.exr"
    assert lippmann("calibrate", "pattern", "stripes", "-d", monitor_file, "-o", path).code == 0
    colors = []
    for x in (-147, 0, 147):
        assert lippmann("replay", path, f"--eye={x},0,700", "-o", seen).code == 0
        import OpenEXR

        with OpenEXR.File(str(seen)) as file:
            pixels = file.channels()["RGB"].pixels[20:-20, 20:-20]
        assert (pixels == pixels[0, 0]).all()
        colors.append(pixels[0, 0].tolist())
    assert colors == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("moire", "-d", SHORT), "unknown pattern 'moire'"),
        (("stripes",), "--display"),
        (("stripes", "-d", "mla-square"), "mla-square has square lenses"),
        (("stripes", "-d", "monitor"), "monitor: size: size is missing"),
        (("stripes", "-d", SHORT.replace("7.1", "0")), "monitor: pitch: '0' is no length; lpi must be above zero"),
        (("stripes", "-d", SHORT.replace("-4.7", "0")), "slope is 0; it must be at least 0.18"),
        (("stripes", "-d", SHORT, "--slope", "0"), "slope is 0"),
        (("stripes", "-d", SHORT, "--pitch", "-1"), "pitch is -1"),
        (("stripes", "-d", SHORT, "--pitch", "wide"), "--pitch: 'wide' is not a number"),
        (("stripes", "-d", SHORT, "--pitch", "90"), "it must cover at least one"),
        (("stripes", "-d", SHORT, "--center", "nan"), "--center: 'nan' is not a number"),
        (("stripes", "-d", SHORT, "--views", "0"), "0 is out of range"),
        (("stripes", "-d", SHORT, "--step", "1"), "--step: does not apply to stripes"),
        (("stripes", "-d", SHORT, "--fields", "5"), "--fields: does not apply to stripes"),
        (("pitch", "-d", SHORT, "--views", "5"), "--views: does not apply to pitch"),
        (("pitch", "-d", SHORT, "--step", "0"), "0 is out of range"),
        (("pitch", "-d", SHORT, "--step", "5"), "use a smaller step or fewer fields"),
        (("pitch", "-d", SHORT, "--fields", "1000"), "1000 is out of range"),
    ],
)
def test_bad_input_is_one_line_and_code_2(lippmann, tmp_path, words, said):
    path = tmp_path / "pattern.png"
    outcome = lippmann("calibrate", "pattern", *words, "-o", path, "--quiet")
    assert outcome.code == 2
    assert outcome.out == ""
    assert outcome.err.startswith("lippmann: ")
    assert outcome.err.count("\n") == 1
    assert said in outcome.err
    assert not path.exists()


def test_a_foreign_ending_is_refused_first(lippmann, tmp_path):
    outcome = lippmann("calibrate", "pattern", "stripes", "-d", SHORT, "-o", tmp_path / "pattern.jpg")
    assert outcome.code == 2
    assert "unknown ending '.jpg'" in outcome.err
