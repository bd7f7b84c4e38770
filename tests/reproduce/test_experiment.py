"""The experiment: turns, medians and shares."""

from __future__ import annotations

import dataclasses

import pytest

from lippmann.reproduce import VARIANTS, Experiment, Manner, Variant, run_experiment


class SlowerEveryTime:
    """Takes 1, 2, 3, ... seconds to trace, counted for each way of each scene."""

    def __init__(self, render):
        self.render = render
        self.turns = {}

    def __call__(self, scene, variant):
        turn = self.turns[scene, variant] = self.turns.get((scene, variant), 0) + 1
        image = self.render(scene, variant)
        made = dataclasses.replace(image.provenance, seconds={"trace": float(turn), "reuse": 0.25, "total": 99.0})
        return dataclasses.replace(image, provenance=made)


def test_the_variants_are_full_and_every_method_in_every_manner():
    keys = [variant.key for variant in VARIANTS]
    assert keys[0] == "full"
    assert len(keys) == len(set(keys)) == 7
    paper = Variant("interpolated", Manner.PAPER)
    assert (paper.order, paper.respect_gloss) == ("paper", False)
    respected = Variant("lens-view", Manner.GLOSS)
    assert (respected.order, respected.respect_gloss) == ("default", True)
    assert [Variant("lens-view", Manner.DEFAULT).order, Variant("full").order] == ["default", None]


def test_warm_up_does_not_count_and_the_median_does(fake_renderer, small_display):
    experiment = Experiment(("teapot",), small_display, runs=3, warm_up=2)
    found = run_experiment(experiment, SlowerEveryTime(fake_renderer(small_display)))
    assert found.full("teapot").seconds == 4.25  # of 3, 4 and 5, and the reusing


def test_ways_take_turns(fake_renderer, small_display):
    render = fake_renderer(small_display)
    run_experiment(Experiment(("teapot", "tree"), small_display, runs=1, warm_up=1), render)
    one_scene = [variant.key for variant in VARIANTS] * 2
    assert render.calls == [(scene, key) for scene in ("teapot", "tree") for key in one_scene]


def test_progress_reaches_the_end_and_names_the_work(fake_renderer, small_display):
    seen = []
    run_experiment(Experiment(("teapot",), small_display, runs=1, warm_up=1), fake_renderer(small_display), seen.append)
    assert [report.done for report in seen] == list(range(15))
    assert {report.total for report in seen} == {14}
    assert seen[1].note == "teapot, lens-view, as in the paper"


def test_shares_are_of_full_tracing(results):
    run = results.of("tree", "lens-view-gloss")
    assert run.seconds == pytest.approx(1.1)  # neither loading nor building nor compiling
    assert run.saved_seconds == pytest.approx(0.9)
    assert run.saved_percent == pytest.approx(45)
    assert run.time_share == pytest.approx(0.55)
    assert run.ray_share == pytest.approx(0.3, abs=1e-3)
    assert run.traced_share == 0.3
    assert results.full("tree").saved_percent == 0
    assert results.full("tree").comparison is None


def test_pictures_are_compared_with_full_tracing(results):
    found = results.of("teapot", "interpolated-paper").comparison
    assert found.paper.unchanged == 1  # the micro-image on the left
    assert 29 < found.psnr < 33  # noise of 0.03 on four fifths of the pixels


@pytest.mark.parametrize("parts", [{"scenes": ()}, {"runs": 0}])
def test_an_experiment_has_a_scene_and_a_run(small_display, parts):
    with pytest.raises(ValueError, match="there must be"):
        Experiment(**{"scenes": ("teapot",), "display": small_display, **parts})
