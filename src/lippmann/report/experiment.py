"""The experiment: scenes rendered in several ways, timed, and compared with full tracing.

How a picture is rendered is the caller's business (:data:`Renderer`), so that what follows from the pictures can be
tested without an engine. Times are the seconds of tracing and reusing, with everything loaded, built and compiled: a
scene's ways take turns, the first turns warm up, and the median of the others counts.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from lippmann.display import Display
from lippmann.image import IntegralImage
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.quality import Comparison, compare

#: What progress reports call this work.
STAGE = "reproducing the paper"


@dataclass(frozen=True)
class Variant:
    """A way of rendering.

    Parameters
    ----------
    key:
        Short name for JSON.
    title:
        For tables.
    method, order, respect_gloss:
        As in :class:`~lippmann.render.settings.RenderSettings`.
    """

    key: str
    title: str
    method: str
    order: str = "default"
    respect_gloss: bool = False

    @property
    def is_reference(self) -> bool:
        """Whether this is full tracing, which all others are compared with."""
        return self.method == "full"


REFERENCE = Variant("full", "full", "full")

#: Every way that is measured, full tracing first.
VARIANTS = (
    REFERENCE,
    Variant("lens-view-paper", "lens-view, order of the paper", "lens-view", "paper"),
    Variant("interpolated-paper", "interpolated, order of the paper", "interpolated", "paper"),
    Variant("lens-view", "lens-view, default order", "lens-view"),
    Variant("interpolated", "interpolated, default order", "interpolated"),
    Variant("lens-view-gloss", "lens-view, gloss respected", "lens-view", respect_gloss=True),
    Variant("interpolated-gloss", "interpolated, gloss respected", "interpolated", respect_gloss=True),
)

Renderer = Callable[[str, Variant], IntegralImage]


@dataclass(frozen=True)
class Experiment:
    """What is rendered, and how often.

    Parameters
    ----------
    scenes:
        Names of bundled scenes; the figures of missed pixels show the first.
    display:
        The display that they are rendered for.
    variants:
        One of them full tracing.
    runs, warm_up:
        Renderings whose times count, and those before them.
    """

    scenes: tuple[str, ...]
    display: Display
    variants: tuple[Variant, ...] = VARIANTS
    runs: int = 3
    warm_up: int = 1

    def __post_init__(self) -> None:
        if sum(variant.is_reference for variant in self.variants) != 1:
            raise ValueError("exactly one of the variants must be full tracing")
        if self.runs < 1 or not self.scenes:
            raise ValueError("there must be a scene and a run")


@dataclass(frozen=True, eq=False)
class Run:
    """One scene rendered in one way.

    Parameters
    ----------
    image:
        The picture; of equal ones (the same seed) that of the last run.
    seconds:
        Median of the runs, see above.
    full_seconds, full_rays:
        Those of full tracing.
    comparison:
        With full tracing; None for that itself.
    """

    scene: str
    variant: Variant
    image: IntegralImage
    seconds: float
    full_seconds: float
    full_rays: int
    comparison: Comparison | None = None

    @property
    def rays(self) -> int:
        """Rays of all kinds."""
        return sum(self.image.provenance.rays.values())

    @property
    def ray_share(self) -> float:
        """Rays of all kinds, as a share of full tracing's."""
        return self.rays / self.full_rays

    @property
    def time_share(self) -> float:
        """Seconds, as a share of full tracing's."""
        return self.seconds / self.full_seconds

    @property
    def saved_seconds(self) -> float:
        """Seconds less than full tracing takes; negative if it takes more."""
        return self.full_seconds - self.seconds

    @property
    def saved_percent(self) -> float:
        """The same in percent of full tracing's."""
        return 100 * (1 - self.time_share)

    @property
    def traced_share(self) -> float:
        """The share of the pixels that were traced."""
        traced = self.image.provenance.traced_fraction
        return 1.0 if traced is None else traced


@dataclass(frozen=True, eq=False)
class Results:
    """All runs of an experiment, by scene and variant."""

    experiment: Experiment
    runs: Mapping[str, Mapping[str, Run]] = field(default_factory=dict)

    def of(self, scene: str, key: str) -> Run:
        """The run of one scene by a variant's key."""
        return self.runs[scene][key]

    @property
    def reference(self) -> Variant:
        """The variant that is full tracing."""
        return next(variant for variant in self.experiment.variants if variant.is_reference)

    @property
    def compared(self) -> tuple[Variant, ...]:
        """The variants that are not."""
        return tuple(variant for variant in self.experiment.variants if not variant.is_reference)


def run_experiment(experiment: Experiment, render: Renderer, progress: ProgressCallback = silent) -> Results:
    """Render everything, scene by scene; errors of the renderer pass through."""
    turns = experiment.warm_up + experiment.runs
    total = len(experiment.scenes) * len(experiment.variants) * turns
    done = 0
    runs: dict[str, dict[str, Run]] = {}
    for scene in experiment.scenes:
        images: dict[str, IntegralImage] = {}
        seconds: dict[str, list[float]] = {variant.key: [] for variant in experiment.variants}
        for turn in range(turns):
            for variant in experiment.variants:
                progress(Progress(STAGE, done, total, f"{scene}, {variant.title}"))
                image = images[variant.key] = render(scene, variant)
                if turn >= experiment.warm_up:
                    seconds[variant.key].append(working_seconds(image))
                done += 1
        medians = {key: statistics.median(values) for key, values in seconds.items()}
        runs[scene] = _judged(scene, experiment.variants, images, medians)
    progress(Progress(STAGE, total, total))
    return Results(experiment, runs)


def working_seconds(image: IntegralImage) -> float:
    """Seconds that a picture took to trace and to reuse."""
    seconds = image.provenance.seconds
    return seconds.get("trace", 0.0) + seconds.get("reuse", 0.0)


def _judged(
    scene: str, variants: tuple[Variant, ...], images: Mapping[str, IntegralImage], seconds: Mapping[str, float]
) -> dict[str, Run]:
    full = next(variant.key for variant in variants if variant.is_reference)
    full_rays = sum(images[full].provenance.rays.values())
    return {
        variant.key: Run(
            scene,
            variant,
            images[variant.key],
            seconds[variant.key],
            seconds[full],
            full_rays,
            None if variant.is_reference else compare(images[full], images[variant.key]),
        )
        for variant in variants
    }
