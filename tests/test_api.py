"""The library's few calls: what they take, and what became of former keywords."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

import lippmann
from lippmann.display import load_display
from lippmann.errors import UsageError
from lippmann.sequences.frames import render_sequence

QUICK = {"integrator": "direct", "spp": 1}


@pytest.fixture(scope="module")
def small():
    return load_display("seed-lenticular").resized(64, 32)


@pytest.mark.slow
def test_unknown_keywords_are_refused(small):
    for call in (lippmann.render, lippmann.plan, lippmann.render_quilt, lippmann.preview):
        with pytest.raises(UsageError, match="unknown option of a render 'tilt'"):
            call("teapot", tilt=3)
    with pytest.raises(UsageError, match="unknown option of a render 'tilt'"):
        lippmann.render_to_file("teapot", "x.png", tilt=3)


def test_pictures_files_quilts_and_plans_take_the_same_placement():
    for call in (
        lippmann.render,
        lippmann.render_to_file,
        lippmann.render_quilt,
        lippmann.plan,
        render_sequence,
    ):
        assert "placement" in inspect.signature(call).parameters, call


def test_the_command_line_and_python_make_the_same_picture(engine, tmp_path, cut_display):
    from lippmann.cli import run
    from lippmann.image import read_picture

    display = cut_display(48, 16)
    assert run(["render", "teapot", "--display", str(display), "--spp", "2", "-o", str(tmp_path / "a.png")]) == 0
    lippmann.render("teapot", display, spp=2).save(tmp_path / "b.png")
    first, second = (read_picture(tmp_path / name) for name in ("a.png", "b.png"))
    np.testing.assert_array_equal(first.pixels, second.pixels)
    assert first.provenance.options == second.provenance.options
    assert first.provenance.options["tone_map"] == "pbr-neutral"
