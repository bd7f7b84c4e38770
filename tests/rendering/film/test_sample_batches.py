"""Full rendering in batches: the same picture however it is cut, and an error that a long render confirms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann.display import Display
from lippmann.display.lens_array import LensArray
from lippmann.display.panel import Panel
from lippmann.errors import MemoryLimitError, UsageError

pytestmark = pytest.mark.usefixtures("engine")

SIZE = 32
SHOWN = Display("test", Panel(SIZE, SIZE, 0.25), LensArray("square", 2.0), gap=6.8, aperture_distance=10.0)


@pytest.fixture(scope="module")
def integrator(engine):
    """A ball in a corner, under an area light and a little sky."""
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.transport.path import PathIntegrator

    def grey(value):
        return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": value}}}

    pose = mi.ScalarTransform4f
    scene = mi.load_dict(
        {
            "type": "scene",
            "floor": {
                "type": "rectangle",
                "to_world": pose().translate([0, -4, 0]).rotate([1, 0, 0], -90).scale(9),
                "bsdf": grey(0.7),
            },
            "back": {"type": "rectangle", "to_world": pose().translate([0, 0, -6]).scale(12), "bsdf": grey(0.5)},
            "ball": {"type": "sphere", "center": [1, -2, -1], "radius": 2, "bsdf": {"type": "roughconductor"}},
            "lamp": {
                "type": "rectangle",
                "to_world": pose().translate([0, 8, 0]).rotate([1, 0, 0], 90).scale(2),
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 12}},
            },
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 0.1}},
        }
    )
    return PathIntegrator(scene, make_scene_features(scene, has_null=False), 5)


def rays(subpixels=False):
    from lippmann.rendering.transport.ray_source import DisplayRays

    return DisplayRays(SHOWN, np.eye(4), subpixels)


def batches(integrator, *, seed=1, memory=2**30, subpixels=False, **options):
    from lippmann.rendering.film.sample_batches import BatchedRender

    return BatchedRender(integrator, rays(subpixels), seed=seed, memory=memory, **options)


#: Enough for all batches and small wavefronts.
TIGHT = SIZE * SIZE * (8 * 12 + 36) + (1 << 14) * 96


@pytest.mark.long
def test_the_picture_is_the_same_however_it_is_cut(integrator):
    whole, cut = batches(integrator), batches(integrator, memory=TIGHT)
    whole.add(37)
    cut.add(37)
    assert np.array_equal(whole.picture(), cut.picture())
    assert whole.samples == cut.samples == 37


@pytest.mark.slow
def test_bands_of_rows_are_the_picture_in_one_piece(integrator):
    from lippmann.rendering.film.sample_batches import trace_in_batches

    whole = batches(integrator)
    whole.add(16)
    expected = whole.squared_error()
    reports = []
    for memory in (2**30, SIZE * SIZE * 32 + 2 * (1 << 13) * 96):
        frame, found = trace_in_batches(
            lambda memory, window: batches(integrator, memory=memory, window=window),
            (SIZE, SIZE),
            16,
            memory,
            reports.append,
        )
        assert np.array_equal(frame.pixels, whole.picture())
        assert np.allclose(found.values, expected.values, atol=1e-7)
        assert frame.rays.primary == whole.rays.primary == SIZE * SIZE * 16
        assert reports[-1].done == pytest.approx(reports[-1].total)
    assert len(reports) > 2


class SampleNumbers:
    """Gives each sample's number in its stream, the square of that, and what tells the streams apart, as a colour."""

    def sample(self, ray, stream, active):
        import mitsuba as mi

        from lippmann.rendering.transport.integrator import RayCounts

        number, none = mi.Float(stream.index), mi.UInt32(stream.index) * 0
        return mi.Color3f(number, number * number, mi.Float(stream.key >> 8) * 2.0**-24), RayCounts(none, none)


@pytest.mark.parametrize(
    ("rounds", "shares"),
    [((16,), (8, 8)), ((8, 8), (8, 8)), ((2, 3, 4, 7), (8, 8)), ((13, 2), (8, 7)), ((1, 1), (1, 1))],
)
@pytest.mark.parametrize("memory", [2**30, TIGHT])
def test_every_sample_of_both_streams_is_taken_once(engine, rounds, shares, memory):
    renderer = batches(SampleNumbers(), memory=memory)
    for samples in rounds:
        renderer.add(samples)
    found = renderer.picture()
    numbers = np.concatenate([np.arange(share) for share in shares])
    assert np.allclose(found[..., 0], numbers.mean())
    assert np.allclose(found[..., 1], np.square(numbers).mean())
    # Keys are as even as numbers drawn at random, two to a pixel.
    assert found[..., 2].var() == pytest.approx(1 / 24, rel=0.2)


@pytest.mark.long
@pytest.mark.parametrize("subpixels", [False, True])
def test_the_mean_is_that_of_full_and_the_error_what_it_says(integrator, subpixels):
    from lippmann.color.transfer import encode_srgb
    from lippmann.rendering.estimate.denoised_psnr import PictureEstimator
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import trace_frame

    plan = cut_wavefronts(SIZE, SIZE, 768, channels=3 if subpixels else 1, memory=2**30)
    reference = encode_srgb(trace_frame(integrator, rays(subpixels), plan, seed=77).pixels)
    estimator = PictureEstimator(SHOWN)
    renderer = batches(integrator, subpixels=subpixels)
    for samples in (8, 8, 48):
        renderer.add(samples)
        errors = np.square(encode_srgb(renderer.picture()) - reference)
        found = estimator.estimate(renderer.squared_error(), 64)
        assert found.psnr_low <= -10 * np.log10(errors.mean()) <= found.psnr_high
    worst = errors.mean(axis=2).reshape(4, 8, 4, 8).mean(axis=(1, 3)).max()
    assert found.worst_low <= -10 * np.log10(worst) <= found.worst_high


@pytest.mark.slow
def test_a_quality_that_is_asked_for_is_kept(integrator):
    from lippmann.color.transfer import encode_srgb
    from lippmann.rendering.adaptive.stopping import Goal, sample_until
    from lippmann.rendering.estimate.denoised_psnr import PictureEstimator

    renderer = batches(integrator, seed=5)
    outcome = sample_until(Goal(quality_worst=30), renderer, renderer, PictureEstimator(SHOWN), first=16)
    long = batches(integrator, seed=6)
    long.add(768)
    errors = np.square(encode_srgb(renderer.picture()) - encode_srgb(long.picture())).mean(axis=2)
    worst = -10 * np.log10(errors.reshape(4, 8, 4, 8).mean(axis=(1, 3)).max())
    assert outcome.end == "quality"
    assert 29 <= worst <= 34


def test_one_sample_says_nothing_of_its_error(integrator):
    renderer = batches(integrator)
    renderer.add(1)
    with pytest.raises(UsageError, match="one sample"):
        renderer.squared_error()


def test_few_samples_say_something(integrator):
    for samples in (2, 3, 5):
        renderer = batches(integrator)
        renderer.add(samples)
        assert renderer.squared_error().values.mean() > 0


def test_fewer_batches_are_kept_where_memory_is_short_and_none_where_it_is_too_short(integrator):
    small = batches(integrator, memory=SIZE * SIZE * (2 * 12 + 36) + 7 * SIZE * 96)  # short of four batches
    assert len(small._taken) == 2
    small.add(16)
    plenty = batches(integrator)
    plenty.add(16)
    assert small.squared_error().values.mean() == pytest.approx(plenty.squared_error().values.mean(), rel=0.5)
    with pytest.raises(MemoryLimitError, match="its own error"):
        batches(integrator, memory=SIZE * SIZE * (2 * 12 + 36))


def test_samples_of_one_pass_are_taken_together():
    """Each stretch of samples has the photons of its pass."""
    import mitsuba as mi

    from lippmann.device.pbr.scene import make_scene_features
    from lippmann.rendering.film.sample_batches import _split_by_light
    from lippmann.rendering.transport.path import PathIntegrator

    class Passes:
        pass_samples = 32

        def of_pass(self, number):
            return f"photons {number}"

    scene = mi.load_dict({"type": "scene", "sky": {"type": "constant"}})
    integrator = PathIntegrator(scene, make_scene_features(scene, has_null=False), 3)
    assert list(_split_by_light(integrator, 7, 100)) == [(integrator, 100)]
    integrator = integrator.lit_by(replace(integrator.light, photon_passes=Passes()))
    found = [(count, each.light.photons) for each, count in _split_by_light(integrator, 20, 50)]
    assert found == [(12, "photons 0"), (32, "photons 1"), (6, "photons 2")]
    assert [count for _, count in _split_by_light(integrator, 64, 32)] == [32]


@pytest.mark.long
def test_wavefronts_of_any_size_share_a_kernel(engine):
    """With photons and light vertices: the kernel of paths takes seconds to compile."""
    import drjit as dr

    import lippmann
    from lippmann.rendering.film import sample_batches
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.rendering.session import open_session

    request = RenderRequest(integrator="path", caustics="auto", spp=8, exposure=0.0)
    session = open_session(lippmann.load_scene("room"), request)
    integrator = session.integrator(rays(), np.diag([0.3, 0.3, 0.3, 1.0]))
    assert integrator.light.photons is not None
    found = batches(integrator, for_denoiser=True)
    evaluate, kernels = sample_batches.evaluate, []

    def evaluate_alone(*parts):  # passes of photons and light vertices between wavefronts have kernels of their own
        dr.kernel_history_clear()
        evaluate(*parts)
        launched = [kernel for kernel in dr.kernel_history() if "hash" in kernel]
        kernels.append(max(launched, key=lambda kernel: kernel.get("operation_count", 0))["hash"])

    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True), pytest.MonkeyPatch.context() as patch:
        patch.setattr(sample_batches, "measure_compilation", lambda started: 0.0)  # it takes the history
        patch.setattr(sample_batches, "evaluate", evaluate_alone)
        found.add(1)
        found.add(7)
        found.add(8)
        found.add(16)
    assert len(kernels) == 4
    assert len(set(kernels)) == 1


def test_batches_leave_room_for_what_else_a_pixel_takes():
    from lippmann.display.panel import PixelWindow
    from lippmann.rendering.film import memory_model
    from lippmann.rendering.film.sample_batches import _fit_batches

    most, further = memory_model.MOST_BATCHES, memory_model.FOR_DENOISER
    enough = SIZE * SIZE * (memory_model.batches(most) + further) + SIZE * memory_model.BYTES_PER_LANE
    window = PixelWindow(0, 0, SIZE, SIZE)
    assert [_fit_batches(window, 1, memory, further)[0] for memory in (enough, enough - 1)] == [most, most // 2]
