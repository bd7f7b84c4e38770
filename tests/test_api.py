"""The library's few calls: what they take, and what became of former keywords."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

import lippmann
from lippmann.display import load_display
from lippmann.errors import UsageError
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.placement import PlacementOptions
from lippmann.sequences.frames import render_sequence

QUICK = {"integrator": "direct", "spp": 1}


@pytest.fixture(scope="module")
def small():
    return load_display("seed-lenticular").resized(64, 32)


@pytest.mark.slow
@pytest.mark.parametrize(
    "former",
    [
        {"turn": (20.0, 0.0, 0.0)},
        {"shift": (1.0, 0.0, 2.0), "scale": 0.7},
        {"place": "fit", "pop_out": 0.5},
        {"place": "display"},
    ],
)
def test_former_keywords_of_a_placement_warn_and_give_the_same_picture(engine, small, former):
    with pytest.warns(DeprecationWarning, match=r"of render\(\): use placement=PlacementOptions\(") as caught:
        old = lippmann.render("teapot", small, **former, **QUICK)
    assert caught[0].filename == __file__
    options = {{"place": "mode"}.get(name, name): value for name, value in former.items()}
    new = lippmann.render("teapot", small, placement=PlacementOptions(**options), **QUICK)
    np.testing.assert_array_equal(old.pixels, new.pixels)


def test_a_placement_found_before_still_has_its_former_keyword(engine, small):
    image = lippmann.render("teapot", small, placement=PlacementOptions(turn=(20.0, 0.0, 0.0)), **QUICK)
    from lippmann.scene.placement import Placement

    ranges = (tuple(image.provenance.options[name]) for name in ("depth_range", "resolvable_range"))
    placed = Placement(image.world_from_display, *ranges, "camera")
    with pytest.warns(DeprecationWarning, match="placed of render"):
        again = lippmann.render("teapot", small, placed=placed, **QUICK)
    np.testing.assert_array_equal(image.pixels, again.pixels)
    np.testing.assert_array_equal(lippmann.render("teapot", small, placement=placed, **QUICK).pixels, again.pixels)


def test_unknown_keywords_are_refused(small):
    with pytest.raises(TypeError, match="unexpected keyword argument 'tilt'"):
        lippmann.render("teapot", small, tilt=3)
    for call in (lippmann.plan, lippmann.render_quilt, lippmann.preview):
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


def test_the_keywords_of_a_render_are_those_of_a_request():
    """Each with its default, and said in the docstring."""
    request = inspect.signature(RenderRequest).parameters
    parameters = inspect.signature(lippmann.render).parameters
    own = {"scene", "display", "placement", "progress", "former", "bleed"}
    assert set(parameters) - own == set(request) - {"placement", "plan", "began"}
    for name in set(parameters) - own:
        assert parameters[name].default == request[name].default, name
    described = inspect.getdoc(lippmann.render)
    for name in parameters:
        assert name in described.split("Returns")[0], name


def test_the_command_line_and_python_have_the_same_defaults():
    """One call, one picture: each option of a command that a request has, too, says the same where it is left out."""
    from lippmann.cli.commands.plan import plan
    from lippmann.cli.commands.preview import preview
    from lippmann.cli.commands.quilt import render as quilt
    from lippmann.cli.commands.render import render

    request = inspect.signature(RenderRequest).parameters
    for command in (render, preview, plan, quilt):
        options = inspect.signature(command).parameters
        shared = set(options) & set(request)
        assert {"spp", "exposure", "tone_map", "denoise", "seed"} - set(options) <= {"denoise"}
        for name in shared:
            assert options[name].default == request[name].default, (command.__module__, name)


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
