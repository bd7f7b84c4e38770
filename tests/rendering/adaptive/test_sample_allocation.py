"""Samples for pixels that are noisy after denoising: how many, which, and what they do for the picture."""

from __future__ import annotations

from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import lippmann
from lippmann.color.transfer import encode_srgb
from lippmann.progress import Progress
from lippmann.rendering.adaptive.sample_allocation import SampleAllocation
from lippmann.rendering.adaptive.tuning import TUNING

SHAPE = (16, 24)


class Recorded:
    """Takes down what is asked of it."""

    def __init__(self, had=0, batches=8, rays=None):
        self.samples = had
        self.batches = batches
        self.rays = np.ones(SHAPE, np.float32) if rays is None else rays
        self.for_all, self.chosen = [], []

    def rays_of_sample(self):
        return self.rays

    def add(self, samples, progress=lambda _: None):
        self.for_all.append(samples)
        self.samples += samples
        progress(Progress("trace", 10, 10))

    def add_at(self, chosen, each, mean, progress=lambda _: None):
        self.chosen.append((chosen, each, mean))
        self.samples += mean
        progress(Progress("trace", 10, 10))


class Noisy:
    def __init__(self, noise, is_current=False):
        self.is_current = is_current
        self._noise = noise
        self.asked = 0

    def noise(self):
        self.asked += 1
        return self._noise


def steep():
    """More noise from left to right."""
    return np.broadcast_to(np.linspace(0, 1, SHAPE[1], dtype=np.float32) ** 8, SHAPE)


@pytest.mark.parametrize(
    ("had", "samples", "for_all", "each"),
    [
        (0, 1, 1, None),
        (0, 3, 3, None),
        (0, 4, 2, 8),
        (0, 8, 4, 16),
        (0, 16, 8, 32),
        (0, 64, 32, 128),
        (0, 19, 8, 48),
        (16, 16, 8, 32),
        (16, 48, 24, 96),
    ],
)
def test_about_half_goes_to_all_pixels(had, samples, for_all, each):
    batches, look = Recorded(had), Noisy(steep())
    reports = []
    SampleAllocation(batches, None, look, 0.0).add(samples, reports.append)
    assert batches.for_all == [for_all]
    assert batches.samples == had + samples
    assert reports[-1].done == pytest.approx(reports[-1].total)
    assert [report.done for report in reports] == sorted(report.done for report in reports)
    if each is None:
        assert not batches.chosen
        return
    ((chosen, given, mean),) = batches.chosen
    assert (given, mean) == (each, samples - for_all)
    assert chosen.mean() == pytest.approx(mean / given, abs=0.05)
    assert np.array_equal(chosen[8], np.arange(SHAPE[1]) >= SHAPE[1] - chosen[8].sum())


def test_a_look_that_is_too_dear_is_left_out():
    batches, look = Recorded(), Noisy(steep())
    SampleAllocation(batches, None, look, TUNING.most_of_look * 8 * 1.01).add(16)
    assert batches.for_all == [8, 8]
    assert not batches.chosen
    assert look.asked == 0
    batches = Recorded()
    SampleAllocation(batches, None, look, TUNING.most_of_look * 8 * 0.99).add(16)
    assert look.asked == 1


def test_a_picture_that_is_clean_already_is_looked_at_first():
    batches, look, clean = Recorded(8), Noisy(None), Noisy(steep(), is_current=True)
    SampleAllocation(batches, clean, look, 0.0).add(24)
    assert (look.asked, clean.asked) == (0, 1)
    assert len(batches.chosen) == 1


def test_noise_that_is_even_gives_all_pixels_the_same():
    noise = np.random.default_rng(1).exponential(size=SHAPE).astype(np.float32)
    for each in (noise, np.ones(SHAPE, np.float32), np.zeros(SHAPE, np.float32)):
        batches = Recorded()
        SampleAllocation(batches, None, Noisy(each), 0.0).add(16)
        assert batches.for_all == [8, 8]
        assert not batches.chosen


def test_dear_pixels_are_chosen_for_more_noise_alone(monkeypatch):
    monkeypatch.setattr("lippmann.rendering.adaptive.sample_allocation.TUNING", replace(TUNING, least_noise=0.0))
    rays = np.ones(SHAPE, np.float32)
    rays[:8] = 10
    batches, noise = Recorded(rays=rays), np.ones(SHAPE, np.float32)
    SampleAllocation(batches, None, Noisy(noise), 0.0).add(16)
    assert batches.chosen[0][0][9:].all()
    noise[:8] = 20
    batches = Recorded(rays=rays)
    SampleAllocation(batches, None, Noisy(noise), 0.0).add(16)
    assert not batches.chosen[0][0][9:].any()


@given(st.integers(0, 2**32 - 1), st.integers(4, 80), st.sampled_from([2, 4, 8]))
def test_chosen_pixels_cost_what_all_would_have(seed, samples, number):
    random = np.random.default_rng(seed)
    rays = random.uniform(1, 9, SHAPE).astype(np.float32)
    batches = Recorded(rays=rays, batches=number)
    every = replace(TUNING, least_noise=0.0)
    with mock.patch("lippmann.rendering.adaptive.sample_allocation.TUNING", every):
        SampleAllocation(batches, None, Noisy(random.exponential(size=SHAPE)), 0.0).add(samples)
    ((chosen, each, mean),) = batches.chosen
    assert each % number == 0
    assert sum(batches.for_all) + mean == samples
    assert each * rays[chosen].sum() == pytest.approx(mean * rays.sum(), rel=0.35)


def coded(image):
    return encode_srgb(np.clip(image.pixels, 0, 1).astype(np.float64))


@pytest.mark.long
@pytest.mark.usefixtures("engine")
def test_a_room_by_as_many_rays(monkeypatch):
    """A picture of a given number of samples is better for it; one that is to reach a quality is made as ever."""
    display = lippmann.load_display("seed-lenticular").resized(128, 96)

    def room(method="pooled", spp=16, seed=1, **options):
        return lippmann.render(
            "room", display, integrator="path", method=method, spp=spp, seed=seed, tone_map="none", **options
        )

    references = [coded(room("full", 128, seed)) for seed in (8, 9)]

    def error(image):
        first, second = (coded(image) - reference for reference in references)
        return float((first * second).mean())

    divided = room()
    samples = divided.maps["samples"]
    assert samples.min() == 8
    assert samples.max() >= 40
    told = divided.provenance.estimate
    monkeypatch.setattr("lippmann.rendering.methods.divides_samples", lambda _: False)
    alike = room()
    assert np.all(alike.maps["samples"] == 16)
    rays = [
        sum(image.provenance.rays[kind] for kind in ("primary", "secondary", "shadow")) for image in (divided, alike)
    ]
    assert rays[0] == pytest.approx(rays[1], rel=0.1)
    assert error(divided) < 0.95 * error(alike)
    assert told["psnr_low"] - 1 < -10 * np.log10(error(divided)) < told["psnr_high"] + 1
    monkeypatch.undo()
    assert np.unique(room(spp=64, quality=30.0).maps["samples"]).size == 1
    assert np.unique(room(spp=3).maps["samples"]).size == 1
