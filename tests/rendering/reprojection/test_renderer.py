"""Whole pictures by reuse, against the full renderer, micro-image by micro-image."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.errors import MemoryLimitError

pytestmark = pytest.mark.usefixtures("engine")


class Case:
    """A bundled scene on a small panel, with all that a renderer needs."""

    def __init__(self, name, width=128, height=128, preset="seed-lenticular"):
        from lippmann.device.whitted.scene import build_classic
        from lippmann.display import load_display
        from lippmann.rendering.transport.ray_source import DisplayRays
        from lippmann.rendering.transport.whitted import WhittedIntegrator
        from lippmann.scene import bundled

        self.display = load_display(preset).resized(width, height)
        world = bundled.stage_of(name).world_from_display.copy()
        world[:3, :3] *= 512 / height
        self.display_from_world = np.linalg.inv(world)
        self.integrator = WhittedIntegrator(build_classic(bundled.make_classic(name)), 2)
        self.source = DisplayRays(self.display, world)
        self._full = {}

    def full(self, samples=1):
        """Frame of the full renderer, traced once."""
        if samples not in self._full:
            self._full[samples] = self._trace_full(samples)
        return self._full[samples]

    def _trace_full(self, samples):
        from lippmann.rendering.film.memory_model import cut_wavefronts
        from lippmann.rendering.film.sample_batches import BatchedRender
        from lippmann.rendering.film.wavefront import Frame, trace_frame

        if samples > 1:
            batches = BatchedRender(self.integrator, self.source, memory=1 << 30)
            batches.add(samples)
            return Frame(batches.picture())
        plan = cut_wavefronts(self.source.width, self.source.height, samples, memory=1 << 30)
        return trace_frame(self.integrator, self.source, plan, box_filter=False)

    def reused(self, method="lens-view", careful=True, samples=1, **others):
        from lippmann.rendering.reprojection.renderer import trace_reused

        options = {"order": "default", "memory": 1 << 30, "threads": 2, **others}
        return trace_reused(
            self.integrator,
            self.source,
            method=method,
            careful=careful,
            samples=samples,
            seed=0,
            box_filter=samples > 1,
            transfer="linear",
            display_from_world=self.display_from_world,
            **options,
        )


@pytest.fixture(scope="module")
def case(engine):
    """Cases by name, made once."""
    made = {}

    def get(name, *arguments):
        key = (name, *arguments)
        if key not in made:
            made[key] = Case(*key)
        return made[key]

    return get


def psnr_of_lenses(frame, full):
    """PSNR of each micro-image of 8 columns, in dB."""
    squares = np.square(np.clip(frame.pixels, 0, 1) - np.clip(full.pixels, 0, 1))
    height, width = squares.shape[:2]
    means = squares.reshape(height, width // 8, 8, 3).mean(axis=(0, 2, 3))
    return -10 * np.log10(means + 1e-12), -10 * np.log10(means.mean() + 1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["teapot", "tree", "small-balls"])
@pytest.mark.parametrize("method", ["lens-view", "interpolated"])
def test_with_care_every_micro_image_is_right(case, name, method):
    chosen = case(name, 256, 256)
    frame, full = chosen.reused(method), chosen.full()
    lenses, mean = psnr_of_lenses(frame, full)
    assert mean >= 37.67
    assert lenses.min() >= 34
    assert frame.shares["traced"] < 0.75


@pytest.mark.long_cases("gears-lens-view-mla-square", "gears-lens-view-mla-hexagonal")
@pytest.mark.slow
@pytest.mark.parametrize("preset", ["mla-square", "mla-hexagonal"])
@pytest.mark.parametrize(("name", "method"), [("tree", "lens-view"), ("tree", "interpolated"), ("gears", "lens-view")])
def test_with_care_every_micro_image_of_an_array_is_right(case, name, method, preset):
    from lippmann.display.lens_field import LensField

    chosen = case(name, 255, 260, preset)
    frame, full = chosen.reused(method), chosen.full()
    squares = np.square(np.clip(frame.pixels, 0, 1) - np.clip(full.pixels, 0, 1)).mean(axis=-1)
    lens = LensField.of(chosen.display).lens.ravel()
    means = np.bincount(lens, squares.ravel()) / np.maximum(1, np.bincount(lens))
    assert means.max() <= 10**-3.4
    assert frame.shares["traced"] < 0.9


@pytest.mark.long_cases("interpolated-small-balls")
@pytest.mark.parametrize("name", ["teapot", "small-balls"])
@pytest.mark.parametrize("method", ["lens-view", "interpolated"])
def test_without_care_few_pixels_are_traced(case, name, method):
    chosen = case(name, 256, 256)
    frame, full = chosen.reused(method, careful=False), chosen.full()
    lenses, mean = psnr_of_lenses(frame, full)
    assert mean >= 21
    assert lenses.min() >= 16
    assert 0.05 < frame.shares["traced"] <= 0.25


@pytest.mark.long_cases(but=["False-1-lens-view", "False-3-interpolated"])
@pytest.mark.slow
@pytest.mark.parametrize("method", ["lens-view", "interpolated"])
@pytest.mark.parametrize(("careful", "samples"), [(True, 1), (False, 1), (False, 3)])
def test_traced_pixels_equal_the_full_renderer_s(case, method, careful, samples):
    from lippmann.rendering.reprojection.point_image import TRACED

    chosen = case("primitives")
    frame, full = chosen.reused(method, careful, samples), chosen.full(samples)
    traced = frame.maps["status"] == TRACED
    if samples == 1:
        assert np.array_equal(frame.pixels[traced], full.pixels[traced])
    else:
        assert np.allclose(frame.pixels[traced], full.pixels[traced], rtol=1e-5, atol=1e-6)
    assert not np.array_equal(frame.pixels, full.pixels)


def test_what_a_frame_tells(case):
    reports = []
    frame = case("teapot").reused("interpolated", careful=False, progress=reports.append)
    status = frame.maps["status"]
    assert status.dtype == np.int8
    assert status.shape == frame.pixels.shape[:2]
    for name, value in (("traced", 0), ("reprojected", 1), ("interpolated", 2)):
        assert frame.shares[name] == pytest.approx(np.mean(status == value))
        assert frame.shares[name] > 0
    assert sum(frame.shares.values()) == pytest.approx(1)
    assert frame.rays.primary == np.count_nonzero(status == 0)
    assert frame.rays.shadow > 0
    assert min(frame.seconds_compile, frame.seconds_reuse) >= 0
    assert frame.seconds_trace > 0
    assert {report.stage for report in reports} == {"trace"}
    assert [r.done / r.total for r in reports] == sorted(r.done / r.total for r in reports)
    assert reports[-1].done == reports[-1].total


@pytest.mark.slow
@pytest.mark.parametrize("careful", [True, False])
def test_threads_do_not_matter(case, careful):
    made = [case("room").reused(careful=careful, threads=threads) for threads in (1, 3)]
    assert np.array_equal(made[0].pixels, made[1].pixels)
    assert np.array_equal(made[0].maps["status"], made[1].maps["status"])


def test_small_wavefronts_make_the_same_picture(case):
    """So little memory that lists of pixels are traced in parts."""
    from lippmann.rendering.reprojection.renderer import wavefront_lanes

    wide, narrow = 1 << 30, 2_600_000
    assert wavefront_lanes(narrow, 128, 128, 8) // 8 < 0.2 * 128 * 128
    one, other = case("teapot").reused(memory=wide, samples=8), case("teapot").reused(memory=narrow, samples=8)
    assert np.allclose(one.pixels, other.pixels, atol=1e-6)


def test_too_little_memory_says_how_much_it_takes(case):
    with pytest.raises(
        MemoryLimitError, match=r"memory: 512 KiB are too small for 128x128 pixels and .*; it needs \d+ KiB"
    ):
        case("teapot").reused(memory=1 << 19)


def test_lanes_follow_the_memory():
    from lippmann.rendering.film.memory_model import preferred_lanes
    from lippmann.rendering.reprojection.renderer import wavefront_lanes

    assert wavefront_lanes(8 << 30, 512, 512, 1) == preferred_lanes()
    assert wavefront_lanes(64 << 20, 512, 512, 1) < preferred_lanes()
    # A pixel's samples are traced together.
    assert wavefront_lanes(8 << 30, 512, 512, 1 << 22) == 1 << 22
    with pytest.raises(MemoryLimitError):
        wavefront_lanes(64 << 20, 512, 512, 1 << 22)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["lens-view", "interpolated"])
@pytest.mark.parametrize("order", ["default", "paper"])
def test_orders_are_different_ways_to_like_pictures(case, method, order):
    frame, full = case("primitives").reused(method, careful=False, order=order), case("primitives").full()
    assert np.all(frame.maps["status"] >= 0)
    assert 0 < frame.shares["traced"] < 1
    assert psnr_of_lenses(frame, full)[1] > 15
