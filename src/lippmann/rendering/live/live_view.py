"""Views and frames of the live renderer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.panel import PixelWindow
from lippmann.display.visible_pixels import EyeMap, PixelSet
from lippmann.errors import UsageError
from lippmann.options.light import LightOptions
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.matrices import rotation_of
from lippmann.scene.placement import Placement

if TYPE_CHECKING:
    from lippmann.rendering.live.live_tracer import PlacedDisplay
    from lippmann.rendering.live.scene_kernels import SceneKernels

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class LiveView:
    """Eye or window, placement and light of a picture. Equal views show the same picture.

    Parameters
    ----------
    eye:
        The eye's place in the display's frame, mm, in front of the lens plane. None: the native pixels themselves.
    size:
        Width and height in pixels of the eye's picture, which is the panel's rectangle in the lens plane.
    eye_map:
        Finds the pixels that the eye sees: through ideal lenses, or in the way of another :class:`EyeMap`.
    window:
        Where ``eye`` is None: the native pixels shown; None for the whole panel.
    row_step:
        Where ``eye`` is None: one row in ``row_step`` is traced and repeated, while something moves.
    request:
        As of a render. ``placement``, ``exposure``, ``subpixels``, ``tone_map``, ``pixel_filter``, ``seed``,
        ``integrator`` (auto, path or direct) and ``depth`` count. Samples and method are the live renderer's own.
    light:
        Direction and strength of the scene's light.

    Raises
    ------
    UsageError
        The eye is not in front of the lens plane, the size is below 1x1, or the step is below 1.
    """

    eye: Vector | None
    size: tuple[int, int] = (512, 512)
    eye_map: Callable[..., EyeMap] = EyeMap
    window: PixelWindow | None = None
    row_step: int = 1
    request: RenderRequest = field(default_factory=RenderRequest)
    light: LightOptions = field(default_factory=LightOptions)

    def __post_init__(self) -> None:
        if self.eye is not None and not (np.isfinite(self.eye).all() and self.eye[2] > 0):
            raise UsageError(f"{self.eye!r}", parameter="eye", rule="z above 0: in front of the lens plane")
        if min(self.size) < 1:
            raise UsageError(f"{self.size!r}", parameter="size", rule="at least 1x1 pixels")
        if self.row_step < 1:
            raise UsageError(f"{self.row_step!r}", parameter="row_step", rule="at least 1 row")


@dataclass(frozen=True, eq=False)
class LiveFrame:
    """A picture of a :class:`LiveView`.

    Attributes
    ----------
    pixels:
        ``(height, width, 3)`` uint8, sRGB-coded and tone-mapped.
    samples:
        Samples of each native (sub-)pixel behind it.
    is_denoised:
        Whether noise was taken out.
    placement:
        Where the display stands, with the depth range of the scene and warnings.
    exposure:
        Stops (EV) in effect.
    seconds:
        Time of its stages: ``place``, ``map`` (eye to pixels), ``trace``, ``denoise``, ``encode``.
    """

    pixels: NDArray[np.uint8]
    samples: int
    is_denoised: bool
    placement: Placement
    exposure: float
    seconds: dict[str, float]


@dataclass(frozen=True, eq=False)
class PlacedView:
    """A view with its display, as rays are traced, that display's place in the scene, and what is traced for it."""

    kernels: SceneKernels
    display: Display
    view: LiveView
    request: RenderRequest
    placement: Placement
    placed: PlacedDisplay
    pixels: PixelSet

    def light_up(self, exposure: float) -> None:
        """Set the scene's light and exposure to those of this view, if another view was traced in between."""
        if self.kernels.lit_for is self.placed:
            return
        self.kernels.light(self.view.light, rotation_of(self.placement.world_from_display))
        whole = replace(self.placement, exposure=0.0)  # ``exposure`` includes the camera's
        self.kernels.expose(self.display, replace(self.request, exposure=exposure), whole, measure=False)
        self.kernels.lit_for = self.placed
