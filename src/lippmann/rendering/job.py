"""What is to be traced, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lippmann.progress import ProgressCallback
from lippmann.rendering.estimate.pixel_errors import PixelErrors
from lippmann.rendering.estimate.psnr import Estimate
from lippmann.rendering.film.wavefront import Frame
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import Session
from lippmann.rendering.transport.integrator import Integrator
from lippmann.rendering.transport.ray_source import DisplayRays, OnePicture, QuiltRays, SubpixelRays, WindowRays


@dataclass(frozen=True, eq=False)
class Job:
    """What is to be traced.

    Attributes
    ----------
    session:
        The scene on the device, the request, and the machine's share.
    integrator, source:
        What is gathered along which rays.
    display_from_world:
        ``(4, 4)`` affine map to the display's frame (mm).
    is_part:
        Of a picture that is denoised in parts, which is put together and assessed elsewhere.
    """

    session: Session
    integrator: Integrator
    source: OnePicture | QuiltRays
    display_from_world: NDArray[np.float64]
    is_part: bool = False

    @property
    def request(self) -> RenderRequest:
        """How the picture is to be made."""
        return self.session.request

    @property
    def progress(self) -> ProgressCallback:
        """Whom to tell how far it is."""
        return self.session.watch.progress

    @property
    def traced(self) -> OnePicture | QuiltRays:
        """Whose samples are gathered: of sub-pixels that are denoised, all colours."""
        source = self.source
        if not isinstance(source, DisplayRays | WindowRays) or not self.request.keeps_colors(source.display):
            return source
        return SubpixelRays(source)


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
    errors:
        Those of the pixels, where they are known.
    """

    frame: Frame
    samples: int
    estimate: Estimate | None = None
    notes: tuple[str, ...] = ()
    options: dict[str, object] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    errors: PixelErrors | None = None
