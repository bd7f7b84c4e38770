"""What a render is asked for: one value from the command line, or a call, down to the first ray."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lippmann.color.tone_map import pbr_neutral
from lippmann.color.transfer import Transfer
from lippmann.options.choices import ASKED, Integrator
from lippmann.options.option import Options, options_of
from lippmann.options.placement import PlacementOptions
from lippmann.options.quality import MachineOptions, QualityOptions
from lippmann.scene.placement import Placement, placement_of

if TYPE_CHECKING:
    from lippmann.display import Display
    from lippmann.rendering.request.render_plan import RenderPlan

#: Samples per pixel where nothing is said and light is not pooled.
DEFAULT_SPP = 16
#: Surfaces per path where nothing is said.
DEFAULT_DEPTH: dict[Integrator, int] = {"classic": 2, "path": 8, "direct": 1}


@dataclass(frozen=True)
class RenderRequest(MachineOptions, QualityOptions):
    """How a picture is to be made, on what it runs, and where the display stands.

    Every value is checked by itself here. :func:`~lippmann.rendering.request.plan.resolve` fills in what is "auto"
    or None and checks what belongs together.

    Parameters
    ----------
    placement:
        Where the display stands in the scene: options, or a placement found before.
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
