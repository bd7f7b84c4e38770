"""The experiment: scenes are rendered in several ways, timed, and compared with full tracing.

The caller renders (:data:`Renderer`), so that tests need no engine. Times are the seconds of tracing and reusing;
loading, building and compiling are left out. The ways of rendering a scene take turns: the first turns warm up, and the
median of the others counts.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from lippmann.display import Display
from lippmann.image import IntegralImage
from lippmann.metrics import Comparison, compare
from lippmann.progress import Progress, ProgressCallback, silent

#: Name of this work in progress reports.
STAGE = "reproducing the paper"


class Manner(Enum):
    """Order and treatment of gloss in the methods that reuse points; the value is for headings."""

    PAPER = "As the paper does it"
    DEFAULT = "In the default order"
    GLOSS = "In the default order, gloss respected"


@dataclass(frozen=True)
class Variant:
    """A way of rendering: a method, and a manner if it reuses points (None for full tracing, the reference)."""

    method: str
    manner: Manner | None = None

    @property
    def key(self) -> str:
        """Short name for JSON."""
        return self.method if self.manner is None else f"{self.method}-{self.manner.name.lower()}"

    @property
    def title(self) -> str:
        """For tables."""
        words = {None: "", Manner.PAPER: ", as in the paper", Manner.DEFAULT: "", Manner.GLOSS: ", gloss respected"}
        return self.method + words[self.manner]

    @property
    def order(self) -> str | None:
        """As in :class:`~lippmann.rendering.request.render_request.RenderRequest`."""
        if self.manner is None:
            return None
        return "paper" if self.manner is Manner.PAPER else "default"

    @property
    def respect_gloss(self) -> bool | None:
        """As in :class:`~lippmann.rendering.request.render_request.RenderRequest`."""
        return None if self.manner is None else self.manner is Manner.GLOSS


#: The methods that reuse points.
METHODS = ("lens-view", "interpolated")

#: The variant with which all others are compared.
REFERENCE = Variant("full")

#: Every way that is measured.
VARIANTS = (REFERENCE, *(Variant(method, manner) for manner in Manner for method in METHODS))

#: Those compared with full tracing.
COMPARED = VARIANTS[1:]

Renderer = Callable[[str, Variant], IntegralImage]


@dataclass(frozen=True)
class Experiment:
    """The experiment: its pictures, and how often each is rendered.

    Parameters
    ----------
    scenes:
        Names of bundled scenes; the figures of missed pixels show the first.
    display:
        The display that they are rendered for.
    runs, warm_up:
        Renderings whose times count, and those before them.
    """

    scenes: tuple[str, ...]
    display: Display
    runs: int = 3
    warm_up: int = 1

    def __post_init__(self) -> None:
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
    """All runs of an experiment, by scene and variant; ``physical`` are those with physically based light, if any."""

    experiment: Experiment
    runs: Mapping[str, Mapping[str, Run]] = field(default_factory=dict)
    physical: Results | None = None

    def of(self, scene: str, key: str) -> Run:
        """The run of one scene by a variant's key."""
        return self.runs[scene][key]

    def full(self, scene: str) -> Run:
        """The full tracing of one scene."""
        return self.runs[scene][REFERENCE.key]

    def of_manner(self, manner: Manner) -> list[Variant]:
        """The variants of one manner, in the order of :data:`METHODS`."""
        return [variant for variant in VARIANTS if variant.manner is manner]


def run_experiment(experiment: Experiment, render: Renderer, progress: ProgressCallback = silent) -> Results:
    """Render everything, scene by scene; errors of the renderer pass through."""
    turns = experiment.warm_up + experiment.runs
    total = len(experiment.scenes) * len(VARIANTS) * turns
    done = 0
    runs: dict[str, dict[str, Run]] = {}
    for scene in experiment.scenes:
        images: dict[str, IntegralImage] = {}
        seconds: dict[str, list[float]] = {variant.key: [] for variant in VARIANTS}
        for turn in range(turns):
            for variant in VARIANTS:
                progress(Progress(STAGE, done, total, f"{scene}, {variant.title}"))
                image = images[variant.key] = render(scene, variant)
                if turn >= experiment.warm_up:
                    seconds[variant.key].append(working_seconds(image))
                done += 1
        medians = {key: statistics.median(values) for key, values in seconds.items()}
        runs[scene] = _compare_runs(scene, images, medians)
    progress(Progress(STAGE, total, total))
    return Results(experiment, runs)


def working_seconds(image: IntegralImage) -> float:
    """Seconds that a picture took to trace and to reuse."""
    seconds = image.provenance.seconds
    return seconds.get("trace", 0.0) + seconds.get("reuse", 0.0)


def _compare_runs(scene: str, images: Mapping[str, IntegralImage], seconds: Mapping[str, float]) -> dict[str, Run]:
    full = images[REFERENCE.key]
    full_rays = sum(full.provenance.rays.values())
    runs = {}
    for variant in VARIANTS:
        image = images[variant.key]
        comparison = None if variant is REFERENCE else compare(full, image)
        runs[variant.key] = Run(
            scene, variant, image, seconds[variant.key], seconds[REFERENCE.key], full_rays, comparison
        )
    return runs
