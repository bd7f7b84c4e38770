"""What a render is asked for, and its plan: every decision as a value with its reason in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer, pbr_neutral
from lippmann.options.choices import ASKED, Caustics, Denoiser, Integrator, Method, PixelFilter, ToneMap, default_depth
from lippmann.options.option import Options, options_of
from lippmann.options.placement import PlacementOptions
from lippmann.options.quality import MachineOptions, QualityOptions
from lippmann.scene.placement import Placement, placement_of

if TYPE_CHECKING:
    from lippmann.display import Display

T = TypeVar("T")


@dataclass(frozen=True)
class Choice(Generic[T]):
    """A value, and why it is this one."""

    value: T
    reason: str = ASKED


@dataclass(frozen=True)
class RenderPlan:
    """What a render will do.

    Attributes
    ----------
    integrator, depth, method, denoise, subpixels, pixel_filter, exposure, tone_map, caustics:
        As of a :class:`~lippmann.rendering.request.render_request.RenderRequest`; ``exposure`` and ``caustics`` are
        "auto" where a pilot decides. ``denoise`` is ``oidn`` where the network's effort follows the traced rays.
    samples:
        Samples per pixel, or sub-pixel; where a goal says when to stop the most of them, or None.
    quality:
        PSNR in dB that is to be reached; None for none.
    reserve:
        Samples that a picture may have that is not clean with those; None for no more.
    pilot:
        What a pilot of the scene came to, by name.
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

    def with_pilot(self, told: Mapping[str, object]) -> RenderPlan:
        """The plan with what a pilot came to, by the names of :data:`PILOT_REASONS`."""
        open_ended: dict[str, object] = {}
        if self.exposure.value == "auto":
            open_ended["exposure"] = told.get("exposure", 0.0)
        if self.caustics.value == "auto":
            open_ended["caustics"] = told.get("caustics", "none")
        others = {name: told[name] for name in PILOT_REASONS if name in told and name not in ("exposure", "caustics")}
        found = {**open_ended, **others}
        reasons = {**PILOT_REASONS, **({"caustics": NO_CAUSTICS} if found.get("caustics") == "none" else {})}
        return replace(self, pilot={name: Choice(value, reasons[name]) for name, value in found.items()})

    @property
    def entries(self) -> dict[str, Choice[object]]:
        """All choices by name; where a pilot decided, what it came to."""
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


#: What a pilot may come to, and why.
PILOT_REASONS = {
    "exposure": "the pilot's median of what is lit comes to mid-grey",
    "camera_exposure": "the camera's own, from the scene",
    "caustics": "an emitter shines on mirrors, glass or smooth gloss, and photons of it land in the picture",
    "light_vertices": "the pilot met indirect light brighter than white, as of a small emitter beside a surface",
    "seen_chains": "of each path: the pilot met light brighter than white in mirrors, glass or smooth gloss",
}

#: Why a pilot comes to no photons.
NO_CAUSTICS = "no emitter shines on mirrors, glass or smooth gloss, or its photons hardly land in the picture"


def format_value(value: object) -> str:
    """A value of a plan, for people."""
    if value is None:
        return "open"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


#: Samples per pixel where nothing is said and light is not pooled.
DEFAULT_SPP = 16


@dataclass(frozen=True)
class RenderRequest(MachineOptions, QualityOptions):
    """How a picture is to be made, on what it runs, and where the display stands.

    Every value is checked by itself here. :func:`~lippmann.rendering.request.plan.resolve` fills in what is "auto"
    or None and checks what belongs together.

    Parameters
    ----------
    placement:
        Where the display stands in the scene: options, or a placement found before.
    fixed_noise:
        Whether all frames of a sequence have the same random numbers; for nothing else.
    plan:
        Why the values are these, once all of them are decided: see :mod:`~lippmann.rendering.request.plan`.
    began:
        When the work began that ``max_time`` limits, in seconds of :func:`time.perf_counter`; None: with the rendering.

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
    plan: RenderPlan | None = field(default=None, compare=False, repr=False)
    began: float | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "placement", placement_of(self.placement))

    @classmethod
    def from_options(cls, *parts: Options, **others: Any) -> RenderRequest:
        """The request of several classes of options; ``others`` are further fields, and win."""
        values = {each.name: getattr(part, each.name) for part in parts for each, _ in options_of(type(part))}
        return cls(**{**values, **others})

    @property
    def reason(self) -> str:
        """The method and why it is this one, where it was left open; else nothing."""
        plan = self.plan
        is_told = plan is None or plan.method.reason == ASKED
        return "" if is_told or plan is None else f"{plan.method.value}: {plan.method.reason}"

    @property
    def spp_reserve(self) -> int | None:
        """Samples that a picture may have which is not clean with ``spp``; None for no more."""
        return None if self.plan is None else self.plan.reserve.value

    @property
    def denoises(self) -> bool:
        """Whether the picture is denoised whatever comes."""
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
    def has_quality(self) -> bool:
        """Whether a PSNR is to be reached."""
        return self.quality is not None or self.quality_worst is not None

    @property
    def is_open_ended(self) -> bool:
        """Whether something else than a number of samples says when to stop."""
        return self.has_quality or self.max_time is not None

    def keeps_colors(self, display: Display) -> bool:
        """Whether the rays of sub-pixels keep all three colours, whichever is shown, for a denoiser to use.

        Under cylinders; on arrays, whose micro-images are short in both directions, that was better here, worse there.
        """
        return bool(self.subpixels) and self.denoise != "none" and display.lens_array.layout == "lenticular"

    @property
    def careful(self) -> bool:
        """Whether what reprojection would falsify is traced."""
        return self.order != "paper" if self.respect_gloss is None else self.respect_gloss

    @property
    def samples(self) -> int:
        """Samples per pixel where nothing else says when to stop."""
        return DEFAULT_SPP if self.spp is None else self.spp

    @property
    def surfaces(self) -> int:
        """The depth that will be used."""
        return default_depth(self.integrator) if self.depth is None else self.depth

    @property
    def channels(self) -> int:
        """Rays with places of their own in a pixel: 3 for sub-pixels, else 1."""
        return 3 if self.subpixels else 1

    def tone_mapped(self, linear: NDArray[np.float32]) -> NDArray[np.float32]:
        """Linear RGB ``(..., 3)`` as the display is to show it, after tone mapping."""
        return pbr_neutral(linear) if self.tone_map == "pbr-neutral" else linear

    @property
    def transfer(self) -> Transfer:
        """How values become codes: those of the classic models are codes already, as their own programs write them."""
        return "linear" if self.integrator == "classic" else "srgb"
