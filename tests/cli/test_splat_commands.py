"""Scans of Gaussian splats on the command line."""

import numpy as np
import pytest
from PIL import Image

from lippmann.image import read_picture

NAMES = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2"]
NAMES += ["rot_0", "rot_1", "rot_2", "rot_3"]


@pytest.fixture
def scan(tmp_path):
    """A red ball of splats above a green one, y pointing down, and a faint white floater a long way off."""
    random = np.random.default_rng(0)
    rows = np.zeros((401, len(NAMES)), "<f4")
    rows[:, :3] = 0.3 * random.normal(size=(401, 3))
    rows[:200, 1] -= 2
    rows[200:400, 1] += 2
    rows[:, 6] = 3
    rows[:, 7:10], rows[:, 10] = np.log(0.1), 1
    rows[:, 3:6] = -1.7
    rows[:200, 3] = rows[200:400, 4] = 1.7
    rows[400] = [50, 0, 0, 2, 2, 2, -3, 2, 2, 2, 1, 0, 0, 0]
    lines = ["ply", "format binary_little_endian 1.0", "element vertex 401", *(f"property float {n}" for n in NAMES)]
    path = tmp_path / "scan.ply"
    path.write_bytes("\n".join([*lines, "end_header", ""]).encode() + rows.tobytes())
    return path


def halves(path):
    """Mean colours of the upper and the lower half of a picture."""
    pixels = np.asarray(Image.open(path).convert("RGB"), float)
    return pixels[: len(pixels) // 2].mean(axis=(0, 1)), pixels[len(pixels) // 2 :].mean(axis=(0, 1))


@pytest.mark.long
def test_the_shortest_command_fills_the_display(lippmann, engine, scan, tmp_path):
    out = tmp_path / "a.png"
    done = lippmann("render", scan, "--display", "seed-lenticular", "-o", out, "--json")
    assert done.code == 0, done.err
    assert done.json["method"] == "full"
    assert done.json["spp"] == 1
    assert "up is taken as -y" in done.err
    up, down = halves(out)
    assert up[0] > 4 * up[1]  # red is above: y points down in the file
    assert down[1] > 4 * down[0]
    lit = np.asarray(Image.open(out).convert("RGB")).max(axis=2) > 60
    rows = np.flatnonzero(lit.any(axis=1))
    assert np.ptp(rows) > 0.8 * 512


@pytest.mark.long
def test_options_choose_splats(lippmann, engine, scan, tmp_path):
    out = tmp_path / "a.png"
    done = lippmann("preview", scan, "--display", "seed-lenticular", "--up", "y", "-o", out)
    assert done.code == 0, done.err
    up, down = halves(out)
    assert up[1] > 4 * up[0]
    assert down[0] > 4 * down[1]
    # Twice as large, and of the two balls the upper one: the box counts in the larger unit.
    words = ["--crop=-9,0,-9,9,9,9", "--unit-scale", 2, "--min-opacity", 0.5]
    done = lippmann("render", scan, *words, "-o", tmp_path / "b.exr")
    assert done.code == 0, done.err
    picture = read_picture(tmp_path / "b.exr")
    assert picture.pixels[..., 0].sum() > 20 * picture.pixels[..., 1].sum()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--crop", "1,2,3"], "--crop"),
        (["--crop", "9,9,9,8,8,8"], "--crop: "),
        (["--unit-scale", "0"], "--unit-scale: 0; must be a factor from "),
        (["--min-opacity", "2"], "--min-opacity: 2; a number from 0 to 1"),
        (["--method", "lens-view"], "--method: lens-view shares the light of surfaces"),
        (["--denoise", "oidn"], "--denoise: oidn goes by the edges of surfaces"),
        (["--layers", "-o", "a.exr"], "--layers: are told of surfaces"),
        (["--memory", "100K"], "memory"),
    ],
)
def test_what_splats_do_not_have_is_refused_in_one_line(lippmann, engine, scan, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    done = lippmann("render", scan, *words)
    assert done.code == 2, done.err
    assert said in done.err
    assert len(done.err.strip().splitlines()) == 1


def test_options_of_splats_are_refused_for_other_scenes(lippmann, tmp_path):
    done = lippmann("render", "teapot", "--min-opacity", "0.5", "-o", tmp_path / "a.png")
    assert done.code == 2
    assert "--min-opacity: 'teapot' holds no Gaussian splats" in done.err


@pytest.mark.long
def test_forecasts_quilts_and_turntables_show_splats(lippmann, engine, scan, tmp_path):
    done = lippmann("plan", scan, "--json")
    assert done.code == 0, done.err
    out = tmp_path / "quilt_qs8x6a0.75.png"
    done = lippmann("quilt", "render", scan, "--display", "portrait", "--size", "384x384", "-o", out)
    assert done.code == 0, done.err
    assert np.asarray(Image.open(out).convert("RGB")).max() > 150
    done = lippmann("render", scan, "--turntable", 2, "-o", tmp_path / "turn")
    assert done.code == 0, done.err
