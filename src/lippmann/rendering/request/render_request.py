"""What a render is asked for: one value from the command line, or a call, down to the first ray."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from numbers import Real
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann.color.tone_map import pbr_neutral
from lippmann.color.transfer import Transfer
from lippmann.errors import UsageError
from lippmann.rendering.request.choices import (
    ASKED,
    Caustics,
    Denoiser,
    Device,
    Effort,
    Integrator,
    Method,
    Order,
    PixelFilter,
    ToneMap,
)
from lippmann.scene.placement import Placement, PlacementOptions, placement_of

if TYPE_CHECKING:
    from lippmann.display import Display
    from lippmann.rendering.request.render_plan import RenderPlan

#: Samples per pixel where nothing is said and light is not pooled.
DEFAULT_SPP = 16
#: Surfaces per path where nothing is said.
DEFAULT_DEPTH: dict[Integrator, int] = {"classic": 2, "path": 8, "direct": 1}

#: Stops of the largest exposure, up or down.
MOST_EXPOSURE = 40

_WORDS = {
    "method": Method,
    "order": Order,
    "integrator": Integrator,
    "pixel_filter": PixelFilter,
    "device": Device,
    "effort": Effort,
    "denoise": Denoiser,
    "caustics": Caustics,
    "tone_map": ToneMap,
}
#: Lowest and highest values of the whole numbers.
_RANGES = {
    "depth": (1, 4096),
    "spp": (1, 2**24),
    "seed": (0, 2**32 - 1),
    "threads": (1, 4096),
    "memory": (1, 2**63),
}
#: Largest value and rule of the numbers above 0 that may be left open.
_POSITIVE = {
    "quality": (80.0, "must be above 0 and at most 80 dB"),
    "quality_worst": (80.0, "must be above 0 and at most 80 dB"),
    "max_time": (sys.float_info.max, "must be seconds above 0"),
    "clamp_indirect": (sys.float_info.max, "must be radiance above 0, 1 being white"),
}


@dataclass(frozen=True)
class RenderRequest:
    """How a picture is to be made, and where the display stands.

    Every value is checked by itself here. :func:`~lippmann.rendering.request.plan.resolve` fills in what is "auto"
    or None and checks what belongs together.

    Parameters
    ----------
    method:
        ``auto``: ``pooled`` where light has noise, else ``full``.
        ``full`` traces every ray. ``pooled`` denoises, and all micro-images that show a point share its light.
        ``lens-view`` reprojects points from micro-image to micro-image and traces the missed pixels. ``interpolated``
        averages the missed pixels of every other micro-image from its neighbours.
    order:
        For ``lens-view`` and ``interpolated``: ``paper`` goes lens by lens as the paper does; ``default`` (None is the
        same) in the order that traces fewer pixels.
    respect_gloss:
        For ``lens-view`` and ``interpolated``: trace what reprojection would falsify, such as mirrors, glass and
        highlights. None: in the default order, not in the paper's.
    integrator:
        ``path`` (all light), ``direct`` (light straight from emitters and environment), ``classic`` (Whitted ray
        tracing with the light models of Tachyon and NFF), or a property of the first surface: ``normal``, ``depth``,
        ``position``, ``albedo``.
    depth:
        Surfaces along a path, the primary ray's counting 1; 1 to 4096. None: 8 for ``path``, 1 for ``direct``, the
        file's own for ``classic``.
    spp:
        Samples per pixel, or per sub-pixel; 1 to 2**24. None: 16, for pooled light what the picture's size suggests, or
        with a quality or a time as many as that takes.
    effort:
        ``normal``: what the other values say. ``draft``: one sample of each pixel, denoised by the fast network.
        ``final``: until the picture is estimated at 40 dB, with at most 256 samples per pixel; 64 samples in tiles,
        forecasts and plain pictures. Neither goes with samples, a quality or a time.
    quality, quality_worst:
        PSNR in dB that the whole picture (no micro-image being worse by more than 12 dB), or every micro-image, is to
        reach by its own estimate; above 0, at most 80.
    max_time:
        Seconds of tracing after which the best picture so far is taken.
    seed:
        Of all random choices, 0 to 2**32 - 1.
    subpixels:
        Trace a ray for each sub-pixel, at its own place. None: where a slanted sheet gives each its own direction.
    pixel_filter:
        ``box`` spreads the samples over the pixel, ``point`` takes its centre.
    denoise:
        ``oidn`` denoises by Open Image Denoise with the effort that the traced rays deserve
        (:mod:`~lippmann.rendering.denoise.cost_model`), ``oidn-fast`` and ``oidn-high`` with a given one, ``none`` not
        at all.
    caustics:
        For ``path``: light that mirrors, glass and smooth gloss throw from emitters onto rough surfaces. ``photons``
        traces it from the emitters, with a blur that shrinks with the samples; ``paths`` leaves it to paths, which find
        small emitters seldom and points and directions never; ``none`` leaves it out. ``auto``: photons where a few of
        them find that there is such light, else paths.
    clamp_indirect:
        For ``path``: what light may bring to a sample at most that comes by way of another surface than the one seen,
        each time that it is met, in units of the picture's white; above 0. Fireflies go, and so does true light. None:
        no limit.
    exposure:
        Stops (EV) by which light is raised or lowered, -40 to 40; "auto": 0, and for scenes with physical light sources
        what brings the median of what is lit to mid-grey. The background's colour stays as it is.
    tone_map:
        How light becomes what the display shows: ``none`` as it is, ``pbr-neutral`` by
        :func:`lippmann.color.tone_map.pbr_neutral`, "auto" by that where light is physically based and the
        background is not of a colour that was asked for.
    layers:
        Add depth, position, normal, albedo and shape of what each pixel sees to the picture's maps.
    placement:
        Where the display stands in the scene: options, or a placement found before.
    device, threads, memory:
        Where it runs, on how many CPU threads (None: all cores), and in how many bytes (None: 60 % of what is free).
    plan:
        Why the values are these, once all of them are decided: see :mod:`~lippmann.rendering.request.plan`.
    began:
        When the work began that ``max_time`` limits, in seconds of :func:`time.perf_counter`; None: with the rendering.

    Raises
    ------
    UsageError
        A value is unknown or out of its range.
    """

    method: Method = "auto"
    order: Order | None = None
    respect_gloss: bool | None = None
    integrator: Integrator = "auto"
    depth: int | None = None
    spp: int | None = None
    effort: Effort = "normal"
    quality: float | None = None
    quality_worst: float | None = None
    max_time: float | None = None
    seed: int = 0
    subpixels: bool | None = None
    pixel_filter: PixelFilter = "auto"
    denoise: Denoiser = "auto"
    caustics: Caustics = "auto"
    clamp_indirect: float | None = None
    exposure: float | Literal["auto"] = "auto"
    tone_map: ToneMap = "auto"
    layers: bool = False
    placement: PlacementOptions | Placement = field(default_factory=PlacementOptions)
    device: Device = "auto"
    threads: int | None = None
    memory: int | None = None
    plan: RenderPlan | None = field(default=None, compare=False, repr=False)
    began: float | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        for name, words in _WORDS.items():
            value, known = getattr(self, name), get_args(words)
            if value not in known and not (name == "order" and value is None):
                raise UsageError.unknown(name, value, known, parameter=name)
        for name, (low, high) in _RANGES.items():
            value = getattr(self, name)
            if value is None and name != "seed":
                continue
            if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
                rule = f"must be a whole number from {low} to {high}"
                raise UsageError(f"{value!r}", parameter=name, rule=rule)
        for name in ("spp", "quality", "quality_worst", "max_time"):
            if self.effort != "normal" and getattr(self, name) is not None:
                is_draft = self.effort == "draft"
                raise UsageError(
                    f"{getattr(self, name):g} beside a {self.effort}{'' if is_draft else ' picture'}",
                    parameter=name,
                    rule="a draft has one sample a pixel" if is_draft else "it works until it is good by itself",
                    fix='leave it out, or use effort="normal"',
                )
        for name, (most, rule) in _POSITIVE.items():
            value = getattr(self, name)
            if value is not None and not (_is_number(value) and 0 < value <= most):
                raise UsageError(f"{value!r}", parameter=name, rule=rule)
        if self.exposure != "auto" and not (_is_number(self.exposure) and abs(self.exposure) <= MOST_EXPOSURE):
            rule = f"must be 'auto', or stops from {-MOST_EXPOSURE} to {MOST_EXPOSURE}"
            raise UsageError(f"{self.exposure!r}", parameter="exposure", rule=rule)
        for name in ("respect_gloss", "subpixels", "layers"):
            if getattr(self, name) not in (None, True, False):
                raise UsageError(f"{getattr(self, name)!r}", parameter=name, rule="must be True, False or None")
        object.__setattr__(self, "placement", placement_of(self.placement))

    @classmethod
    def of(cls, options: Mapping[str, object]) -> RenderRequest:
        """The request of keyword arguments.

        Raises
        ------
        UsageError
            A name or a value is not known.
        """
        known = [each.name for each in fields(cls) if each.name not in ("plan", "began")]
        UsageError.refuse_unknown("option of a render", options, known)
        return cls(**options)  # type: ignore[arg-type]  # checked by __post_init__

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
        return DEFAULT_DEPTH.get(self.integrator, 1) if self.depth is None else self.depth

    @property
    def channels(self) -> int:
        """Rays with places of their own in a pixel: 3 for sub-pixels, else 1."""
        return 3 if self.subpixels else 1

    def shown(self, linear: NDArray[np.float32]) -> NDArray[np.float32]:
        """Linear RGB ``(..., 3)`` as the display is to show it, after tone mapping."""
        return pbr_neutral(linear) if self.tone_map == "pbr-neutral" else linear

    @property
    def transfer(self) -> Transfer:
        """How values become codes: those of the classic models are codes already, as their own programs write them."""
        return "linear" if self.integrator == "classic" else "srgb"


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)
