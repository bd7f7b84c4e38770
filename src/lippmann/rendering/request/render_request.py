"""The request of a render, as asked for, and its plan: every decision as a value with its reason in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Coding, Transfer, pbr_neutral
from lippmann.options.choices import ASKED, Caustics, Denoiser, Integrator, Method, PixelFilter, ToneMap
from lippmann.options.integrators import INTEGRATORS
from lippmann.options.option import Option, Options, options_of
from lippmann.options.placement import PlacementOptions
from lippmann.options.quality import MachineOptions, QualityOptions
from lippmann.rendering.request.tuning import TUNING
from lippmann.scene.placement import Placement, placement_of

if TYPE_CHECKING:
    from lippmann.display import Display

T = TypeVar("T")


@dataclass(frozen=True)
class Choice(Generic[T]):
    """A decided value, and the reason for it in words."""

    value: T
    reason: str = ASKED


@dataclass(frozen=True)
class RenderPlan:
    """What a render will do.

    Attributes
    ----------
    integrator, depth, method, denoise, subpixels, pixel_filter, exposure, tone_map, caustics:
        Values of the fields of a :class:`~lippmann.rendering.request.render_request.RenderRequest`; ``exposure`` and
        ``caustics`` are "auto" where a pilot decides. ``denoise`` is ``oidn`` where the number of samples chooses the
        network's effort.
    samples:
        Samples per pixel, or sub-pixel. With a goal they are the most that are taken; None for no limit.
    quality:
        PSNR in dB at which rendering stops; None without such a goal.
    reserve:
        Most samples per pixel of a picture that is not clean by its own estimate with ``samples``; None for no more.
    pilot:
        Choices that were made by the results of the pilot, by name.
    """

    integrator: Choice[Integrator]
    depth: Choice[int]
    method: Choice[Method]
    denoise: Choice[Denoiser]
    samples: Choice[int | None]
    quality: Choice[float | None]
    reserve: Choice[int | None]
    subpixels: Choice[bool]
    pixel_filter: Choice[PixelFilter]
    exposure: Choice[float | Literal["auto"]]
    tone_map: Choice[ToneMap]
    caustics: Choice[Caustics]
    pilot: Mapping[str, Choice[object]] = field(default_factory=dict)

    def with_pilot(self, results: Mapping[str, object]) -> RenderPlan:
        """The plan with the choices of a pilot, whose results have the names of :data:`PILOT_REASONS`."""
        chosen: dict[str, object] = {}
        if self.exposure.value == "auto":
            chosen["exposure"] = results.get("exposure", 0.0)
        if self.caustics.value == "auto":
            chosen["caustics"] = results.get("caustics", "none")
        others = [name for name in PILOT_REASONS if name in results and name not in ("exposure", "caustics")]
        chosen |= {name: results[name] for name in others}
        reasons = {**PILOT_REASONS, **({"caustics": NO_CAUSTICS} if chosen.get("caustics") == "none" else {})}
        return replace(self, pilot={name: Choice(value, reasons[name]) for name, value in chosen.items()})

    @property
    def entries(self) -> dict[str, Choice[object]]:
        """All choices by name, those of the pilot in place of "auto"."""
        own = {each.name: cast("Choice[object]", getattr(self, each.name)) for each in fields(self)[:-1]}
        return {**own, **self.pilot}

    def in_words(self) -> dict[str, str]:
        """Value and reason by name, for people."""
        return {name: f"{format_value(each.value)} ({each.reason})" for name, each in self.entries.items()}

    def lines(self) -> list[str]:
        """``name: value (reason)``, as files hold it."""
        return [f"{name}: {words}" for name, words in self.in_words().items()]

    def to_dict(self) -> dict[str, dict[str, object]]:
        """Values and reasons by name, for JSON."""
        return {name: {"value": each.value, "reason": each.reason} for name, each in self.entries.items()}


#: Reasons for what a pilot chooses, by name.
PILOT_REASONS = {
    "exposure": "the pilot's median of what is lit comes to mid-grey",
    "camera_exposure": "the camera's own, from the scene",
    "caustics": "an emitter shines on mirrors, glass or smooth gloss, and photons of it land in the picture",
    "light_vertices": "the pilot met indirect light brighter than white, as of a small emitter beside a surface",
    "seen_chains": "of each path: the pilot met light brighter than white in mirrors, glass or smooth gloss",
}

#: The reason why a pilot chooses no photons.
NO_CAUSTICS = "no emitter shines on mirrors, glass or smooth gloss, or its photons hardly land in the picture"


def format_value(value: object) -> str:
    """A value of a plan, for people."""
    if value is None:
        return "open"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def default_depth(integrator: str) -> int:
    """Surfaces of a path where none are asked for."""
    plugin = INTEGRATORS.find(integrator)
    return 1 if plugin is None else plugin.value.depth


@dataclass(frozen=True)
class RenderRequest(MachineOptions, QualityOptions):
    """A request to render: quality options, the machine's options, and the display's placement.

    Each value is checked on its own here. :func:`~lippmann.rendering.request.plan.resolve` decides the values that are
    "auto" or None, and checks that the values fit together.

    Parameters
    ----------
    placement:
        Where the display stands in the scene: options, or a placement found before.
    fixed_noise:
        Whether all frames of a sequence have the same random numbers; refused for single pictures.
    judged_by:
        What tells the error of a picture without half-buffers, whose samples are of one stream and denoised together,
        for its notes; empty: half-buffers of its own.
    keep_light:
        Called with a function that prepares the picture's light and with what this depends on: the scene, its built
        form and the camera's own exposure. Returns that light, or one of an earlier picture. None: prepared anew.
    trace_through:
        Called with the :class:`~lippmann.rendering.methods.Job` and the function that traces it; returns what is
        traced. None: that function alone.
    plan:
        The plan that decided the values, with its reasons; None before :mod:`~lippmann.rendering.request.plan`.
    began:
        Reading of :func:`time.perf_counter` from which ``max_time`` counts; None: when rendering begins.

    Raises
    ------
    UsageError
        A value is unknown or out of its range.

    Examples
    --------
    >>> lippmann.RenderRequest(method="full", spp=4).spp
    4
    """

    placement: PlacementOptions | Placement = field(default_factory=PlacementOptions)
    fixed_noise: bool = False
    judged_by: str = ""
    keep_light: Callable[..., Any] | None = field(default=None, compare=False, repr=False)
    trace_through: Callable[..., Any] | None = field(default=None, compare=False, repr=False)
    plan: RenderPlan | None = field(default=None, compare=False, repr=False)
    began: float | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        Option("", "").check("fixed_noise", self.fixed_noise, bool)
        object.__setattr__(self, "placement", placement_of(self.placement))

    @classmethod
    def from_options(cls, *parts: Options, **others: Any) -> RenderRequest:
        """Make a request of several classes of options; ``others`` are further fields, and override those."""
        values = {each.name: getattr(part, each.name) for part in parts for each, _ in options_of(type(part))}
        return cls(**{**values, **others})

    def for_file(self, output: Path, bits: int | None = None) -> RenderRequest:
        """The request for a file: an automatic tone map is none for linear light (OpenEXR, 32 ``bits``)."""
        is_linear = output.suffix.lower() == ".exr" or bits == 32
        return replace(self, tone_map="none") if self.tone_map == "auto" and is_linear else self

    @property
    def reason(self) -> str:
        """The method and the reason for it, where it was decided by the plan; else empty."""
        plan = self.plan
        return "" if plan is None or plan.method.reason == ASKED else f"{plan.method.value}: {plan.method.reason}"

    @property
    def spp_reserve(self) -> int | None:
        """Sample budget per pixel where the estimate after ``spp`` samples is too low; None: rendering stops there."""
        return None if self.plan is None else self.plan.reserve.value

    @property
    def denoises(self) -> bool:
        """Whether it is decided that the picture is denoised."""
        return self.denoise not in ("none", "auto")

    @property
    def shares_light(self) -> bool:
        """Whether denoised light is shared between the micro-images."""
        return self.method == "pooled"

    @property
    def box_filter(self) -> bool:
        """Whether samples are spread over the pixel, not all at its centre."""
        return self.pixel_filter == "box"

    @property
    def is_open_ended(self) -> bool:
        """Whether rendering stops by a quality or a time instead of a number of samples."""
        return any(goal is not None for goal in (self.quality, self.quality_worst, self.max_time))

    def keeps_colors(self, display: Display) -> bool:
        """Whether rays of sub-pixels keep all three colours for the denoiser, though each sub-pixel shows one.

        Only under cylindrical lenses: on arrays, whose micro-images are short in both directions, the gain was mixed.
        """
        return bool(self.subpixels) and self.denoise != "none" and display.lens_array.layout == "lenticular"

    @property
    def careful(self) -> bool:
        """Whether pixels whose reprojection would be wrong, as of gloss and mirrors, are traced instead."""
        return self.order != "paper" if self.respect_gloss is None else self.respect_gloss

    @property
    def samples(self) -> int:
        """Samples per pixel of a picture without a goal."""
        return TUNING.usual if self.spp is None else self.spp

    @property
    def surfaces(self) -> int:
        """Ray depth: surfaces of a path."""
        return default_depth(self.integrator) if self.depth is None else self.depth

    @property
    def channels(self) -> int:
        """Sets of rays per pixel: 3 where each sub-pixel has its own, else 1."""
        return 3 if self.subpixels else 1

    def tone_mapped(self, linear: NDArray[np.float32]) -> NDArray[np.float32]:
        """Linear RGB ``(..., 3)`` as the display is to show it, after tone mapping."""
        return pbr_neutral(linear) if self.tone_map == "pbr-neutral" else linear

    @property
    def transfer(self) -> Transfer:
        """Transfer curve from values to codes: linear for the classic light models, whose values are codes already."""
        return "linear" if self.integrator == "classic" else "srgb"

    @property
    def coding(self) -> Coding:
        """How light becomes codes, tone mapping included: errors are those of the picture that is written."""
        return "pbr-neutral" if self.tone_map == "pbr-neutral" else self.transfer
