"""Plain against denoised: who wins, with pictures whose errors are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lippmann.display import Display
from lippmann.display.lens_array import LensArray
from lippmann.display.panel import Panel
from lippmann.progress import silent
from lippmann.rendering.adaptive.convergence import Assessment, ErrorTrack
from lippmann.rendering.adaptive.method_race import ASKED_AGAIN, MethodRace
from lippmann.rendering.adaptive.stopping import Goal, reach
from lippmann.rendering.estimate.pixel_errors import CROSS_NOISE, OWN_NOISE, PixelErrors
from lippmann.rendering.estimate.psnr import NO_MARGIN, Estimate, PictureEstimator

SHOWN = Display("test", Panel(64, 64, 0.25), LensArray("square", 2.0), gap=6.8)
RAYS = 3.0


class Samples:
    """Samples of a scene in which a sample takes ``RAYS`` rays and ``seconds``."""

    def __init__(self, seconds=0.01):
        self.taken, self.seconds, self.now = 0, seconds, 0.0

    def add(self, samples, progress=silent):
        self.taken += samples
        self.now += samples * self.seconds


class Picture:
    """Its squared error is ``error * samples**-slope + floor``; it counts how often it was looked at."""

    def __init__(self, samples, error, slope=1.0, floor=0.0, noise=OWN_NOISE, shaken_to=0):
        self.samples, self.error, self.slope, self.floor, self.noise = samples, error, slope, floor, noise
        self.shaken_to = shaken_to
        self.looks = 0
        self.random = np.random.default_rng(1)

    def squared_error(self):
        self.looks += 1
        expected = self.error * self.samples.taken**-self.slope + self.floor
        expected *= 1000 if self.samples.taken < self.shaken_to else 1
        return PixelErrors((expected * self.random.chisquare(1, (64, 64))).astype(np.float32), None, self.noise)


class Sooner(PictureEstimator):
    first = fewest = 8


def run(
    goal,
    *,
    plain=0.5,
    denoised=0.005,
    slope=0.6,
    floor=0.0,
    seconds=0.01,
    rays=RAYS,
    floor_of_plain=0.0,
    shaken_to=0,
):
    """The race, its outcome and the denoised picture."""
    samples = Samples(seconds)
    noisy = Picture(samples, plain, floor=floor_of_plain)
    clean = Picture(samples, denoised, slope, floor, CROSS_NOISE, shaken_to)
    race = MethodRace(
        goal,
        ErrorTrack(noisy, PictureEstimator(SHOWN)),
        ErrorTrack(clean, Sooner(SHOWN), 0.6),
        lambda: rays * samples.taken,
    )
    outcome = reach(goal, samples.add, race, clock=lambda: samples.now, probe=lambda: seconds)
    return race, outcome, clean


def test_denoising_wins_where_noise_is_strong():
    race, outcome, _ = run(Goal(quality_worst=25))
    assert (race.leader, outcome.end) == ("pooled", "quality")
    assert outcome.samples < 100  # plain samples would have taken 300
    assert "pooled and" in race.reason


def test_pooled_light_is_believed_sooner():
    race, outcome, _ = run(Goal(quality=25), plain=0.5, denoised=1e-3)
    assert (race.leader, outcome.end, outcome.samples) == ("pooled", "quality", Sooner.fewest)


def test_plain_samples_are_not_believed_as_soon_as_pooled_light():
    """They are there with 8; what 16 cost is set against pooling."""
    race, outcome, clean = run(Goal(quality=25), plain=0.02, denoised=1e-3, rays=0.5)
    assert (race.leader, outcome.end, outcome.samples) == ("plain", "quality", PictureEstimator.fewest)
    assert clean.looks == 0
    is_expensive, outcome, _ = run(Goal(quality=25), plain=0.02, denoised=1e-3, rays=30.0)
    assert (is_expensive.leader, outcome.samples) == ("pooled", Sooner.fewest)


def test_a_few_plain_samples_end_it_where_they_are_far_better():
    """Nobody looks at pooled light, whatever samples take."""
    for rays in (0.5, 300.0):
        race, outcome, clean = run(Goal(quality=25), plain=1e-3, denoised=1e-3, rays=rays)
        assert (race.leader, outcome.end, outcome.samples) == ("plain", "quality", PictureEstimator.first)
        assert clean.looks == 0


def test_plain_samples_win_where_the_quality_is_near():
    race, outcome, clean = run(Goal(quality=24.8), plain=0.05, rays=1.0)
    assert (race.leader, outcome.end) == ("plain", "quality")
    assert clean.looks == 0
    assert "less than pooling takes" in race.reason


@pytest.mark.parametrize(
    ("plain", "most_gained", "looked_at"),
    [(0.02, 12.5, 2), (0.5, 12.5, 8), (0.05, 12.5, 8), (0.05, 15.0, 2), (0.5, 15.0, 8)],
)
def test_very_few_samples_are_pooled_where_that_may_be_enough(plain, most_gained, looked_at):
    samples, seen = Samples(), []
    clean = Picture(samples, 1e-5, noise=CROSS_NOISE)
    look = clean.squared_error

    class FromTwo(PictureEstimator):
        first = fewest = 2

    class FromEight(PictureEstimator):
        first = 8

    def squared_error():
        seen.append(samples.taken)
        return look()

    clean.squared_error = squared_error
    race = MethodRace(
        Goal(quality=30),
        ErrorTrack(Picture(samples, plain), FromEight(SHOWN)),
        ErrorTrack(clean, FromTwo(SHOWN), 0.6),
        lambda: RAYS * samples.taken,
        most_gained,
    )
    outcome = reach(Goal(quality=30), samples.add, race, clock=lambda: samples.now)
    assert seen == [looked_at]
    assert (race.leader, outcome.samples) == ("pooled", looked_at)


def test_a_denoised_picture_that_stays_wrong_is_left():
    """It is better at first, but its bias keeps it from the goal."""
    race, outcome, clean = run(Goal(quality_worst=33), plain=0.2, denoised=0.005, floor=1e-3)
    assert (race.leader, outcome.end) == ("plain", "quality")
    assert clean.looks < len(outcome.rounds)
    assert "which reaches the goal sooner" in race.reason


def test_a_denoised_picture_that_is_worse_is_seldom_looked_at():
    race, outcome, clean = run(Goal(quality_worst=40), plain=0.2, denoised=0.5)
    assert race.leader == "plain"
    assert 1 < clean.looks <= 1 + math.log(outcome.samples / 8, ASKED_AGAIN)
    assert clean.looks < len(outcome.rounds)
    timed, _, clean = run(Goal(quality_worst=40, max_time=1000.0), plain=0.2, denoised=0.5)
    assert timed.leader == "plain"
    assert clean.looks <= 1 + math.log(1000, ASKED_AGAIN)


def test_when_no_more_samples_may_be_taken_the_denoised_picture_is_looked_at_again():
    """It lost at first; plain samples did not get there."""
    race, outcome, clean = run(Goal(quality_worst=30, spp=24), plain=0.05, floor_of_plain=4e-3, shaken_to=12)
    assert (race.leader, outcome.end, outcome.samples, clean.looks) == ("pooled", "quality", 24, 2)


def test_a_denoised_picture_gets_another_chance_where_plain_samples_do_not_keep_their_promise():
    """So it is where the first single hits of strong light shake both, and plain noise then never falls."""
    race, outcome, clean = run(Goal(quality_worst=30, spp=4096), plain=0.05, floor_of_plain=2e-3, shaken_to=24)
    assert (race.leader, outcome.end) == ("pooled", "quality")
    assert clean.looks > 1


@pytest.mark.parametrize(("seconds", "leader"), [(0.5, "pooled"), (0.0005, "plain")])
def test_with_a_time_the_better_picture_at_its_end_wins(seconds, leader):
    """Few samples are better denoised; many are better left alone, for denoising then does more harm than good."""
    race, outcome, _ = run(Goal(max_time=20.0), floor=2e-3, slope=0.9, seconds=seconds)
    assert (race.leader, outcome.end) == (leader, "time")


class Told:
    """Says of a picture of 16 samples what it is told to say; later ones are good."""

    first = fewest = 8

    def __init__(self, likely, surely, slope):
        self.likely, self.surely, self.slope = likely, surely, slope

    def margin(self, samples):
        return NO_MARGIN

    def assess(self, samples):
        more = 0.0 if samples <= 16 else 10.0
        values = (self.likely + more, self.surely + more, 60.0)
        errors = PixelErrors(np.zeros((1, 1), np.float32), None, OWN_NOISE)
        return Assessment(errors, Estimate(*values, *values, (0, 0)), self.slope)


@pytest.mark.parametrize(
    ("plain", "pooled", "leader"),
    [
        # Plain samples are further from sure.
        ((32.8, 30.9, 0.8), (37.0, 33.5, 0.3), "pooled"),
        # The pooled picture is likely there, but far from sure.
        ((33.0, 32.5, 1.0), (35.2, 30.0, 0.6), "plain"),
        # Neither is likely there: plain noise falls faster.
        ((32.8, 30.9, 1.0), (33.5, 32.0, 0.3), "plain"),
        # Intervals get narrower faster than pictures better: not more than three times the samples are reckoned.
        ((29.9, 28.8, 1.0), (36.0, 30.0, 0.3), "pooled"),
    ],
)
def test_what_is_likely_there_is_to_be_sure_too(plain, pooled, leader):
    race = MethodRace(Goal(quality=35), Told(*plain), Told(*pooled), lambda: 800.0)
    race.assess(16, 64.0)
    assert race.leader == leader


def test_samples_bound_both():
    race, outcome, _ = run(Goal(quality_worst=60, spp=32))
    assert (outcome.end, outcome.samples, race.leader) == ("samples", 32, "pooled")


def test_the_same_samples_give_the_same_winner_whatever_they_take():
    slow, fast = (run(Goal(quality_worst=30), seconds=seconds)[1].samples for seconds in (1.0, 1e-6))
    assert slow == fast
