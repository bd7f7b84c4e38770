"""From a scene in front of a display to a traced frame, by the method that was asked for."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from lippmann.progress import ProgressCallback
from lippmann.rendering.adaptive.convergence import Assessor, ErrorTrack
from lippmann.rendering.adaptive.extra_samples import extra_samples, is_modest
from lippmann.rendering.adaptive.method_race import (
    DENOISED_SLOPE,
    MOST_GAINED,
    MOST_GAINED_WIDE,
    MOST_GAINED_WIDE_AND_DEAR,
    WIDE_LENS,
    MethodRace,
)
from lippmann.rendering.adaptive.sample_allocation import SampleAllocation
from lippmann.rendering.adaptive.stopping import Goal, Outcome, goal_of, reach
from lippmann.rendering.denoise.cost_model import denoising_cost, effort_of, look_cost, traced_work
from lippmann.rendering.denoise.dual_buffer import Denoised
from lippmann.rendering.denoise.guided_denoiser import GuidedDenoiser
from lippmann.rendering.denoise.light_apart import clean_light, without_excess
from lippmann.rendering.denoise.oidn import Effort
from lippmann.rendering.denoise.outlines import by_coverage
from lippmann.rendering.denoise.subpixels import SubpixelBatches
from lippmann.rendering.estimate.denoised_psnr import DenoisedEstimator
from lippmann.rendering.estimate.psnr import ERROR_LAYER, Parts, PictureEstimator
from lippmann.rendering.film.sample_batches import FullInBatches, trace_in_batches
from lippmann.rendering.film.wavefront import Frame, RayTotals, trace_frame
from lippmann.rendering.film.wavefront_plan import make_plan
from lippmann.rendering.job import Job, Traced
from lippmann.rendering.light_statements import is_among_mirrors
from lippmann.rendering.reprojection.common.point_image import STATUS_LAYER, TRACED
from lippmann.rendering.reprojection.renderer import trace_reused as trace_reprojected
from lippmann.rendering.request.choices import Denoiser, Method
from lippmann.rendering.request.preconditions import why_no_estimate
from lippmann.rendering.transport.integrator import Integrator, ReusableIntegrator
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import DisplayRays, QuiltRays, SubpixelRays, WindowRays

Floats = NDArray[np.float32]

#: The layer of a picture with the number of samples that each pixel had.
SAMPLES_LAYER = "samples"

#: Samples per pixel that are taken at once where paths come without chains and look up no photons: launches have a cost
#: of their own.
_CHEAP_TOGETHER = 4.0
#: Samples per pixel from which on cheap ones are divided among the pixels.
FEWEST_DIVIDED = 8
#: Share of the pixels that may show images of small emitters where noise is to tell which need more samples.
MOST_WITH_IMAGES = 0.01
#: What putting a picture together and writing it takes, as a rule.
_SECONDS_PER_PIXEL_WRITTEN = 1e-7


def trace(job: Job) -> Traced:
    """The picture by the method of ``job.request``, with the samples of each pixel among its maps."""
    traced = RECIPES[job.request.method](job)
    traced.frame.maps.setdefault(SAMPLES_LAYER, _samples_of_pixels(traced))
    return traced


def trace_samples(job: Job) -> Traced:
    """Every pixel's own samples: a given number, or as many as a goal takes; denoised where that is asked for."""
    why = why_no_estimate(job.request)
    if why is not None:
        return _denoised_whole(job, _one_stream(job, why))
    if job.treatment is not None:
        return _denoised_part(job)
    if job.request.denoise == "none" and not job.request.is_open_ended:
        return _fixed_samples(job)
    goal = goal_of(job.request) or Goal(spp=job.request.samples)
    return _until(job, replace(goal, part="view") if isinstance(job.source, QuiltRays) else goal)


def trace_reused(job: Job) -> Traced:
    """Points of one micro-image reprojected into the others; denoised where that is asked for."""
    return _denoised_whole(job, _reused(job))


#: How each method makes a picture. Pooled light differs from full rendering in what the denoiser shares.
RECIPES: dict[Method, Callable[[Job], Traced]] = {
    "full": trace_samples,
    "pooled": trace_samples,
    "lens-view": trace_reused,
    "interpolated": trace_reused,
}


def _samples_of_pixels(traced: Traced) -> NDArray[np.uint32]:
    """``(H, W)``; pixels that were filled from others have had none."""
    status = traced.frame.maps.get(STATUS_LAYER)
    if status is None:
        # One number for all takes no memory, however large the picture is.
        return np.broadcast_to(np.uint32(traced.samples), traced.frame.pixels.shape[:2])
    return np.where(status == TRACED, np.uint32(traced.samples), np.uint32(0))


def _one_stream(job: Job, why: str) -> Traced:
    """All samples in one stream: nothing is known of the error."""
    request, source = job.request, job.traced
    plan = make_plan(source.width, source.height, request.samples, channels=source.channels, memory=job.session.memory)
    frame = trace_frame(
        job.integrator,
        source,
        plan,
        seed=request.seed,
        box_filter=request.box_filter,
        for_denoiser=request.denoise != "none",
        progress=job.progress,
    )
    return Traced(frame, request.samples, notes=(why,))


def _fixed_samples(job: Job) -> Traced:
    """So many samples, band by band."""
    frame, errors = trace_in_batches(
        job.integrator,
        job.source,
        job.request.samples,
        seed=job.request.seed,
        box_filter=job.request.box_filter,
        transfer=job.request.transfer,
        memory=job.session.memory,
        progress=job.progress,
    )
    frame.maps[ERROR_LAYER] = np.maximum(errors.values, 0)
    return Traced(frame, job.request.samples, _estimator(job).estimate(errors))


def _most_gained(job: Job) -> float:
    """By how much pooling gains at most, by the lenses of a display; views of a quilt count as narrow ones."""
    source = job.source
    if isinstance(source, QuiltRays) or source.display.pixels_per_lens[0] < WIDE_LENS:
        return MOST_GAINED
    return MOST_GAINED_WIDE_AND_DEAR if _is_dear(job.integrator) else MOST_GAINED_WIDE


def _is_dear(integrator: Integrator) -> bool:
    """Whether each sample comes with chains, or looks up photons."""
    if not isinstance(integrator, PathIntegrator):
        return False
    return integrator.photons is not None or integrator.seen_chains is not None


def _until(job: Job, goal: Goal) -> Traced:
    """As many samples as the goal takes, the noise taken out of them where that is asked for or proves better."""
    writing = _SECONDS_PER_PIXEL_WRITTEN * job.source.width * job.source.height
    began = time.perf_counter() if job.request.began is None else job.request.began
    goal = replace(goal, began=began, reserve=writing)
    batches = _batches(job)
    estimator = _estimator(job)

    def rays() -> float:
        return _rays_per_pixel(job, batches.rays)

    plain = _Candidate(batches, ErrorTrack(batches, estimator))
    denoised = None if job.request.denoise == "none" else _denoised_candidate(job, goal, batches, rays)
    if denoised is None:
        assessor: Assessor = plain.track
    elif job.request.denoise == "auto":
        assessor = MethodRace(goal, plain.track, denoised.track, rays, _most_gained(job))
    else:
        assessor = denoised.track
    add: Callable[[int, ProgressCallback], None] = batches.add
    if denoised is not None and divides_samples(job):
        assert isinstance(denoised.renderer, Denoised)
        add = allocation(job, batches, denoised.renderer).add
    outcome = reach(goal, add, assessor, job.progress, probe=batches.probe)
    more = extra_samples(outcome, job.request.spp_reserve)
    if more:
        outcome = _with_more(outcome, more, add, assessor, job.progress)
    options: dict[str, object] = {}
    notes = _end_notes(goal, outcome)
    method = job.request.method
    won = denoised or plain
    if isinstance(assessor, MethodRace):
        assert denoised is not None
        reason = assessor.reason
        if outcome.estimate is None and goal.seconds_left(time.perf_counter() - began) >= denoised.track.seconds():
            # An assessment takes more: it cleans halves.
            reason = "a single sample, which tells no error, is best without its noise"
        elif assessor.leader == "plain":
            won = plain
        if method == "full":
            method = "full" if won is plain else "pooled"
            options["auto"] = f"{method}: {reason}"
        elif won is plain:
            notes = (*notes, f"the light is not pooled: {reason}")
    frame = Frame(won.renderer.picture(), batches.rays, batches.seconds_compile, batches.seconds_trace)
    frame.maps[SAMPLES_LAYER] = batches.samples_of_pixels()
    if outcome.errors is not None:
        frame.maps[ERROR_LAYER] = np.maximum(outcome.errors.values, 0)
    seconds = {} if denoised is None or denoised.denoiser is None else {"denoise": denoised.denoiser.seconds}
    options |= _denoiser_options(job, won.denoiser)
    return Traced(frame, outcome.samples, outcome.estimate, notes, options, seconds, method=method)


def _with_more(
    outcome: Outcome,
    more: int,
    add: Callable[[int, ProgressCallback], None],
    assessor: Assessor,
    progress: ProgressCallback,
) -> Outcome:
    add(more, progress)
    samples = outcome.samples + more
    assessment = assessor.assess(samples, 1.0)
    return replace(outcome, estimate=assessment.estimate, errors=assessment.errors, samples=samples)


def divides_samples(job: Job) -> bool:
    """Whether samples are divided among the pixels by their noise.

    Not where a quality is promised, nor among many images of small emitters: what is noisy is seen there, but not what
    all samples of a pixel have missed. Few samples that are cheap are taken in one launch.
    """
    images = job.integrator.mirror_images if isinstance(job.integrator, PathIntegrator) else None
    few = images is None or images.with_images <= MOST_WITH_IMAGES * job.traced.width * job.traced.height
    is_worth = job.request.samples >= FEWEST_DIVIDED or _is_dear(job.integrator)
    return few and is_worth and not job.request.is_open_ended


def allocation(job: Job, batches: FullInBatches, denoised: Denoised | None = None) -> SampleAllocation:
    """Divides the samples of ``batches``: by the ``denoised`` picture where it is at hand, else by a fast look."""
    threads = job.session.engine.threads

    def rays() -> float:
        return _rays_per_pixel(job, batches.rays)

    def look() -> Denoised:
        quick = _denoiser(job, rays, "fast")
        assert quick is not None
        return Denoised(batches, quick.denoise, job.request.transfer, threads, coverage=quick.coverage)

    def cost() -> float:
        spent = rays()
        return denoising_cost("fast") / spent if spent else math.inf

    return SampleAllocation(batches, denoised, (look, cost), threads)


def _batches(job: Job) -> FullInBatches:
    source = job.traced
    kind = SubpixelBatches if isinstance(source, SubpixelRays) else FullInBatches
    return kind(
        job.integrator,
        source,
        seed=job.request.seed,
        box_filter=job.request.box_filter,
        transfer=job.request.transfer,
        memory=job.session.memory,
        for_denoiser=job.request.denoise != "none",
    )


def _denoised_part(job: Job) -> Traced:
    """So many samples without their noise, for a picture that is put together and assessment elsewhere."""
    batches = _batches(job)
    batches.add(job.request.samples, job.progress)
    denoiser = _denoiser(job, lambda: _rays_per_pixel(job, batches.rays))
    assert denoiser is not None
    denoised = _denoised(job, batches, denoiser)
    errors = denoised.squared_error()
    frame = Frame(denoised.picture(), batches.rays, batches.seconds_compile, batches.seconds_trace)
    frame.maps[ERROR_LAYER] = np.maximum(errors.values, 0)
    seconds = {"denoise": denoiser.seconds}
    return Traced(frame, batches.samples, options=_denoiser_options(job, denoiser), seconds=seconds, errors=errors)


@dataclass(frozen=True)
class _Candidate:
    """A picture that grows, the track of its error, and its denoiser."""

    renderer: FullInBatches | Denoised
    track: ErrorTrack
    denoiser: GuidedDenoiser | None = None


def _denoised(job: Job, batches: FullInBatches, denoiser: GuidedDenoiser) -> Denoised:
    share = denoiser.share if denoiser.shares_afterwards else None
    return Denoised(
        batches, denoiser.denoise, job.request.transfer, job.session.engine.threads, share, denoiser.coverage
    )


def _denoised_candidate(job: Job, goal: Goal, batches: FullInBatches, rays: Callable[[], float]) -> _Candidate:
    denoiser = _denoiser(job, rays)
    assert denoiser is not None
    renderer = _denoised(job, batches, denoiser)
    seconds = 0.0 if goal.max_time is None else denoiser.probe()

    def worth_from() -> float:
        if is_modest(goal):
            return 0.0
        spent = rays()
        if not spent:
            return 0.0 if _is_dear(job.integrator) else _CHEAP_TOGETHER
        return batches.samples * look_cost(spent) / spent

    track = ErrorTrack(renderer, _estimator(job, DenoisedEstimator), DENOISED_SLOPE, seconds, worth_from)
    return _Candidate(renderer, track, denoiser)


def _rays_per_pixel(job: Job, rays: RayTotals) -> float:
    return traced_work(rays.primary, rays.shadow, rays.secondary) / (job.traced.width * job.traced.height)


def _estimator(job: Job, kind: type[PictureEstimator] = PictureEstimator) -> PictureEstimator:
    """Judges a display's picture by its micro-images, a quilt by its views."""
    estimator = _estimator_of_parts(job, kind)
    if is_among_mirrors(job.session.choices):
        estimator.expect_mirrors()
    return estimator


def _estimator_of_parts(job: Job, kind: type[PictureEstimator]) -> PictureEstimator:
    source = job.source
    if isinstance(source, QuiltRays):
        window, (width, height) = source.window, source.view_size
        known = width * height - window.pixels
        return kind(Parts.views(source.columns, source.rows, (window.width, window.height), known))
    if isinstance(source, WindowRays):
        return kind(Parts.micro_images(source.display, source.window))
    return kind(source.display)


def _reused(job: Job) -> Traced:
    request = job.request
    assert request.method in ("lens-view", "interpolated")
    assert isinstance(job.source, DisplayRays)
    frame = trace_reprojected(
        cast("ReusableIntegrator", job.integrator),
        job.source,
        method=request.method,
        order=request.order or "default",
        careful=request.careful,
        samples=request.samples,
        seed=request.seed,
        box_filter=job.request.box_filter,
        transfer=job.request.transfer,
        memory=job.session.memory,
        display_from_world=job.display_from_world,
        threads=job.session.engine.threads,
        progress=job.progress,
    )
    return Traced(frame, request.samples, notes=(f"no estimate of the error: {request.method} has more than noise",))


def _denoised_whole(job: Job, traced: Traced) -> Traced:
    """What was traced without its noise, where that is asked for and nothing is known of the error anyway."""
    denoiser = _denoiser(job, lambda: _rays_per_pixel(job, traced.frame.rays))
    if denoiser is None:
        return traced
    frame, source = traced.frame, job.traced
    noisy = frame.pixels
    if frame.coverage is not None and (further := denoiser.coverage()) is not None:
        noisy = by_coverage(noisy, frame.coverage, further[0] + further[1], threads=job.session.engine.threads)
    (cleaned,) = clean_light(noisy, frame.seen, denoiser, None)
    cleaned = without_excess(cleaned, frame.excess)
    frame.pixels = source.own_colors(cleaned) if isinstance(source, SubpixelRays) else cleaned
    return replace(traced, options=_denoiser_options(job, denoiser), seconds={"denoise": denoiser.seconds})


def _denoiser(job: Job, rays_per_pixel: Callable[[], float], effort: Effort | None = None) -> GuidedDenoiser | None:
    """By the effort that so many rays are worth, or by that which is given."""
    asked: Denoiser = "oidn" if job.request.denoise == "auto" else job.request.denoise
    if asked == "none":
        return None
    common = job.treatment
    return GuidedDenoiser(
        job.session.built,
        job.traced,
        job.display_from_world,
        seed=job.request.seed,
        box_filter=job.request.box_filter,
        memory=job.session.memory,
        threads=job.session.engine.threads,
        effort=lambda: effort or (effort_of(asked, rays_per_pixel()) if common is None else common.effort),
        exposure=None if common is None else common.exposure,
        # Where a denoised picture is free to be the best one, it shares its light.
        shares=job.request.shares_light or job.request.denoise == "auto",
        progress=job.progress,
    )


def _denoiser_options(job: Job, denoiser: GuidedDenoiser | None) -> dict[str, object]:
    if denoiser is None:
        return {}
    return {"denoise": "oidn", "denoise_effort": denoiser.used, "denoise_form": denoiser.form()}


def _end_notes(goal: Goal, outcome: Outcome) -> tuple[str, ...]:
    if outcome.estimate is None:
        return ("no estimate of the error: there was time for one sample per pixel only",)
    if outcome.end == "quality" or not goal.has_quality:
        return ()
    what = "the time is up" if outcome.end == "time" else "the samples are spent"
    return (f"{what} before the quality asked for was reached: {goal.describe_shortfall(outcome.estimate)}",)
