"""When a rendering stops, with renderers whose error is known and a clock that is told."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display import Display
from lippmann.display.lens_array import LensArray
from lippmann.display.panel import Panel
from lippmann.progress import Progress
from lippmann.rendering.adaptive.goal import Goal
from lippmann.rendering.adaptive.stopping import Costs, reach
from lippmann.rendering.adaptive.tuning import TUNING
from lippmann.rendering.estimate.pixel_errors import OWN_NOISE, PixelErrors
from lippmann.rendering.estimate.psnr import PictureEstimator

SHOWN = Display("test", Panel(64, 64, 0.25), LensArray("square", 2.0), gap=6.8)


class Noise:
    """A renderer whose squared error is ``error * samples**-slope``; a sample takes ``seconds`` of its own clock.

    A probe says that it takes ``probed``.
    """

    def __init__(self, error=0.05, slope=1.0, seconds=0.01, floor=0.0, probed=None):
        self.error, self.slope, self.seconds, self.floor = error, slope, seconds, floor
        self.probed = seconds if probed is None else probed
        self.samples, self.now = 0, 0.0
        self.random = np.random.default_rng(1)

    def add(self, samples, progress=lambda _: None):
        self.samples += samples
        self.now += samples * self.seconds
        progress(Progress("trace", samples, samples))

    def squared_error(self):
        expected = self.error * self.samples**-self.slope + self.floor
        return PixelErrors((expected * self.random.chisquare(1, (64, 64))).astype(np.float32), None, OWN_NOISE)

    def probe(self):
        return self.probed

    def clock(self):
        return self.now


def run(goal, renderer, reports=None, *, estimator=PictureEstimator, costs=None):
    listen = reports.append if reports is not None else lambda _: None
    told = estimator(SHOWN)
    return reach(goal, renderer, renderer, told, costs or Costs(told.first), listen, renderer.clock)


@pytest.mark.parametrize("slope", [0.8, 1.0, 1.5])
def test_the_quality_is_reached_without_wasting_samples(slope):
    renderer = Noise(slope=slope)
    outcome = run(Goal(quality_worst=40), renderer)
    assert outcome.end == "quality"
    assert outcome.estimate.worst >= 40
    assert outcome.estimate.worst_low >= 40 - TUNING.tolerance
    # The worst of 64 lenses of 64 pixels is about 2 dB worse than all together.
    assert outcome.estimate.worst < 42
    assert len(outcome.rounds) <= 9
    assert outcome.samples == renderer.samples


@pytest.mark.parametrize("first", [2, 4])
def test_the_first_look_is_where_the_costs_say_and_later_rounds_are_multiples_of_the_batches(first):
    outcome = run(Goal(quality=40), Noise(error=0.2), costs=Costs(first))
    counts = [each.samples for each in outcome.rounds]
    assert counts[0] == first
    assert all(samples % TUNING.step == 0 for samples in counts[1:])


def test_what_very_few_samples_say_multiplies_them_no_more_than_other_rounds():
    outcome = run(Goal(quality=30, spp=1000), Noise(error=0.5), costs=Costs(2))
    assert [each.samples for each in outcome.rounds][:3] == [2, 8, 16]


def test_where_time_is_short_there_are_fewer_samples_than_a_first_look_has():
    renderer = Noise(error=0.2, seconds=1.0)
    outcome = run(Goal(quality=40, max_time=4.0), renderer, costs=Costs(4))
    assert renderer.now <= 4.0
    assert outcome.rounds[0].samples == 3


def test_a_picture_that_converges_slowly_gets_larger_rounds():
    """The expected power of the samples counts until rounds have shown the true one."""
    plain, denoised = (run(Goal(quality=30), Noise(), costs=Costs(4, slope)).rounds for slope in (1.0, 0.4))
    assert denoised[-1].samples >= plain[-1].samples


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


@pytest.mark.parametrize(("seconds", "samples"), [(0.5, 19), (1.5, 6), (4.0, 2), (9.5, 1), (40.0, 1)])
def test_the_first_round_fits_the_time(seconds, samples):
    """A probe tells how many samples there is time for; one of every pixel is the least that is a picture."""
    renderer = Noise(seconds=seconds)
    outcome = run(Goal(max_time=10.0), renderer)
    assert renderer.now <= max(10.0, seconds)
    assert (outcome.end, outcome.samples) == ("time", samples)
    assert (outcome.estimate is None) == (outcome.samples == 1)


def test_a_probe_that_promised_too_much_is_not_believed_twice():
    renderer = Noise(seconds=1.0, probed=1.2)
    assert (run(Goal(max_time=10.0), renderer).samples, renderer.now <= 10.0) == (9, True)
    slow = Noise(seconds=30.0, probed=25.0)
    outcome = run(Goal(max_time=40.0), slow)
    assert (outcome.samples, outcome.estimate) == (1, None)


def test_without_a_limit_of_time_nothing_is_probed(monkeypatch):
    def never(_):
        raise AssertionError("no probe is due")

    monkeypatch.setattr(Noise, "probe", never)
    assert run(Goal(spp=8), Noise()).samples == 8


def test_samples_end_it():
    renderer = Noise()
    outcome = run(Goal(quality_worst=60, spp=100), renderer)
    assert (outcome.end, outcome.samples) == ("samples", 100)


def test_samples_alone_are_spent_in_one_go():
    outcome = run(Goal(spp=37), Noise())
    assert (outcome.end, outcome.samples, len(outcome.rounds)) == ("samples", 37, 1)


def test_a_renderer_that_stops_getting_better_is_not_followed_for_ever():
    outcome = run(Goal(quality_worst=50, spp=5000), Noise(floor=1e-3))
    assert outcome.end == "samples"


@pytest.mark.parametrize(("seems", "samples"), [(30.5, 16), (33.0, 16), (35.5, 8), (37.0, 8), (38.5, 4), (90.0, 4)])
def test_a_few_samples_are_believed_where_they_are_far_better_than_what_is_asked_for(seems, samples):
    class Still(Noise):
        """It does not get better."""

        def squared_error(self):
            return PixelErrors(np.full((64, 64), 10 ** (-seems / 10), np.float32), None, OWN_NOISE)

    outcome = run(Goal(quality=30), Still())
    assert (outcome.end, outcome.samples) == ("quality", samples)
    assert len(outcome.rounds) <= 3


def test_no_look_is_lost_on_a_picture_that_will_not_be_believed():
    outcome = run(Goal(quality=30, spp=1000), Noise(error=0.5))
    assert [each.samples for each in outcome.rounds][:2] == [4, PictureEstimator.fewest]


def test_reports_climb_to_the_end_and_say_where_the_picture_stands():
    reports = []
    run(Goal(quality_worst=40), Noise(), reports)
    done = [report.done for report in reports]
    assert done == sorted(done)
    assert all(report.done <= report.total for report in reports)
    assert "of 40 dB, about" in reports[-1].note
    assert reports[-1].note.endswith("s left")
