"""When a rendering stops: what it lacks of a goal, with renderers whose error is known and a clock that is told."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from lippmann.api import load_scene
from lippmann.display import Display
from lippmann.display.lens_array import LensArray
from lippmann.display.panel import Panel
from lippmann.progress import Progress
from lippmann.rendering.adaptive.stopping import Goal, make_goal, sample_until
from lippmann.rendering.adaptive.tuning import TUNING
from lippmann.rendering.estimate.denoised_psnr import PictureEstimator
from lippmann.rendering.estimate.psnr import Estimate, PixelErrors
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest

SHOWN = Display("test", Panel(64, 64, 0.25), LensArray("square", 2.0), gap=6.8)


class Noise:
    """A renderer whose squared error is ``error * samples**-slope``; a sample takes ``seconds`` of its own clock.

    The first one compiles for as long as is said.
    """

    def __init__(self, error=0.05, slope=1.0, seconds=0.01, floor=0.0, compiling=0.0):
        self.error, self.slope, self.seconds, self.floor = error, slope, seconds, floor
        self.samples, self.now, self.seconds_trace = 0, compiling, 0.0
        self.counts = []
        self.random = np.random.default_rng(1)

    def add(self, samples, progress=lambda _: None):
        self.samples += samples
        self.now += samples * self.seconds
        self.seconds_trace += samples * self.seconds
        progress(Progress("trace", samples, samples))

    def squared_error(self):
        self.counts.append(self.samples)
        expected = self.error * self.samples**-self.slope + self.floor
        return PixelErrors((expected * self.random.chisquare(1, (64, 64))).astype(np.float32))

    def clock(self):
        return self.now


def run(goal, renderer, reports=None, *, first=16, slope=1.0, **options):
    listen = reports.append if reports is not None else lambda _: None
    options |= {"first": first, "slope": slope, "progress": listen, "clock": renderer.clock}
    return sample_until(goal, renderer, renderer, PictureEstimator(SHOWN), **options)


@pytest.mark.parametrize("slope", [0.8, 1.0, 1.5])
def test_the_quality_is_reached_without_wasting_samples(slope):
    renderer = Noise(slope=slope)
    outcome = run(Goal(quality_worst=40), renderer)
    assert outcome.end == "quality"
    assert outcome.estimate.worst >= 40
    assert outcome.estimate.worst_low >= 40 - TUNING.tolerance
    # The worst of 64 lenses of 64 pixels is about 2 dB worse than all together.
    assert outcome.estimate.worst < 42
    assert len(renderer.counts) <= 9


@pytest.mark.parametrize("first", [2, 3, 16])
def test_the_first_round_is_given_and_later_ones_give_both_streams_as_much(first):
    renderer = Noise(error=0.2)
    run(Goal(quality=40), renderer, first=first)
    assert renderer.counts[0] == first
    assert all(samples % 2 == 0 for samples in renderer.counts[1:])


@pytest.mark.parametrize("slope", [0.6, 1.0])
def test_default_pictures_that_differ_little_take_much_the_same_samples(slope):
    goal = Goal(TUNING.clean, spp=24, is_promise=False)
    taken = []
    for lacking in np.arange(0.0, 4.0, 0.1):
        # With three samples it lacks so many dB of being clean.
        renderer = Noise(error=10 ** ((lacking - TUNING.clean) / 10) * 3**slope, slope=slope)
        run(goal, renderer, first=3, slope=slope)
        taken.append(renderer.samples)
    assert taken[0] == 3
    assert max(taken) > 6
    assert max(after / before for before, after in pairwise(taken)) <= 1.5


def test_no_round_multiplies_the_samples_by_more_than_the_most():
    renderer = Noise(error=0.5)
    run(Goal(quality=50, spp=1000), renderer, first=2)
    assert renderer.counts[:4] == [2, 8, 32, 128]


def test_where_time_is_short_there_are_fewer_samples_than_the_first_round_has():
    renderer = Noise(error=0.2, seconds=1.0)
    run(Goal(quality=40, max_time=4.0), renderer, first=4)
    assert renderer.now <= 4.0
    assert renderer.counts[0] == 3


def test_a_picture_that_converges_slowly_gets_larger_rounds():
    plain, denoised = Noise(), Noise()
    run(Goal(quality=30), plain, first=4)
    run(Goal(quality=30), denoised, first=4, slope=0.4)
    assert denoised.samples >= plain.samples


def test_a_default_picture_ends_with_its_first_round_where_it_is_likely_clean():
    goal = Goal(TUNING.clean, spp=128, is_promise=False)
    clean, noisy = Noise(error=1e-3), Noise(error=2e-2)
    assert (run(goal, clean, first=8).end, clean.samples) == ("quality", 8)
    assert run(goal, noisy, first=8).end == "quality"
    assert 64 < noisy.samples <= 128


def test_the_mean_asks_for_less_than_the_worst():
    worst, mean = Noise(), Noise()
    run(Goal(quality_worst=40), worst)
    outcome = run(Goal(quality=40), mean)
    assert outcome.estimate.psnr >= 40
    assert mean.samples < 0.8 * worst.samples


def test_time_ends_it_with_the_best_so_far():
    renderer = Noise(seconds=0.05)
    outcome = run(Goal(quality_worst=60, max_time=10.0), renderer)
    assert outcome.end == "time"
    assert 8.0 <= renderer.now <= 10.0


@pytest.mark.parametrize("seconds", [0.5, 1.5, 4.0, 9.5, 40.0])
def test_rounds_fit_the_time(seconds):
    """One sample of every pixel is the least that is a picture; it tells how many more there is time for."""
    renderer = Noise(seconds=seconds)
    outcome = run(Goal(max_time=10.0), renderer, first=4)
    assert renderer.now <= max(10.0, seconds)
    assert renderer.samples >= max(1, int(8 / seconds))
    assert outcome.end == "time"
    assert (outcome.estimate is None) == (renderer.samples == 1)


def test_compiling_takes_time_but_tells_nothing_of_a_sample():
    renderer = Noise(seconds=0.1, compiling=5.0)
    run(Goal(max_time=10.0, began=0.0), renderer, first=4)
    assert renderer.now <= 10.0
    assert renderer.samples > 40


def test_time_that_an_assessment_takes_is_left():
    renderer = Noise(seconds=1.0)
    outcome = run(Goal(max_time=10.0), renderer, first=4, assessment=8.5)
    assert (renderer.samples, outcome.estimate) == (1, None)


def test_samples_end_it():
    renderer = Noise()
    outcome = run(Goal(quality_worst=60, spp=100), renderer)
    assert (outcome.end, renderer.samples) == ("samples", 100)


def test_samples_alone_are_spent_in_one_go():
    renderer = Noise()
    assert (run(Goal(spp=37), renderer, first=37).end, renderer.counts) == ("samples", [37])


def test_a_renderer_that_stops_getting_better_is_not_followed_for_ever():
    outcome = run(Goal(quality_worst=50, spp=5000), Noise(floor=1e-3))
    assert outcome.end == "samples"


def test_reports_climb_to_the_end_and_say_where_the_picture_stands():
    reports = []
    run(Goal(quality_worst=40), Noise(), reports)
    done = [report.done for report in reports]
    assert done == sorted(done)
    assert all(report.done <= report.total for report in reports)
    assert "dB, goal 40 dB, about" in reports[-1].note
    assert reports[-1].note.endswith("about 0 s left")


def test_missing_is_by_the_likely_value_and_by_the_low_end():
    wide = Estimate(45, 44, 46, 41.0, 38.0, 43.0, (0, 0))
    assert Goal(quality_worst=40).measure_shortfall(wide) == pytest.approx(1.0)
    narrow = Estimate(45, 44.9, 45.1, 41.0, 40.8, 41.2, (0, 0))
    assert Goal(quality_worst=42).measure_shortfall(narrow) == pytest.approx(1.0)
    assert Goal(quality=44).measure_shortfall(wide) <= 0


def test_a_quality_of_the_whole_asks_for_micro_images_too():
    estimate = Estimate(38.0, 37.0, 39.0, 26.0, 25.0, 27.0, (0, 0))
    assert Goal(quality=35).measure_shortfall(estimate) == pytest.approx(-3)
    # The worst micro-image may have 12 dB less than the whole.
    assert Goal(quality=39).measure_shortfall(estimate) == pytest.approx(1)
    assert Goal(quality=38).measure_shortfall(replace(estimate, worst=25.5)) == pytest.approx(0.5)


def test_a_default_picture_is_to_be_clean_by_the_likely_value():
    request = RenderRequest(method="pooled", denoise="oidn", spp=8)
    assert make_goal(request) == Goal(spp=8)
    with_reserve = resolve(RenderRequest(), load_scene("teapot"), SHOWN)
    goal = make_goal(with_reserve)
    assert goal == Goal(TUNING.clean, spp=with_reserve.spp_reserve, is_promise=False)
    worst = TUNING.clean - TUNING.most_below
    wide = Estimate(TUNING.clean, 20.0, 50.0, worst, 5.0, 40.0, (0, 0))
    assert goal.measure_shortfall(wide) == 0
    # However good the picture is as a whole.
    assert goal.measure_shortfall(replace(wide, psnr=50.0, worst=worst - 2)) == pytest.approx(2)


def test_without_a_quality_nothing_is_missing():
    assert Goal(spp=8).measure_shortfall(Estimate(5.0, 4.0, 6.0, 1.0, 0.0, 2.0, (0, 0))) == -math.inf
