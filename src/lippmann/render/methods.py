"""From a scene before a display to a traced frame, by the method that was asked for."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lippmann.image.provenance import Transfer
from lippmann.progress import ProgressCallback, silent
from lippmann.render.batches import FullInBatches, trace_in_batches
from lippmann.render.denoise_views import denoise_views
from lippmann.render.denoised import Denoised
from lippmann.render.estimate import ERROR_LAYER, Estimate, PictureEstimator, why_no_estimate
from lippmann.render.full import Frame, trace_frame
from lippmann.render.goal import Goal, Outcome, goal_of, reach
from lippmann.render.guided import GuidedDenoiser
from lippmann.render.guides import Guides
from lippmann.render.plan import make_plan
from lippmann.render.rays import DisplayRays
from lippmann.render.reuse.renderer import trace_reused
from lippmann.render.settings import REUSING, RenderSettings

if TYPE_CHECKING:
    from lippmann.render.classic.build import BuiltClassic
    from lippmann.scene.build import BuiltScene

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Job:
    """What is to be traced.

    Attributes
    ----------
    built, integrator, source:
        The scene on the device, what is gathered in it, and along which rays.
    display_from_world:
        ``(4, 4)`` similarity to the display's frame (mm).
    transfer:
        How values become codes.
    memory:
        Bytes that may be used.
    """

    built: BuiltScene | BuiltClassic
    integrator: Any
    source: DisplayRays
    settings: RenderSettings
    display_from_world: NDArray[np.float64]
    transfer: Transfer
    memory: int
    threads: int
    progress: ProgressCallback = silent

    @property
    def box_filter(self) -> bool:
        """Samples are spread over the pixel, not all at its centre."""
        return self.settings.pixel_filter == "box"


@dataclass(frozen=True)
class Traced:
    """What came of a job.

    Attributes
    ----------
    samples:
        How many each pixel had.
    estimate:
        How good the picture is by its own account; where it is None, ``notes`` say why.
    options, seconds:
        How it was done, and what stages of its own that took.
    """

    frame: Frame
    samples: int
    estimate: Estimate | None = None
    notes: tuple[str, ...] = ()
    options: dict[str, Any] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)


def trace(job: Job) -> Traced:
    """The picture by the method of ``job.settings``."""
    goal = goal_of(job.settings)
    why = why_no_estimate(job.settings)
    if job.settings.method in REUSING:
        return _cleaned(job, _reused(job))
    if job.settings.method == "pooled":
        return _pooled(job)
    if why is not None:
        return _cleaned(job, _plain(job, why))
    if goal is None and job.settings.denoise == "none":
        return _full(job)
    return _full_until(job, goal or Goal(spp=job.settings.samples))


def _plain(job: Job, why: str) -> Traced:
    """All samples in one stream: nothing is known of the error."""
    settings, source = job.settings, job.source
    plan = make_plan(source.width, source.height, settings.samples, channels=source.channels, memory=job.memory)
    frame = trace_frame(
        job.integrator, source, plan, seed=settings.seed, box_filter=job.box_filter, progress=job.progress
    )
    return Traced(frame, settings.samples, notes=(why,))


def _full(job: Job) -> Traced:
    """So many samples, band by band."""
    frame, errors = trace_in_batches(
        job.integrator,
        job.source,
        job.settings.samples,
        seed=job.settings.seed,
        box_filter=job.box_filter,
        transfer=job.transfer,
        memory=job.memory,
        progress=job.progress,
    )
    frame.maps[ERROR_LAYER] = np.maximum(errors.values, 0)
    return Traced(frame, job.settings.samples, PictureEstimator(job.source.display).estimate(errors))


def _full_until(job: Job, goal: Goal) -> Traced:
    """As many samples as the goal takes, the noise taken out of them where that is asked for."""
    batches = FullInBatches(
        job.integrator,
        job.source,
        seed=job.settings.seed,
        box_filter=job.box_filter,
        transfer=job.transfer,
        memory=job.memory,
    )
    denoiser = _denoiser(job)
    renderer = batches if denoiser is None else Denoised(batches, denoiser, job.transfer)
    outcome = reach(goal, renderer, PictureEstimator(job.source.display), job.progress)
    frame = Frame(renderer.picture(), batches.rays, batches.seconds_compile, batches.seconds_trace)
    frame.maps[ERROR_LAYER] = np.maximum(outcome.errors.values, 0)
    return Traced(
        frame, outcome.samples, outcome.estimate, _how_it_ended(goal, outcome), *_what_was_cleaned(job, denoiser)
    )


def _reused(job: Job) -> Traced:
    settings = job.settings
    assert settings.method in ("lens-view", "interpolated")
    frame = trace_reused(
        job.integrator,
        job.source,
        method=settings.method,
        order=settings.order or "default",
        careful=settings.careful,
        samples=settings.samples,
        seed=settings.seed,
        box_filter=job.box_filter,
        transfer=job.transfer,
        memory=job.memory,
        display_from_world=job.display_from_world,
        threads=job.threads,
        progress=job.progress,
    )
    return Traced(frame, settings.samples, notes=(f"no estimate of the error: {settings.method} has more than noise",))


def _pooled(job: Job) -> Traced:
    """So many paths per pixel, and their light where every lens finds it."""
    from lippmann.render.pooled.renderer import Pooled

    settings, integrator = job.settings, job.integrator
    denoiser = None if settings.denoise == "none" else _light_denoiser(job)
    pooled = Pooled(
        integrator.scene,
        integrator.traits,
        integrator.depth,
        job.source,
        seed=settings.seed,
        box_filter=job.box_filter,
        memory=job.memory,
        denoiser=denoiser,
    )
    started = time.perf_counter()
    pooled.add(settings.samples, job.progress)
    gathered = time.perf_counter()
    frame = Frame(pooled.picture(), pooled.rays)
    frame.seconds_trace = gathered - started
    frame.seconds_reuse = time.perf_counter() - gathered
    options = {} if denoiser is None else {"denoise": settings.denoise}
    notes = (*pooled.notes, "no estimate of the error: that of pooled light is not proven")
    return Traced(frame, settings.samples, notes=notes, options=options)


def _light_denoiser(job: Job) -> Callable[[Floats, Floats, Floats], Floats]:
    """Takes the noise out of pictures of light, guided by what pooled rendering has seen of the surfaces."""

    def clean(color: Floats, albedo: Floats, normal: Floats) -> Floats:
        cleaned = denoise_views(color, job.source.display, Guides(albedo, normal), threads=job.threads)
        return np.maximum(cleaned, np.float32(0))

    return clean


def _cleaned(job: Job, traced: Traced) -> Traced:
    """What was traced without its noise, where that is asked for and nothing is known of the error anyway."""
    denoiser = _denoiser(job)
    if denoiser is None:
        return traced
    traced.frame.pixels = denoiser(traced.frame.pixels)
    options, seconds = _what_was_cleaned(job, denoiser)
    return replace(traced, options=options, seconds=seconds)


def _denoiser(job: Job) -> GuidedDenoiser | None:
    if job.settings.denoise == "none":
        return None
    return GuidedDenoiser(
        job.built,
        job.source,
        job.display_from_world,
        seed=job.settings.seed,
        box_filter=job.box_filter,
        memory=job.memory,
        threads=job.threads,
        progress=job.progress,
    )


def _what_was_cleaned(job: Job, denoiser: GuidedDenoiser | None) -> tuple[dict[str, Any], dict[str, float]]:
    if denoiser is None:
        return {}, {}
    return {"denoise": job.settings.denoise, "denoise_form": denoiser.form()}, {"denoise": denoiser.seconds}


def _how_it_ended(goal: Goal, outcome: Outcome) -> tuple[str, ...]:
    if outcome.end == "quality" or not goal.has_quality:
        return ()
    what = "the time is up" if outcome.end == "time" else "the samples are spent"
    return (f"{what} before the quality asked for was reached: {goal.describe(outcome.estimate)}",)
