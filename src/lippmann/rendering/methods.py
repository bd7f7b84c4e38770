"""The rendering methods: from a job, a scene with its rays and integrator, to a traced frame."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray

from lippmann.display.panel import PixelWindow
from lippmann.options.choices import Method
from lippmann.progress import ProgressCallback
from lippmann.rendering.adaptive.stopping import Goal, Outcome, make_goal, sample_until
from lippmann.rendering.adaptive.tuning import TUNING
from lippmann.rendering.denoise.dual_buffer import DenoisedPicture, correct_coverage, denoise_light, remove_excess
from lippmann.rendering.denoise.guided_denoiser import GuidedDenoiser
from lippmann.rendering.estimate.denoised_psnr import PictureEstimator
from lippmann.rendering.estimate.psnr import ERROR_LAYER, Estimate, Parts, PixelErrors
from lippmann.rendering.film.memory_model import cut_wavefronts
from lippmann.rendering.film.sample_batches import BatchedRender, trace_in_batches
from lippmann.rendering.film.wavefront import Frame, trace_frame
from lippmann.rendering.provenance import is_among_mirrors
from lippmann.rendering.reprojection.point_image import STATUS_LAYER, TRACED
from lippmann.rendering.request.preconditions import explain_missing_estimate
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.request.tuning import TUNING as REQUEST
from lippmann.rendering.session import Session, read_choices
from lippmann.rendering.transport.integrator import Integrator, ReusableIntegrator
from lippmann.rendering.transport.ray_source import DisplayRays, OnePicture, QuiltRays, SubpixelRays

Floats = NDArray[np.float32]

#: The layer of a picture with the number of samples that each pixel had.
SAMPLES_LAYER = "samples"


@dataclass(frozen=True, eq=False)
class Job:
    """A scene, its rays and the integrator to trace them with.

    Attributes
    ----------
    session:
        The scene on the device, the request, and the machine's share.
    integrator, source:
        The integrator, and the rays of the picture.
    display_from_world:
        ``(4, 4)`` affine map to the display's frame (mm).
    is_part:
        Whether the source is a tile of a picture that is assembled and assessed elsewhere.
    """

    session: Session
    integrator: Integrator
    source: OnePicture | QuiltRays
    display_from_world: NDArray[np.float64]
    is_part: bool = False

    @property
    def request(self) -> RenderRequest:
        """The resolved request."""
        return self.session.request

    @property
    def progress(self) -> ProgressCallback:
        """The callback of progress reports."""
        return self.session.watch.progress

    @property
    def sample_source(self) -> OnePicture | QuiltRays:
        """The source whose samples are summed; for sub-pixels that are denoised, one that keeps all colours."""
        source = self.source
        if not isinstance(source, DisplayRays) or not self.request.keeps_colors(source.display):
            return source
        return SubpixelRays(source)

    @cached_property
    def denoiser(self) -> GuidedDenoiser:
        """The denoiser of the picture, which traces its guides once."""
        return GuidedDenoiser(
            self.session.built,
            self.sample_source,
            self.display_from_world,
            box_filter=self.request.box_filter,
            memory=self.session.memory,
            threads=self.session.engine.threads,
            kind=self.request.denoise,
            shares=self.request.shares_light,
            progress=self.progress,
        )


@dataclass(frozen=True)
class Traced:
    """The result of a job.

    Attributes
    ----------
    samples:
        Samples per pixel.
    estimate:
        Estimated PSNR; where it is None, ``notes`` say why.
    options, seconds:
        Metadata of the method, and the seconds of its own stages.
    errors:
        Squared errors of the pixels; None where they are unknown.
    """

    frame: Frame
    samples: int
    estimate: Estimate | None = None
    notes: tuple[str, ...] = ()
    options: dict[str, object] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    errors: PixelErrors | None = None


def trace(job: Job) -> Traced:
    """Render by the method of ``job.request``; the number of samples per pixel is among the maps."""
    recipe, through = RECIPES[job.request.method], job.request.trace_through
    traced = recipe(job) if through is None else through(job, recipe)
    traced.frame.maps.setdefault(SAMPLES_LAYER, _count_samples(traced))
    return traced


def trace_samples(job: Job) -> Traced:
    """Full rendering: a given number of samples or as many as a goal needs; denoised if requested."""
    why = explain_missing_estimate(job.request)
    if why is not None:
        return trace_without_estimate(job, why)
    if job.is_part:
        return _denoise_part(job)
    request = job.request
    is_fixed = request.denoise == "none" and not request.is_open_ended and request.spp_reserve is None
    return _trace_fixed(job) if is_fixed else _trace_in_rounds(job)


def trace_without_estimate(job: Job, *notes: str) -> Traced:
    """A fixed number of samples without an error estimate; denoised if requested."""
    return denoise_whole(job, trace_one_stream(job, *notes))


def trace_one_stream(job: Job, *notes: str) -> Traced:
    """All samples in one stream: without half-buffers there is no error estimate."""
    request, source = job.request, job.sample_source
    plan = cut_wavefronts(
        source.width, source.height, request.samples, channels=source.channels, memory=job.session.memory
    )
    frame = trace_frame(
        job.integrator,
        source,
        plan,
        seed=request.seed,
        box_filter=request.box_filter,
        for_denoiser=request.denoise != "none",
        progress=job.progress,
    )
    return Traced(frame, request.samples, notes=notes)


def trace_reused(job: Job) -> Traced:
    """Reprojection of traced points between micro-images; denoised if requested."""
    return denoise_whole(job, _reproject(job))


#: The function of each method. ``pooled`` differs from ``full`` in that the denoiser shares light between micro-images.
RECIPES: dict[Method, Callable[[Job], Traced]] = {
    "full": trace_samples,
    "pooled": trace_samples,
    "lens-view": trace_reused,
    "interpolated": trace_reused,
}


def _count_samples(traced: Traced) -> NDArray[np.uint32]:
    """Samples per pixel ``(H, W)``; 0 for reprojected pixels."""
    status = traced.frame.maps.get(STATUS_LAYER)
    if status is None:
        # A broadcast number takes no memory.
        return np.broadcast_to(np.uint32(traced.samples), traced.frame.pixels.shape[:2])
    return np.where(status == TRACED, np.uint32(traced.samples), np.uint32(0))


def _trace_fixed(job: Job) -> Traced:
    """A fixed number of samples, in bands of rows."""
    size, samples = (job.source.width, job.source.height), job.request.samples
    frame, errors = trace_in_batches(
        lambda memory, window: _make_batches(job, memory, window), size, samples, job.session.memory, job.progress
    )
    frame.maps[ERROR_LAYER] = np.maximum(errors.values, 0)
    return Traced(frame, samples, _make_estimator(job).estimate(errors, samples))


def _trace_in_rounds(job: Job) -> Traced:
    """As many samples as the goal needs, denoised if requested."""
    batches = _make_batches(job)
    denoiser = None if job.request.denoise == "none" else job.denoiser
    picture = batches if denoiser is None else _make_denoised(job, batches, denoiser)
    goal = _start_goal(job)
    assessment = 0.0 if denoiser is None or goal.max_time is None else denoiser.probe(REQUEST.fewest)
    first = REQUEST.usual if denoiser is None else REQUEST.fewest
    outcome = sample_until(
        goal,
        batches,
        picture,
        _make_estimator(job),
        first=first if job.request.is_open_ended else job.request.samples,
        slope=1.0 if denoiser is None else TUNING.denoised_slope,
        assessment=assessment,
        progress=job.progress,
    )
    if outcome.estimate is None and goal.seconds_left(time.perf_counter() - (goal.began or 0.0)) < assessment:
        # No time is left to denoise: the picture is that of one sample.
        picture, denoiser = batches, None
    notes = _describe_end(goal, outcome)
    return _assemble(job, batches, picture, denoiser, errors=outcome.errors, estimate=outcome.estimate, notes=notes)


def _start_goal(job: Job) -> Goal:
    """The goal of the request; its time begins with the request and includes the work after the last sample."""
    # Assembling a picture and writing it takes about a tenth of a microsecond per pixel.
    writing = 1e-7 * job.source.width * job.source.height
    began = time.perf_counter() if job.request.began is None else job.request.began
    part = "view" if isinstance(job.source, QuiltRays) else "micro-image"
    return replace(make_goal(job.request), began=began, reserve=writing, part=part)


def _assemble(
    job: Job,
    batches: BatchedRender,
    picture: BatchedRender | DenoisedPicture,
    denoiser: GuidedDenoiser | None,
    *,
    errors: PixelErrors | None,
    estimate: Estimate | None,
    notes: tuple[str, ...] = (),
) -> Traced:
    """The picture of batches, with the map of its errors."""
    frame = Frame(picture.picture(), batches.rays, batches.seconds_compile, batches.seconds_trace)
    if errors is not None:
        frame.maps[ERROR_LAYER] = np.maximum(errors.values, 0)
    traced = Traced(frame, batches.samples, estimate, notes, errors=errors)
    return traced if denoiser is None else _record_denoiser(traced, denoiser)


def _make_batches(job: Job, memory: int | None = None, window: PixelWindow | None = None) -> BatchedRender:
    """The picture in batches, or a window of it within ``memory`` bytes."""
    return BatchedRender(
        job.integrator,
        job.sample_source,
        seed=job.request.seed,
        box_filter=job.request.box_filter,
        coding=job.request.coding,
        memory=memory or job.session.memory,
        window=window,
        for_denoiser=job.request.denoise != "none",
    )


def _denoise_part(job: Job) -> Traced:
    """A denoised tile with a fixed number of samples; its picture is assembled and assessed elsewhere."""
    batches = _make_batches(job)
    batches.add(job.request.samples, job.progress)
    picture = _make_denoised(job, batches, job.denoiser)
    return _assemble(job, batches, picture, job.denoiser, errors=picture.squared_error(), estimate=None)


def _make_denoised(job: Job, batches: BatchedRender, denoiser: GuidedDenoiser) -> DenoisedPicture:
    return DenoisedPicture(batches, denoiser, job.request.coding, job.session.engine.threads, denoiser.coverage)


def _make_estimator(job: Job) -> PictureEstimator:
    """The error estimator of the picture, by micro-image for a display and by view for a quilt."""
    source = job.source
    if isinstance(source, QuiltRays):
        window, (width, height) = source.window, source.view_size
        known = width * height - window.pixels
        parts = Parts.views(source.columns, source.rows, (window.width, window.height), known)
    else:
        assert isinstance(source, DisplayRays)
        parts = Parts.micro_images(source.display, source.window)
    return PictureEstimator(parts, is_among_mirrors(read_choices(job.integrator)))


def _reproject(job: Job) -> Traced:
    request = job.request
    assert request.method in ("lens-view", "interpolated")
    assert isinstance(job.source, DisplayRays)
    # Imported here: no other method uses these many modules.
    from lippmann.rendering.reprojection.renderer import trace_reused as trace_reprojected

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


def denoise_whole(job: Job, traced: Traced) -> Traced:
    """A traced picture without half-buffers, denoised if requested."""
    if job.request.denoise == "none":
        return traced
    frame, source, denoiser = traced.frame, job.sample_source, job.denoiser
    noisy = frame.pixels
    if frame.coverage is not None and (further := denoiser.coverage()) is not None:
        noisy = correct_coverage(noisy, frame.coverage, further[0] + further[1], threads=job.session.engine.threads)
    # The network runs once, not for each of two halves: its high effort is worth its time from half as many samples on.
    clean = remove_excess(denoise_light(noisy, frame.specular, denoiser, 2 * traced.samples), frame.excess)
    frame.pixels = source.own_colors(clean) if isinstance(source, SubpixelRays) else clean
    return _record_denoiser(traced, denoiser)


def _record_denoiser(traced: Traced, denoiser: GuidedDenoiser) -> Traced:
    options: dict[str, object] = {"denoise": "oidn", "denoise_effort": denoiser.used}
    return replace(traced, options=options, seconds={"denoise": denoiser.seconds})


def _describe_end(goal: Goal, outcome: Outcome) -> tuple[str, ...]:
    if outcome.estimate is None:
        return ("no estimate of the error: there was time for one sample per pixel only",)
    if outcome.end == "quality" or not goal.has_quality or not goal.is_promise:
        return ()
    what = "the time is up" if outcome.end == "time" else "the samples are spent"
    return (f"{what} before the quality asked for was reached: {goal.describe_shortfall(outcome.estimate)}",)
