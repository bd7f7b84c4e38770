"""``lippmann render --correct lens``."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann import render
from lippmann.image import read_picture

PRINT = "print:lpi=60,ppi=720,size=2x1mm,thickness=26mil,radius=0.2877mm"


@pytest.mark.slow
def test_the_command_makes_the_picture_of_the_call_and_tells_what_it_gains(lippmann, engine, tmp_path):
    out = tmp_path / "a.exr"
    words = ("--integrator", "direct", "--method", "full", "--denoise", "none", "--spp", 4, "--tone-map", "none")
    done = lippmann("render", "teapot", "-d", PRINT, "--correct", "lens", *words, "--bits", 32, "-o", out)
    assert done.code == 0, done.err
    assert "corrected for its lens" in done.err
    expected = render(
        "teapot", PRINT, correct="lens", integrator="direct", method="full", denoise="none", spp=4, tone_map="none"
    )
    np.testing.assert_array_equal(read_picture(out).pixels, expected.pixels)
    assert (
        read_picture(out).provenance.options["correction_gain_exact"]
        == expected.provenance.options["correction_gain_exact"]
    )


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (("--resume", "-o", "a.tif"), "given beside tiles"),
        (("--maps", "maps", "-o", "a.png"), "given beside --maps"),
        (("--turntable", 3, "-o", "a"), "given beside frames"),
    ],
)
def test_it_is_refused_where_a_picture_is_not_in_one_piece(lippmann, tmp_path, monkeypatch, words, what):
    monkeypatch.chdir(tmp_path)
    done = lippmann("render", "teapot", "-d", PRINT, "--correct", "lens", *words)
    assert done.code == 2
    assert f"--correct: {what}" in done.err
