"""Volumes on the command line."""

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter


@pytest.fixture
def scan(tmp_path):
    """A ball of bone above the middle of softer tissue in air, slice by slice from the front."""
    z, y, x = np.mgrid[-1:1:24j, -1:1:28j, -1:1:26j]
    values = np.full(z.shape, -1000.0)
    values[x * x + y * y + z * z < 0.8] = 40
    values[x * x + (y + 0.4) ** 2 + z * z < 0.1] = 900
    path = tmp_path / "scan.npy"
    np.save(path, np.round(gaussian_filter(values, 0.7)).astype(np.int16))
    return path


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB"), float)


@pytest.mark.slow
def test_a_short_command_shows_the_bone(lippmann, engine, scan, cut_display, tmp_path):
    out = tmp_path / "a.png"
    done = lippmann("render", scan, "--display", cut_display(160, 160), "--spp", 2, "-o", out, "--json")
    assert done.code == 0, done.err
    assert done.json["method"] == "full"
    assert "shown by the transfer function 'ct-bone'" in done.err
    lit = pixels(out).max(axis=2) > 60
    assert np.ptp(np.flatnonzero(lit.any(axis=1))) > 0.75 * 160  # a fitted scene leaves air for parallax


def test_options_change_what_is_seen(lippmann, engine, scan, cut_display, tmp_path):
    out, small = tmp_path / "a.png", cut_display(160, 160)
    done = lippmann(
        *("preview", scan, "--display", small, "--transfer-function", "grey"),
        *("--window=-500,100", "-o", out),
    )
    assert done.code == 0, done.err
    assert "shown by the transfer function 'grey', values -500 to 100" in done.err
    assert "ct-bone" not in done.err
    soft = pixels(out)
    assert soft[80, 80].std() == 0  # grey
    done = lippmann("preview", scan, "--display", small, "--crop=-99,-99,-99,99,-14,99", "-o", out)
    assert done.code == 0, done.err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--window", "3"], "--window: '3'; must be 2 numbers"),
        (["--transfer-function", "bone"], "unknown preset 'bone', did you mean"),
        (["--series", "2"], "has no series to choose from"),
        (["--denoise", "oidn"], "this scene has a volume, and light that lies on none"),
        (["--method", "lens-view"], "lens-view shares the light of surfaces"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(lippmann, scan, tmp_path, options, said):
    done = lippmann("render", scan, "-o", tmp_path / "a.png", *options)
    assert done.code == 2
    assert said in done.err
    assert len(done.err.strip().splitlines()) == 1
