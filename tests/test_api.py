"""The library's few calls: what they take, and what became of former keywords."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

import lippmann
from lippmann.display import load_display
from lippmann.errors import UsageError
from lippmann.sequences.frames import render_sequence


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


def test_a_preview_takes_scene_and_display_in_the_order_of_a_render(small):
    first, second = (list(inspect.signature(call).parameters)[:2] for call in (lippmann.render, lippmann.preview))
    assert first == second == ["scene", "display"]


@pytest.mark.parametrize(
    ("option", "fix"),
    [
        ("turn", r'turn: .* use placement=\{"turn": \.\.\.\}'),
        ("light_strength", r'use load_scene\(\.\.\., light=\{"light_strength": \.\.\.\}\)'),
        ("environment", r"use load_scene\(\.\.\., environment=\.\.\.\)"),
    ],
)
def test_an_option_of_another_call_names_that_call(small, option, fix):
    with pytest.raises(UsageError, match=fix):
        lippmann.render("teapot", small, **{option: 1})
    with pytest.raises(UsageError, match=fix):
        lippmann.render_turntable("teapot", small, **{option: 1})


def test_the_options_that_are_known_are_those_of_people(small):
    with pytest.raises(UsageError, match="known are integrator, ") as caught:
        lippmann.plan("teapot", small, zzz=3)
    assert "judged_by" not in str(caught.value)


@pytest.mark.parametrize(
    ("keywords", "parameter"),
    [
        ({"progress": 3}, "progress"),
        ({"bleed": "a"}, "bleed"),
        ({"correct": "lens", "headroom": "a"}, "headroom"),
    ],
)
def test_values_of_a_wrong_type_are_refused_before_any_work(small, keywords, parameter):
    with pytest.raises(UsageError) as caught:
        lippmann.render("teapot", small, **keywords)
    assert caught.value.parameter == parameter


def test_light_that_is_no_light_is_refused():
    with pytest.raises(UsageError, match="light: 5; a LightOptions"):
        lippmann.load_scene("teapot", light=5)


def test_pictures_files_quilts_and_plans_take_the_same_placement():
    for call in (
        lippmann.render,
        lippmann.render_to_file,
        lippmann.render_quilt,
        lippmann.plan,
        render_sequence,
    ):
        assert "placement" in inspect.signature(call).parameters, call


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "read", "light", "how"),
    [
        ([], {}, {}, {}),
        (["--turn", "20,5", "--exposure", "1"], {}, {}, {"placement": {"turn": (20, 5)}, "exposure": 1.0}),
        (
            ["--light-turn", "40", "--background", "0.1,0.2,0.3", "--method", "full", "--clamp-indirect", "2"],
            {"background": (0.1, 0.2, 0.3)},
            {"light_turn": (40.0, 0.0)},
            {"method": "full", "clamp_indirect": 2.0},
        ),
        (
            ["--single-scattering", "--method", "lens-view", "--order", "paper", "--seed", "3"],
            {"single_scattering": True},
            {},
            {"method": "lens-view", "order": "paper", "seed": 3},
        ),
    ],
)
def test_the_command_line_and_python_make_the_same_picture(engine, tmp_path, cut_display, words, read, light, how):
    from lippmann.cli import run
    from lippmann.image import read_picture

    display = cut_display(48, 16)
    words = ["render", "teapot", "--display", str(display), "--spp", "2", *words, "-o", str(tmp_path / "a.png")]
    assert run(words) == 0
    scene = lippmann.load_scene("teapot", light=light, **read)
    lippmann.render(scene, display, spp=2, **how).save(tmp_path / "b.png")
    first, second = (read_picture(tmp_path / name) for name in ("a.png", "b.png"))
    np.testing.assert_array_equal(first.pixels, second.pixels)
    assert first.provenance.options == second.provenance.options
    assert len(first.provenance.options["settings"]) > len(how)
